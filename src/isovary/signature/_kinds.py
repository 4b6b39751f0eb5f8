"""What distinguishes the signatures beside their formulas."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from ..geometry import Floats
from ..records import Eigenpairs
from ._energies import wave_energies
from ._frequencies import frequencies_of
from ._global_point import global_point_signature
from ._heat_kernel import heat_kernel_signature
from ._scale_invariant import scale_invariant_heat_kernel_signature
from ._times import diffusion_times
from ._wave_kernel import wave_kernel_signature


@dataclass(frozen=True)
class SignatureKind:
    """What a comparison must know of a signature beside its function.

    Parameters
    ----------
    short : str
        Prefix of the arrays' names in files.
    title : str
        Name for titles.
    samples : callable
        From the base's eigenpairs and a number: the array that the function takes as its
        second argument, the same for both surfaces. It may be shorter than asked for.
    columns : callable
        From the samples: the value on the axis of each of the signature's columns.
    axis : str
        Label of that axis.
    unit : str
        Unit of the signature.
    logarithmic : bool
        Whether the axis is.
    """

    short: str
    title: str
    samples: Callable[[Eigenpairs, int], Floats]
    columns: Callable[[Floats], Floats]
    axis: str
    unit: str
    logarithmic: bool

    @property
    def abbreviation(self) -> str:
        """What stands in brackets behind the name, or the name."""
        return self.title.rpartition("(")[2].rstrip(")")

    @property
    def per_time(self) -> bool:
        """Whether each column belongs to one diffusion time."""
        return self.samples is diffusion_times and self.columns is _same


def signature_kind(method: Callable[..., Floats]) -> SignatureKind:
    """Times, axis, unit and names of a signature, from its function.

    Parameters
    ----------
    method : callable
        A method of the signature room, or ``functools.partial`` of one. A function of
        your own of eigenpairs and times is taken to be of the heat kernel
        signature's kind: a column per diffusion time, 1/length^2.

    Returns
    -------
    SignatureKind

    Notes
    -----
    Cost: none.

    Examples
    --------
    A partial function is known by what it wraps, and the number of columns follows it:

    >>> kind = signature_kind(partial(scale_invariant_heat_kernel_signature, frequencies=8))
    >>> kind.short, len(kind.columns(np.geomspace(0.1, 10, 50)))
    ('sihks', 8)
    """
    options: dict[str, Any] = {}
    if isinstance(method, partial):
        options, method = method.keywords, method.func
    for function, kind in _KINDS.items():
        if function is method:
            if function is scale_invariant_heat_kernel_signature and "frequencies" in options:
                return replace(kind, columns=partial(frequencies_of, count=options["frequencies"]))
            return kind
    name = getattr(method, "__name__", type(method).__name__)
    name = name if name.isidentifier() else "signature"
    return replace(_KINDS[heat_kernel_signature], short=name, title=name)


def _same(samples: Floats) -> Floats:
    return samples


def _enough_times(pairs: Eigenpairs, count: int) -> Floats:
    return diffusion_times(pairs, max(count, 40))  # the usual frequencies need 32


def _numbers(pairs: Eigenpairs, count: int) -> Floats:
    kept = int(0.85 * len(pairs.values)) + 1  # a coarser mesh may lose the others with a multiplet
    return np.arange(1.0, min(count, kept - pairs.zero_count) + 1)


_KINDS: dict[Callable[..., Floats], SignatureKind] = {
    heat_kernel_signature: SignatureKind(
        short="hks",
        title="heat kernel signature (HKS)",
        samples=diffusion_times,
        columns=_same,
        axis="diffusion time t (length²)",
        unit="1 / length²",
        logarithmic=True,
    ),
    scale_invariant_heat_kernel_signature: SignatureKind(
        short="sihks",
        title="scale-invariant HKS (SI-HKS)",
        samples=_enough_times,
        columns=frequencies_of,
        axis="frequency (cycles per e-fold of t)",
        unit="dimensionless",
        logarithmic=False,
    ),
    wave_kernel_signature: SignatureKind(
        short="wks",
        title="wave kernel signature (WKS)",
        samples=wave_energies,
        columns=_same,
        axis="energy (1/length²)",
        unit="1 / length²",
        logarithmic=True,
    ),
    global_point_signature: SignatureKind(
        short="gps",
        title="global point signature (GPS)",
        samples=_numbers,
        columns=_same,
        axis="eigenpair",
        unit="dimensionless",
        logarithmic=False,
    ),
}
