"""What a comparison refuses before it begins to work."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from .errors import ArgumentError, FieldError
from .geometry import Floats
from .levels import fewest_vertices
from .methods import Methods, method_name
from .scalar_field import ScalarField
from .task import Match

_LARGER = 10.0  # times: no change of a parameter, but another unit of length


def check_fields(
    base: ScalarField, perturbed: ScalarField, isovalue: float, through: Sequence[ScalarField]
) -> None:
    """All are fields that take the isovalue; an error tells which is not."""
    members = ((f"through[{number}]", field) for number, field in enumerate(through))
    for name, field in (("base", base), ("perturbed", perturbed), *members):
        if not isinstance(field, ScalarField):
            raise ArgumentError(
                "A03",
                f"{name}: expected a ScalarField, got {type(field).__name__}; read files with "
                "read_field, make arrays into ScalarField(values, spacing=..., origin=...)",
            )
        try:
            field.check_isovalue(isovalue)
        except FieldError as error:
            raise FieldError(error.code, f"{name} field: {error.message}") from None
    _check_sizes(base, perturbed)


def _check_sizes(base: ScalarField, perturbed: ScalarField) -> None:
    """Boxes of one unit: not ten times as large one as the other."""
    sizes = [np.ptp(np.stack(field.bounds), axis=0) for field in (base, perturbed)]
    ratio = float(np.linalg.norm(sizes[1]) / np.linalg.norm(sizes[0]))
    if not 1 / _LARGER < ratio < _LARGER:
        raise FieldError(
            "I05",
            f"boxes: expected about the same size, got {_sides(sizes[0])} and {_sides(sizes[1])}; "
            "give both files the spacing of one unit of length",
        )


def _sides(size: Floats) -> str:
    return " x ".join(f"{side:.4g}" for side in size)


def check_numbers(
    vertices: int | None,
    order: int,
    pairs: int,
    times: int,
    groups: int | str,
    accuracy: float | None,
    noise_meshes: int,
) -> None:
    """Values that would fail only after minutes of work fail now."""
    bounds = {"pairs": (pairs, 10), "times": (times, 2), "noise_meshes": (noise_meshes, 1)}
    if groups != "auto":
        bounds["groups"] = (_number_of_groups(groups), 1)
    for name, (value, least) in bounds.items():
        if value < least:
            raise ArgumentError("A02", f"{name}: expected at least {least}, got {value}")
    if accuracy is not None and not 0 < accuracy < 1:
        raise ArgumentError(
            "A02", f"accuracy: expected a part of the change between 0 and 1, got {accuracy}"
        )
    if accuracy is not None and vertices is not None:
        raise ArgumentError("A02", "accuracy: expected no vertices beside it, which fix the mesh")
    if order not in (1, 2):
        raise ArgumentError("A02", f"order: expected 1 or 2, got {order}")
    least = 13 * fewest_vertices(order, pairs) // 10
    if vertices is not None and vertices < least:
        raise ArgumentError(
            "M09",
            f"vertices: expected at least {least} for {pairs} eigenpairs on this mesh and on the "
            f"coarser one of the noise floor, got {vertices}; ask for more, or for fewer pairs",
        )


def _number_of_groups(groups: int | str) -> int:
    if isinstance(groups, str):
        raise ArgumentError("A02", f"groups: expected a number or 'auto', got {groups!r}")
    return groups


def check_methods(
    methods: Methods,
    clustering: Callable[..., object],
    correspondence: Match | None,
    through: Sequence[ScalarField],
) -> None:
    """Methods are functions, and see what a carried mesh changes."""
    for name, method in (
        ("mesher", methods.mesher),
        ("laplacian", methods.laplacian),
        ("signature", methods.signature),
        ("clustering", clustering),
        ("correspondence", correspondence),
    ):
        if method is not None and not callable(method):
            raise ArgumentError(
                "A03",
                f"{name}: expected a function such as isovary.{_EXAMPLES[name]}, got {method!r}",
            )
    own = sorted({"vertices", "order"} & set(getattr(methods.mesher, "keywords", {})))
    if own:
        raise ArgumentError(
            "A02",
            f"mesher: expected one without {', '.join(own)} of its own, got "
            f"{method_name(methods.mesher)}; give them to compare",
        )
    if correspondence is not None and through:
        raise ArgumentError(
            "A02",
            f"through: expected none with {method_name(correspondence)}, got {len(through)}: only "
            "a carried mesh goes through members",
        )
    if correspondence is None and not methods.sees_lengths:
        raise ArgumentError(
            "A02",
            "laplacian: expected an operator that sees lengths for a carried mesh, got "
            "uniform_graph, which sees only its edges, the same on both surfaces; use "
            "correspondence=normal_rays (--correspondence normal-rays), or another operator",
        )


_EXAMPLES = {
    "mesher": "distmesh",
    "laplacian": "cotangent",
    "signature": "wave_kernel_signature",
    "clustering": "k_medoids",
    "correspondence": "normal_rays",
}
