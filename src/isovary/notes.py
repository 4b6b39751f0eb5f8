"""What a reader must know before trusting a comparison."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np

from .errors import IsovaryError
from .geometry import Floats
from .signature import diffusion_radius

if TYPE_CHECKING:
    from .comparison import Comparison

_RIGID_SHARE = 0.25
_HELP = {
    "mesh": "ask for more vertices",
    "pairs": "ask for more eigenpairs",
    "samples": "only a finer grid helps",
    "rounding": "nothing helps but another origin or offset of the data",
}
_TURNED = 90.0  # degrees
_COVERED = 0.99
_STILL_THERE = 0.5


@contextmanager
def noted_warnings() -> Iterator[list[str]]:
    """Collect the texts of UserWarnings, the first of each code, to become notes; others pass."""
    texts: list[str] = []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", UserWarning)
        try:
            yield texts
        except IsovaryError as error:  # what was noticed may tell why
            for warning in caught:
                error.add_note(f"note: {warning.message}")
            raise
    _sort(caught, texts)


def _sort(caught: list[warnings.WarningMessage], texts: list[str]) -> None:
    """The first UserWarning of each code to the texts; the others go on."""
    codes = set()
    for warning in caught:
        text = str(warning.message)
        if warning.category is not UserWarning:
            warnings.warn_explicit(
                warning.message, warning.category, warning.filename, warning.lineno
            )
        elif text[-5:] not in codes:
            codes.add(text[-5:])
            texts.append(text)


def reader_notes(result: Comparison, wanted_noise: float) -> tuple[str, ...]:
    """What a reader must know before trusting the picture, each note a sentence or two.

    Parameters
    ----------
    result : Comparison
        Complete but for its notes.
    wanted_noise : float
        Share of the change above which noise and coarse samples are worth a note.

    Returns
    -------
    tuple of str
        Notes on known faults end with their code.
    """
    return (
        *_methods(result),
        *_motion(result),
        *_noise(result, wanted_noise),
        *_shape(result),
        *_meshes(result),
        *_pairs(result),
    )


def _methods(result: Comparison) -> Iterator[str]:
    methods = result.methods
    if methods.kind.short == "gps":
        yield (
            "The columns of the global point signature are eigenfunctions: their signs, and their "
            "rotation where eigenvalues nearly agree, are arbitrary on both surfaces. Most of this "
            "change is false. [S09]"
        )
    if methods.biased:
        yield (
            f"The operator {result.choices['laplacian']} errs on every mesh alike, and the noise "
            "floor does not hold that: compare with fem before you trust this change. [L02]"
        )
    if methods.fixed and result.topology.boundary_loops == 0:
        yield "The isosurface is closed: there is no rim for the Dirichlet boundary. [I05]"


def _motion(result: Comparison) -> Iterator[str]:
    found = result.alignment
    if found.share <= _RIGID_SHARE:
        return
    shift, motion = float(np.linalg.norm(shift_of(result))), found.motion
    said = f"shift {shift:.3g}, turn {motion.angle:.2g} degrees"
    said += ", and a mirror" if motion.mirrored else ""
    explains = f"A rigid motion ({said}) explains {found.share:.0%} of the squared distance"
    isometric = result.choices["correspondence"] == "carried" and (
        result.choices["carrying"] == "isometric"
    )
    if motion.mirrored or motion.angle > _TURNED:
        explains += " (so large a turn, or a mirror, may be axes in another order in the file)"
    if result.choices["alignment"] == "rigid":
        yield f"{explains} between the two isosurfaces; it was taken out first."
    elif not isometric:
        yield (
            f"{explains} between the two isosurfaces. It changes no intrinsic shape, but along "
            "normals it slides corresponding points: part of the change may be false. Align them."
        )


def shift_of(result: Comparison) -> Floats:
    """How far the motion that brings the perturbed onto the base moves the base's centre (3,)."""
    centre = result.base.points.mean(axis=0)
    shift: Floats = centre - result.alignment.motion.inverse.apply(centre)
    return shift


def _noise(result: Comparison, wanted: float) -> Iterator[str]:
    carried = result.choices["correspondence"] == "carried"
    if not result.change.any():
        yield "The two isosurfaces are identical: no change at all. [C06]"
    elif not result.significant.any():
        yield "The change is nowhere twice the noise floor: nothing is shown as change."
    elif result.relative_noise > wanted:
        parts = {part: result.choices[f"noise_of_the_{part}"] for part in _HELP}
        largest = max(parts, key=lambda part: np.nan_to_num(parts[part]))  # type: ignore[call-overload]
        yield (
            f"The noise floor is {result.relative_noise:.2g} of the change (rms), above the "
            f"{wanted:.2g} wanted. Most of it is that of the {largest}: "
            + (_HELP[largest] if carried or largest != "mesh" else "carry the mesh")
            + "."
        )
    if result.choices["base"]["smoothing"]:  # type: ignore[index]
        yield (
            "The fields were smoothed: curved parts shrink, and the noise floor holds what is left "
            "of white noise in the data, not of noise that neighbouring samples shared before. "
            "Compare two measurements of one object to see how much remains. [I09]"
        )
    samples = result.choices["noise_of_the_samples"]
    if isinstance(samples, float) and not samples <= wanted:
        if samples == samples:
            yield (
                f"The samples of the fields cause an error of {samples:.2g} of the change (rms): "
                "only a finer grid tells more."
            )
        else:
            yield (
                "What the samples of the fields contribute is unknown: every other one gives no "
                "such isosurface, or one that the box cuts elsewhere"
                + (
                    " (of an even number of samples along an axis the last is left out: crop one)."
                    if _even(result)
                    else "."
                )
            )


def _even(result: Comparison) -> bool:
    """Whether rims lie on the box of a field with an even number of samples along some axis."""
    shape = result.choices["base"]["shape"]  # type: ignore[index]
    return result.topology.boundary_loops > 0 and any(count % 2 == 0 for count in shape)


def _meshes(result: Comparison) -> list[str]:
    """Meshes that are not fit for finite elements."""
    return [
        f"the {name} mesh is not clean: {'; '.join(quality.faults)}; look at mesh_quality.png [M14]"
        for name, quality in (
            ("base", result.base_quality),
            ("perturbed", result.perturbed_quality),
        )
        if not quality.clean
    ]


def _shape(result: Comparison) -> Iterator[str]:
    if result.topology.components > 1:
        own = "its own" if result.methods.by_component else "the whole surface's"
        yield (
            f"The isosurface has {result.topology.components} components; the change of each is "
            f"relative to {own} mean signature. [I06]"
        )
    if result.topology.boundary_loops > 0:
        yield (
            f"The isosurface leaves the box: {result.topology.boundary_loops} rim(s). "
            + _rim_words(result)
            + _held_words(result)
            + " [I05]"
        )
    for match in result.components:
        if not match.same:
            yield f"Not compared, and grey on the base: {match}. [C01]"
    if result.coverage < 1:
        lost = int((~result.correspondence.found).sum())
        yield f"{lost} nodes found no partner; they are grey, not unchanged. [C02]"
    if result.audit.perturbed_coverage < _COVERED:
        missed = 1 - result.audit.perturbed_coverage
        yield f"{missed:.1%} of the perturbed surface is the partner of nothing. [C02]"
    if result.audit.turned.any():
        yield (
            f"{result.audit.folded:.1%} of the base is matched to places in the wrong order: "
            "triangles turned over on the way. [C05]"
        )
    silent = np.isnan(result.change).any(axis=1) & result.correspondence.found
    if silent.any():
        yield (
            f"{silent.sum()} nodes have no signature, on a rim where all is 0 or with a partner "
            "there; they are grey, not unchanged. [C02]"
        )


def _pairs(result: Comparison) -> Iterator[str]:
    sizes = np.sqrt(np.nanmean(result.change**2, axis=0))
    clear = result.significant.any() and result.relative_noise < 1
    if clear and result.methods.is_heat and sizes[0] > _STILL_THERE * sizes.max():
        radius = diffusion_radius(result.times[0])
        yield (
            f"At the smallest scale that the pairs resolve ({radius:.3g}) the change is still "
            f"{sizes[0] / sizes.max():.0%} of its largest: some of it is finer. Ask for more "
            "eigenpairs. [S07]"
        )
    used = len(result.base_pairs.values)
    if used < result.choices["pairs"]:  # type: ignore[operator]
        yield f"Only {used} eigenpairs are used: more would cut a group of equal eigenvalues. [S04]"


def _held_words(result: Comparison) -> str:
    """What alignment may not take out, and what that does."""
    held = result.alignment.held
    if not held:
        return ""
    return (
        f" Faces along {', '.join(held)} cut it, so a shift along {', '.join(held)}, or a turn out "
        "of these faces, is not taken out: they show another piece of the material, and what "
        "drifted through them counts as change."
    )


def _rim_words(result: Comparison) -> str:
    """What a rim does to the signature, and on how many nodes."""
    words = "is 0 at a rim" if result.methods.fixed else "doubles at a rim at small times"
    if result.methods.kind.short != "hks":
        return "The surface ends there, and near it the signature shows that."
    near = result.near_rim.mean(axis=0)
    return (
        f"The signature {words}, whatever the shape: within 2 sqrt(t) of it lie {near[0]:.0%} of "
        f"the nodes at the smallest time, {near[-1]:.0%} at the largest."
    )
