"""What is compared and how: the fields made alike and aligned, and every choice."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256

import numpy as np

from .alignment import Alignment, align
from .errors import FieldError, IsovaryError
from .families import sweep_family
from .geometry import rim_nodes
from .level_sets import LevelSet, moved
from .matching import match_components, part_of
from .meshing import better_interpolation, contour, interpolation_errors
from .methods import Methods, method_name
from .projection import outward_normals, project
from .records import Correspondence, Surface
from .rigid_motion import RigidMotion
from .scalar_field import ScalarField
from .topology_change import topology_change

Match = Callable[[Surface, Surface], Correspondence]
"""A method of the correspondence room."""


@dataclass(frozen=True, eq=False)
class Task:
    """What is compared and how, the same on every mesh.

    Parameters
    ----------
    fields : tuple of ScalarField
        Base, members between, perturbed; of one interpolation.
    isovalue : float
    alignments : tuple of Alignment
        How each field but the first is brought onto the first.
    methods : Methods
    align : bool
        Whether they are applied.
    order, pairs : int
        Of the elements; of eigenpairs.
    match : callable, optional
        None where the mesh is carried.
    isometric : bool
        Carried isometrically, or along the normals.
    only_matching : bool
        Components without a partner of equal topology are left out, else they are an error.
    """

    fields: tuple[ScalarField, ...]
    isovalue: float
    alignments: tuple[Alignment, ...]
    methods: Methods
    align: bool = True
    order: int = 2
    pairs: int = 300
    match: Match | None = None
    isometric: bool = True
    only_matching: bool = False

    @property
    def base(self) -> ScalarField:
        """The field that is meshed."""
        return self.fields[0]

    @property
    def perturbed(self) -> ScalarField:
        """The other one, in its own coordinates."""
        return self.fields[-1]

    @property
    def motion(self) -> RigidMotion:
        """What is applied to bring the perturbed field onto the base."""
        return self.alignments[-1].motion if self.align else RigidMotion()

    @property
    def path(self) -> list[LevelSet]:
        """The fields that a mesh is carried through, from the base to the perturbed one."""
        if not self.align:
            return list(self.fields)
        others = zip(self.fields[1:], self.alignments, strict=True)
        return [self.base, *(moved(field, found.motion) for field, found in others)]

    @property
    def choices(self) -> dict[str, object]:
        """Every choice for the record."""
        base, *through, perturbed = self.fields
        members = {"through": [field_facts(member) for member in through]} if through else {}
        methods, match = self.methods, self.match
        return {
            "field": base.name,
            "base": field_facts(base),
            "perturbed": field_facts(perturbed),
            **members,
            "interpolation": "logarithmic" if base.logarithmic else "plain",
            "interpolation_errors_at_half_resolution": interpolation_errors(base, self.isovalue),
            "mesher": method_name(methods.mesher),
            "order": self.order,
            "laplacian": method_name(methods.laplacian),
            "signature": method_name(methods.signature),
            "pairs": self.pairs,
            "scaling": methods.scaling,
            "alignment": "rigid" if self.align else "off",
            "correspondence": "carried" if match is None else method_name(match),
            "carrying": "isometric" if self.isometric else "along normals",
            "only_matching": self.only_matching,
        }


def field_facts(field: ScalarField) -> dict[str, object]:
    """What identifies a field: its grid, its smoothing and the digest of its samples."""
    return {
        "shape": list(field.values.shape),
        "spacing": field.spacing.tolist(),
        "origin": field.origin.tolist(),
        "smoothing": field.smoothing,
        "sha256": sha256(field.values.tobytes()).hexdigest(),
    }


def same_interpolation(fields: Sequence[ScalarField], isovalue: float) -> tuple[ScalarField, ...]:
    """The fields with the interpolation that serves the first better.

    A first one that is logarithmic already stays so.
    """
    base = fields[0]
    chosen = base if base.logarithmic else better_interpolation(base, isovalue)
    logarithmic = chosen.logarithmic and all(field.values.min() > 0 for field in fields)
    return tuple(replace(field, logarithmic=logarithmic) for field in fields)


def aligned(fields: Sequence[ScalarField], isovalue: float) -> tuple[Alignment, ...]:
    """How each field but the first is brought onto the first, each from where the last one was.

    Components that come or go do not count, unless none stays.
    """
    rough = [contour(field, isovalue) for field in fields]
    points = project(rough[0].points, fields[0], isovalue)
    base = Surface(points, rough[0].triangles, outward_normals(points, fields[0], isovalue))
    found: list[Alignment] = []
    for mesh, field in zip(rough[1:], fields[1:], strict=True):
        _check_boxes(base, fields[0], field)
        last = found[-1].motion if found else RigidMotion()
        here, there = _that_stay(base, last.surface(mesh))
        more = align(here, there, moved(field, last), isovalue)
        if not last.is_identity:  # as it came
            before = align(here, last.inverse.surface(there), field, isovalue).rms_before
            more = replace(more, motion=more.motion.after(last), rms_before=before)
        found.append(more)
    return tuple(found)


def _that_stay(base: Surface, perturbed: Surface) -> tuple[Surface, Surface]:
    """The components of both that belong together; all if none does."""
    same = [match for match in match_components(base, perturbed) if match.same]
    if not same:
        return base, perturbed
    kept = part_of(base, [match.base for match in same])[0]
    return kept, part_of(perturbed, [match.perturbed for match in same])[0]


def _check_boxes(base: Surface, field: ScalarField, other: ScalarField) -> None:
    """The faces of the box that cut the base are faces of the other field's box."""
    rim = base.points[rim_nodes(base.triangles)]
    size = float(np.ptp(np.stack(field.bounds), axis=0).max())
    for side in (0, 1):
        face = field.bounds[side]
        cut = (np.abs(rim - face) < 1e-9 * size).any(axis=0)
        if (cut & (np.abs(face - other.bounds[side]) > 1e-9 * size)).any():
            raise FieldError(
                "I05",
                f"boxes: expected the same where they cut the isosurface, got {_box(field)} and "
                f"{_box(other)}; crop both fields to one box",
            )


def _box(field: ScalarField) -> str:
    low, high = (", ".join(f"{x:.6g}" for x in end) for end in field.bounds)
    return f"({low}) to ({high})"


def where_topology_changes(task: Task) -> str:
    """Between which two fields, and where, in a sentence for the error."""
    last = len(task.fields) - 1
    try:
        family = sweep_family(range(last + 1), task.fields, task.isovalue)
        found = topology_change(family, 0, last)
    except IsovaryError:
        return "where it happens cannot be told: the fields have different grids"
    place = ", ".join(f"{round(x, 9) + 0.0:.4g}" for x in found.place)
    return (
        f"{found.kind}: at {found.parameter:.4g} on the way from the base (0) to the perturbed "
        f"field ({last})"
        + (f", near ({place})" if found.refined else "")
        + "; between the fields their values are mixed, so only members tell the parameter itself"
    )
