"""Values at corresponding points."""

from __future__ import annotations

import numpy as np

from ..errors import ArgumentError
from ..geometry import Floats, shape_functions
from ..records import Correspondence, Surface


def interpolate(correspondence: Correspondence, perturbed: Surface, values: Floats) -> Floats:
    """Values of the perturbed surface at each base node's partner.

    The perturbed elements' own shape functions are used: three for order 1
    (the thesis's barycentric combination), six for order 2. With
    ``values=perturbed.points`` the result is the partners' places on the curved elements.

    Parameters
    ----------
    correspondence : Correspondence
        For n base nodes.
    perturbed : Surface
        With n' nodes.
    values : array (n', T)
        For example a signature.

    Returns
    -------
    array (n, T)
        NaN rows where there is no partner.

    Raises
    ------
    ArgumentError
        A03 for values that are not one row for each node of ``perturbed``, or a
        correspondence with another surface.

    Examples
    --------
    The centre of a triangle takes the mean of its corners:

    >>> triangle = Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> centre = Correspondence([0], [[1 / 3, 1 / 3, 1 / 3]], [0.0], [1])
    >>> interpolate(centre, triangle, np.array([[1.0], [2.0], [6.0]])).round(12).tolist()
    [[3.0]]

    Where that is:

    >>> interpolate(centre, triangle, triangle.points).round(3).tolist()
    [[0.333, 0.333, 0.0]]
    """
    last = int(correspondence.triangle.max(initial=-1))
    if values.ndim != 2 or len(values) != len(perturbed.points) or last >= len(perturbed.triangles):
        raise ArgumentError(
            "A03",
            f"values, correspondence: expected shape ({len(perturbed.points)}, T) and triangles "
            f"below {len(perturbed.triangles)}, got {values.shape} and triangle {last}; give the "
            "surface that both belong to",
        )
    result = np.full((len(correspondence.triangle), values.shape[1]), np.nan)
    found = correspondence.found
    weights = shape_functions(correspondence.barycentric[found], perturbed.order)
    nodes = perturbed.triangles[correspondence.triangle[found]]
    result[found] = np.einsum("ni,nit->nt", weights, values[nodes], optimize=True)
    return result
