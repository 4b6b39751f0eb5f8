"""Two signatures at corresponding points -> scaled change (thesis 4.1.5)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .errors import ArgumentError
from .geometry import Floats
from .records import Eigenpairs


def heat_trace_scale(pairs: Eigenpairs, times: ArrayLike) -> Floats:
    """Mean of the heat kernel signature over the surface, the scale that a change is divided by.

    w(t) = sum_i exp(-lambda_i t) / area. Unlike a sum over vertices it does not
    depend on how dense the mesh is.

    Returns
    -------
    array (T,)
        Unit 1/length^2.

    Examples
    --------
    On the unit sphere 4 pi t w(t) = 1 + t / 3 + t^2 / 15 for small t, 1.034 at t = 0.1:

    >>> from isovary.laplacian import fem
    >>> from isovary.shapes import icosphere
    >>> from isovary.spectrum import eigenpairs
    >>> scale = heat_trace_scale(eigenpairs(fem(icosphere(3)), 225), [0.1])
    >>> round(4 * np.pi * 0.1 * float(scale[0]), 3)
    1.034
    """
    decay = np.exp(-np.outer(pairs.values, np.asarray(times, dtype=float)))
    scale: Floats = decay.sum(axis=0) / pairs.area
    return scale


def mean_size(signature: Floats, areas: Floats) -> Floats:
    """Mean over the surface of a signature's absolute value, to divide the change of any one by.

    w_j = sum_x a_x abs(S_j(x)) / sum_x a_x over the nodes x of area a_x. For the heat
    kernel signature it is :func:`heat_trace_scale` but for the quadrature; take
    that one, which is exact.

    Parameters
    ----------
    signature : array (n, T)
        Of the base. Rows with a NaN are left out.
    areas : array (n,)
        Part of the surface that each node stands for, such as the row sums of the
        mass matrix; length^2.

    Returns
    -------
    array (T,)
        Unit of the signature.

    Raises
    ------
    ArgumentError
        A03 for unequal numbers of nodes; A02 if no node is known or a column's mean
        is 0, which nothing can be divided by: leave that column out.

    Notes
    -----
    Cost: n T operations.

    References
    ----------
    Thesis, section 4.1.5, with the surface's area in place of the number of vertices.

    Examples
    --------
    Three quarters of the area have 1 and one quarter -3, 0.75 * 1 + 0.25 * 3 = 1.5:

    >>> mean_size(np.array([[1.0], [-3.0], [np.nan]]), np.array([3.0, 1.0, 5.0])).tolist()
    [1.5]
    """
    if signature.ndim != 2 or areas.shape != signature.shape[:1]:
        raise ArgumentError(
            "A03",
            "signature, areas: expected shapes (n, T) and (n,), got "
            f"{signature.shape} and {areas.shape}",
        )
    known = ~np.isnan(signature).any(axis=1)
    size: Floats = areas[known] @ np.abs(signature[known])
    if not (size > 0).all():
        raise ArgumentError(
            "A02",
            f"signature: expected a mean above 0 in every column, got {int((size <= 0).sum())} "
            f"of {len(size)} without, over {int(known.sum())} known nodes; leave them out",
        )
    mean: Floats = size / areas[known].sum()
    return mean


def signature_difference(
    base: Floats, perturbed: Floats, scale: Floats, *, parameter_step: float = 1.0
) -> Floats:
    """Scaled change of a signature: base minus perturbed, divided by the base's scale.

    change(x, t) = (base(x, t) - perturbed(x', t)) / w(t) / parameter_step.
    The thesis prints a product with w; its stated reason, that small times must
    not drown the large ones, and its source ask for the quotient.

    Parameters
    ----------
    base, perturbed : array (n, T)
        Signatures at corresponding points; NaN rows where there is no partner.
    scale : array (T,) or (n, T)
        Positive weights of the base, such as :func:`heat_trace_scale` or
        :func:`mean_size`; a row for each node where the pieces of a surface have their own.
        The same for both surfaces, or uniform growth would vanish.
    parameter_step : float
        Change of the simulation's parameter, to get a derivative.

    Returns
    -------
    array (n, T)
        Dimensionless (per parameter unit); NaN where a partner is missing.

    Raises
    ------
    ArgumentError
        A03 for unequal shapes, A02 for a scale that is not positive or a zero step.

    References
    ----------
    Thesis, section 4.1.5.

    Examples
    --------
    >>> signature_difference(np.array([[3.0, 2.0]]), np.array([[2.0, 2.0]]), np.array([4.0, 2.0]))
    array([[0.25, 0.  ]])
    """
    if base.shape != perturbed.shape or scale.shape not in (base.shape, base.shape[1:]):
        raise ArgumentError(
            "A03",
            "signatures: expected equal shapes (n, T) and a scale (T,) or (n, T), got "
            f"{base.shape}, {perturbed.shape} and {scale.shape}",
        )
    if not (scale > 0).all() or parameter_step == 0:
        raise ArgumentError(
            "A02",
            "scale, parameter_step: expected positive weights and a step other than 0, got a "
            f"smallest weight of {scale.min():g} and a step of {parameter_step:g}",
        )
    change: Floats = (base - perturbed) / scale / parameter_step
    return change


def change_norm(change: Floats) -> Floats:
    """Mean over times of the absolute change of each node, the length of its vector in L1.

    Parameters
    ----------
    change : array (n, T)

    Returns
    -------
    array (n,)
        NaN where a partner is missing.

    Examples
    --------
    >>> change_norm(np.array([[0.25, -0.75]]))
    array([0.5])
    """
    norm: Floats = np.abs(change).mean(axis=1)
    return norm
