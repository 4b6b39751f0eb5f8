"""The walk through the rooms: two fields and an isovalue in, every intermediate result out."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .alignment import RigidMotion, rigid_part
from .clustering import k_medians
from .correspondence import closest_point, interpolate
from .difference import change_norm
from .errors import (
    ArgumentError,
    FieldError,
    IsovaryError,
)
from .geometry import Bools, Floats, Topology, topology
from .laplacian import fem
from .levels import (
    FIRST_VERTICES,
    WANTED_NOISE,
    Level,
    Match,
    Progress,
    Walk,
    fewest_vertices,
    make_level,
    refined_levels,
    relative_rms,
)
from .meshing import Mesher, better_interpolation, interpolation_errors, marching_cubes
from .methods import Methods, Operator, Signature, method_name
from .noise import SIGNIFICANCE, sampling_floor
from .notes import noted_warnings, reader_notes
from .quality import MeshQuality, mesh_quality
from .records import Clusters, Correspondence, Eigenpairs, Surface
from .rims import near_rim, rim_distance
from .scalar_field import ScalarField
from .signature import heat_kernel_signature

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False, repr=False)
class Comparison:
    """Everything that a comparison of two isosurfaces made, from the meshes to the groups.

    Arrays with n rows have one per point of ``base``; T is the number of the signature's
    columns: of times, for the heat kernel signature.

    Parameters
    ----------
    isovalue : float
        Of both isosurfaces.
    base, perturbed : Surface
        The two meshes: one connectivity if the base was carried.
    base_pairs, perturbed_pairs : Eigenpairs
        The same number of pairs.
    methods : Methods
        Mesher, operator and signature; ``methods.kind`` says what the columns are.
    times : array (T,)
        Diffusion times of both, length^2; or what else the signature is sampled at:
        energies of the wave kernel signature, numbers of eigenpairs.
    base_signature, perturbed_signature : array (n, T)
        Signatures at corresponding points, NaN rows without a partner; 1/length^2 for
        the heat kernel.
    correspondence : Correspondence
    change : array (n, T)
        Scaled change, base minus perturbed; NaN rows without a partner.
    unit_area_change : array (n, T)
        The change after both surfaces were scaled to the base's area: without uniform growth.
    noise_floor : array (n, T)
        Numerical error of ``change`` from the mesh and the samples; see
        :func:`isovary.noise_floor` and :func:`isovary.sampling_floor`.
    significant : array (n,)
        True where the norm of the change exceeds twice that of the noise floor.
    clusters : Clusters
        Groups of the significant nodes; -1 elsewhere.
    topology : Topology
        Of both isosurfaces.
    base_quality, perturbed_quality : MeshQuality
        How good the two meshes are.
    motion : RigidMotion
        Rigid part of the displacement.
    notes : tuple of str
        What the reader must know, each with its code.
    choices : dict
        Every choice, default or not, that made the result.
    timings : dict
        Seconds by stage.
    """

    isovalue: float
    base: Surface
    perturbed: Surface
    base_pairs: Eigenpairs
    perturbed_pairs: Eigenpairs
    methods: Methods
    times: Floats
    base_signature: Floats
    perturbed_signature: Floats
    correspondence: Correspondence
    change: Floats
    unit_area_change: Floats
    noise_floor: Floats
    significant: Bools
    clusters: Clusters
    topology: Topology
    base_quality: MeshQuality
    perturbed_quality: MeshQuality
    motion: RigidMotion
    notes: tuple[str, ...]
    choices: dict[str, object]
    timings: dict[str, float]

    @property
    def coverage(self) -> float:
        """Part of the base nodes that have a partner."""
        return float(self.correspondence.found.mean())

    @property
    def columns(self) -> Floats:
        """Value (T,) of each column on the signature's axis: its time, energy, frequency..."""
        return self.methods.kind.columns(self.times)

    @property
    def rim_distance(self) -> Floats:
        """Distance (n,) of the base's nodes to a rim; infinite on a closed surface."""
        return rim_distance(self.base)

    @property
    def near_rim(self) -> Bools:
        """Mask (n, T) where a rim shows in the heat kernel signature: within 2 sqrt(t) of it.

        ArgumentError A02 for a signature whose columns are no diffusion times.
        """
        if not self.methods.kind.per_time:
            raise ArgumentError(
                "A02",
                f"near_rim: expected a signature over times, got {self.methods.kind.title}; use "
                "isovary.near_rim(result.base, times) with times of your own",
            )
        return near_rim(self.base, self.times)

    @property
    def change_norm(self) -> Floats:
        """Mean absolute scaled change over the times (n,), NaN without a partner."""
        return change_norm(self.change)

    def __repr__(self) -> str:
        most = np.nanmax(self.change_norm) if np.isfinite(self.change_norm).any() else np.nan
        return (
            f"Comparison(isovalue={self.isovalue:g}, {len(self.base.points)} nodes, "
            f"{len(self.times)} times, largest change {most:.3g}, "
            f"relative noise {self.relative_noise:.2g}, "
            f"{self.significant.mean():.0%} significant, {len(self.notes)} notes)"
        )

    @property
    def relative_noise(self) -> float:
        """Root mean square of the noise floor over that of the change; 0 for no change at all."""
        return relative_rms(self.noise_floor, self.change)

    def plot(self, clusters: Clusters | None = None) -> Figure:
        """Overview figure, with the given groups instead of the comparison's own."""
        from .view import overview

        return overview(self if clusters is None else replace(self, clusters=clusters))

    def save(self, out: str | Path) -> Path:
        """Write the result files, pictures and report into the folder ``out``; returns it."""
        from .io._results import save

        return save(self, out)


def compare(
    base: ScalarField,
    perturbed: ScalarField,
    isovalue: float,
    *,
    vertices: int | None = None,
    order: int = 2,
    pairs: int = 300,
    times: int = 100,
    groups: int = 3,
    mesher: Mesher = marching_cubes,
    laplacian: Operator = fem,
    signature: Signature = heat_kernel_signature,
    correspondence: Match | None = None,
    rng: int = 7,
    progress: Progress | None = None,
) -> Comparison:
    """Intrinsic change of an isosurface between two fields: where, at which scale, how much.

    The base isosurface is meshed with curved elements and carried onto the
    perturbed one; the heat kernel signatures of both are compared node by node;
    the whole is done on a coarser base mesh and with every other sample too,
    which gives the noise floor; the nodes whose change exceeds twice that are
    grouped.

    Parameters
    ----------
    base, perturbed : ScalarField
        The same quantity of two runs, in the same coordinates.
    isovalue : float
        In the fields' unit.
    vertices : int, optional
        Vertices of the base mesh. By default the accuracy decides: 1 000,
        doubled once if the noise floor of the mesh exceeds 5 % of the change.
    order : int
        2: curved quadratic elements; 1: flat linear ones, as in the thesis.
    pairs : int
        Eigenpairs. The smallest time resolved is 4 ln 10 / lambda_pairs, so more
        pairs see finer scales. A multiplet cut by the count is left out.
    times : int
        Diffusion times, logarithmic; the number of samples of any other signature.
    groups : int
        Groups of significant nodes; fewer where they do not differ by more than noise.
    mesher : callable
        A mesher of :mod:`isovary.meshing`, with a sizing through functools.partial:
        ``partial(distmesh, sizing=curvature_sizing)``.
    laplacian : callable
        A method of :mod:`isovary.laplacian`, with options through functools.partial:
        ``partial(fem, dirichlet=True)``. The thesis's others are far less accurate.
    signature : callable
        A method of :mod:`isovary.signature`.
    correspondence : callable, optional
        By default the base mesh is carried along the perturbed field. A method of
        :mod:`isovary.correspondence`, such as :func:`isovary.normal_rays`, meshes
        the perturbed isosurface independently instead: the thesis's way.
    rng : int
        Seed of the grouping.
    progress : callable, optional
        Called with the stage's name and the part of the work done.

    Returns
    -------
    Comparison

    Raises
    ------
    FieldError
        I02 for an isovalue outside the range of either field.
    CorrespondenceError
        C01 if the two isosurfaces differ in topology, C02 if too many nodes find no partner.
    ArgumentError
        M09 if the coarser mesh has too few nodes for the eigenpairs; A02 for other values,
        and for ``uniform_graph`` with a carried mesh; A03 for methods that are no functions.
    MeshError, SpectrumError
        From the meshing and the eigensolve.

    Notes
    -----
    Cost: 10 s for 64^3 fields at the defaults on two cores, mostly eigenpairs.

    References
    ----------
    Thesis, chapter 4.

    Examples
    --------
    A sphere grown by 1 %: everywhere the same change, and no rigid motion.

    >>> def ball(radius):
    ...     return ScalarField.from_function(
    ...         lambda p: radius - np.linalg.norm(p, axis=-1),
    ...         bounds=((-1.5, -1.5, -1.5), (1.5, 1.5, 1.5)), shape=(24, 24, 24))
    >>> result = compare(ball(1.0), ball(1.01), 0.0, vertices=200, pairs=70)
    >>> result.coverage, round(float(result.correspondence.distance.mean()), 3)
    (1.0, 0.01)
    >>> len(result.base_pairs.values)  # 70 would cut the shell l = 8
    64
    """
    _check_fields(base, perturbed, isovalue)
    _check(vertices, order, pairs, times, groups)
    walk, methods = Walk(progress), Methods(laplacian, signature, mesher)
    _check_methods(methods, correspondence)
    with walk.stage("interpolation"):
        base, perturbed, errors = _same_interpolation(base, perturbed, isovalue)
    solve = partial(
        make_level, base, perturbed, isovalue, order, pairs, correspondence, methods, walk
    )
    with noted_warnings() as warned:
        level, coarse, samples = refined_levels(solve, vertices, order, pairs, times, walk)
    with walk.stage("signatures and noise floor"):
        before, after, change = level.change(samples)
        mesh_floor = level.noise_floor(coarse, samples)
        unit_area_change = level.change(samples, unit_area=True)[2]
    with walk.stage("noise floor of the samples"), noted_warnings():
        sample_floor = np.zeros_like(change)
        if change.any():
            sample_floor = _sample_floor(base, perturbed, isovalue, level, samples)
        floor = np.hypot(mesh_floor, np.nan_to_num(sample_floor))
    with walk.stage("groups"):
        significant = change_norm(change) > SIGNIFICANCE * change_norm(floor)
        clusters = _groups(change, floor, significant, groups, rng)
    with walk.stage("mesh quality"):
        base_quality = mesh_quality(level.base, base, isovalue, sizing=methods.sizing)
        perturbed_quality = mesh_quality(level.perturbed, perturbed, isovalue)
    walk.finish()
    choices: dict[str, object] = {
        **_fields_said(base, perturbed),
        "interpolation_errors_at_half_resolution": errors,
        "mesher": method_name(mesher),
        "vertices": "by accuracy" if vertices is None else vertices,
        "order": order,
        "laplacian": method_name(laplacian),
        "signature": method_name(signature),
        "pairs": pairs,
        "times": times,
        "scaling": methods.scaling,
        "correspondence": "carried" if correspondence is None else method_name(correspondence),
        "noise_floor_vertices": coarse.vertices,
        "noise_of_the_mesh": relative_rms(mesh_floor, change),
        "noise_of_the_samples": relative_rms(sample_floor, change),
        "clustering": "k_medians",
        "groups": groups,
        "seed": rng,
    }
    result = Comparison(
        isovalue=isovalue,
        base=level.base,
        perturbed=level.perturbed,
        base_pairs=level.base_pairs,
        perturbed_pairs=level.perturbed_pairs,
        methods=methods,
        times=samples,
        base_signature=before,
        perturbed_signature=after,
        correspondence=level.correspondence,
        change=change,
        unit_area_change=unit_area_change,
        noise_floor=floor,
        significant=significant,
        clusters=clusters,
        topology=topology(level.base.triangles),
        base_quality=base_quality,
        perturbed_quality=perturbed_quality,
        motion=rigid_part(level.base, level.correspondence.distance),
        notes=(),
        choices=choices,
        timings=walk.timings,
    )
    others = (text for text in warned if not text.endswith("[M14]"))  # reader_notes tells it
    return replace(result, notes=(*reader_notes(result, WANTED_NOISE), *others))


def _check_fields(base: ScalarField, perturbed: ScalarField, isovalue: float) -> None:
    """Both are fields that take the isovalue; an error tells which is not."""
    for name, field in (("base", base), ("perturbed", perturbed)):
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


def _check(vertices: int | None, order: int, pairs: int, times: int, groups: int) -> None:
    """Values that would fail only after minutes of work fail now."""
    bounds = {"pairs": (pairs, 10), "times": (times, 2), "groups": (groups, 1)}
    for name, (value, least) in bounds.items():
        if value < least:
            raise ArgumentError("A02", f"{name}: expected at least {least}, got {value}")
    if order not in (1, 2):
        raise ArgumentError("A02", f"order: expected 1 or 2, got {order}")
    least = 13 * fewest_vertices(order, pairs) // 10
    if vertices is not None and vertices < least:
        raise ArgumentError(
            "M09",
            f"vertices: expected at least {least} for {pairs} eigenpairs on this mesh and on the "
            f"coarser one of the noise floor, got {vertices}; ask for more, or for fewer pairs",
        )


def _check_methods(methods: Methods, correspondence: Match | None) -> None:
    """Methods are functions, and see what a carried mesh changes."""
    for name, method in (
        ("mesher", methods.mesher),
        ("laplacian", methods.laplacian),
        ("signature", methods.signature),
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
    "correspondence": "normal_rays",
}


def _fields_said(base: ScalarField, perturbed: ScalarField) -> dict[str, object]:
    """What the record of choices says of the two fields."""
    return {
        "field": base.name,
        "base": field_facts(base),
        "perturbed": field_facts(perturbed),
        "interpolation": "logarithmic" if base.logarithmic else "plain",
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


def _same_interpolation(
    base: ScalarField, perturbed: ScalarField, isovalue: float
) -> tuple[ScalarField, ScalarField, dict[str, float]]:
    """Both fields with the interpolation that serves the base better, and the measured errors.

    A base that is logarithmic already stays so.
    """
    chosen = base if base.logarithmic else better_interpolation(base, isovalue)
    logarithmic = chosen.logarithmic and bool(perturbed.values.min() > 0)
    base, perturbed = (replace(field, logarithmic=logarithmic) for field in (base, perturbed))
    return base, perturbed, interpolation_errors(base, isovalue)


def _sample_floor(
    base: ScalarField,
    perturbed: ScalarField,
    isovalue: float,
    level: Level,
    samples: Floats,
) -> Floats:
    """Noise floor of the samples at the base's nodes; NaN throughout if it cannot be told."""
    pairs = len(level.base_pairs.values)
    vertices = max(FIRST_VERTICES[2], fewest_vertices(2, pairs))
    try:
        mesh = level.methods.mesher(base, isovalue, vertices=vertices)
        floor = sampling_floor(
            mesh,
            base,
            perturbed,
            isovalue,
            pairs,
            samples,
            laplacian=level.methods.laplacian,
            signature=level.methods.signature,
        )
    except IsovaryError:
        return np.full((len(level.base.points), len(level.methods.kind.columns(samples))), np.nan)
    return interpolate(closest_point(level.base, mesh), mesh, floor)


def _groups(change: Floats, floor: Floats, significant: Bools, groups: int, rng: int) -> Clusters:
    """Groups of the significant rows, as many as differ by more than the noise."""
    if not significant.any():
        labels = np.full(len(change), -1, dtype=np.int64)
        return Clusters(labels, np.empty((0, change.shape[1])))
    rows = np.where(significant[:, None], change, np.nan)
    noise = float(change_norm(floor[significant]).mean())
    count = min(groups, len(np.unique(change[significant], axis=0)))
    while True:
        clusters = k_medians(rows, count, rng=rng)
        centers = clusters.centers
        apart = np.abs(centers[:, None] - centers[None]).mean(axis=2) + np.diag([np.inf] * count)
        if count == 1 or apart.min() > 2 * noise:
            return clusters
        count -= 1
