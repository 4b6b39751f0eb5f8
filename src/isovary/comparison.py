"""The walk through the rooms: two fields and an isovalue in, every intermediate result out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from .alignment import Alignment
from .checks import check_fields, check_methods, check_numbers
from .clustering import k_medians
from .correspondence import CorrespondenceAudit, audit, interpolate
from .difference import change_norm
from .errors import ArgumentError, CorrespondenceError
from .extrinsic import Kind, extrinsic_summary, kinds_of_change
from .geometry import Bools, Floats, Ints, Topology, node_areas, topology
from .groups import Clustering, GroupFacts, group_table, grouped
from .isometry import Distortion, distortion
from .laplacian import fem
from .levels import (
    WANTED_NOISE,
    Progress,
    Refinement,
    Walk,
    make_level,
    refined_levels,
    relative_rms,
    rounding_floor,
    sample_floor,
)
from .matching import ComponentMatch
from .meshing import Mesher, marching_cubes
from .methods import Methods, Operator, Signature, method_name
from .noise import SIGNIFICANCE
from .notes import noted_warnings, reader_notes
from .quality import MeshQuality, mesh_quality
from .records import Clusters, Correspondence, Eigenpairs, Surface
from .rigid_motion import RigidMotion
from .rims import near_rim, rim_distance
from .scalar_field import ScalarField
from .signature import diffusion_radius, heat_kernel_signature
from .task import Match, Task, aligned, same_interpolation, where_topology_changes

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_LOCAL = 0.25  # of the size: diffusion radii that see a place rather than the whole
_LEAST_CHANGE = 0.01


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
        The two meshes: one connectivity if the base was carried. The perturbed one is
        aligned with the base; ``perturbed_in_place`` is where its field has it.
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
        Of the base, and of the perturbed isosurface but for components left out.
    base_quality, perturbed_quality : MeshQuality
        How good the two meshes are.
    alignment : Alignment
        The rigid motion that brings the perturbed isosurface nearest to the base.
    motion : RigidMotion
        The part of it that was applied: all, or nothing with ``align=False``.
    distortion : Distortion
        How much the correspondence stretches each triangle of the base; NaN without partners.
    strain, strain_floor : array (n,)
        Its largest change of a length at each node, relative to it, and the numerical error.
    audit : CorrespondenceAudit
        What the correspondence covers, folds and stretches.
    components : tuple of ComponentMatch
        Which component of the base is which of the perturbed.
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
    alignment: Alignment
    motion: RigidMotion
    distortion: Distortion
    strain: Floats
    strain_floor: Floats
    audit: CorrespondenceAudit
    components: tuple[ComponentMatch, ...]
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
    def perturbed_in_place(self) -> Surface:
        """The perturbed surface in the coordinates of its own field."""
        return self.motion.inverse.surface(self.perturbed)

    @property
    def partners(self) -> Floats:
        """Each base node's corresponding point (n, 3), aligned with the base; NaN without one."""
        return interpolate(self.correspondence, self.perturbed, self.perturbed.points)

    @property
    def displacement(self) -> Floats:
        """From each base node to its corresponding point (n, 3), the rigid motion included."""
        displacement: Floats = self.motion.inverse.apply(self.partners) - self.base.points
        return displacement

    @property
    def kinds(self) -> Ints:
        """What happened at each node (n,), as :class:`isovary.Kind`: moved, bent, stretched...

        "New shape" is a significant change of the signature by 1 % of its mean or more at
        a local scale: a diffusion radius below a quarter of the size (root of the area), as far
        as the signature has times. Larger scales see what happened elsewhere, too.
        """
        size = float(np.sqrt(self.base_pairs.area))
        local = np.ones(len(self.columns), dtype=bool)
        if self.methods.kind.per_time:
            local = diffusion_radius(self.times) < _LOCAL * size
        most = np.abs(self.change[:, local]).max(axis=1, initial=0.0)
        return kinds_of_change(
            np.linalg.norm(self.displacement, axis=1),
            np.linalg.norm(self.deformation, axis=1),
            self.strain,
            self.strain_floor,
            self.significant & (most > _LEAST_CHANGE),
            self.correspondence.found,
            size=size,
        )

    @property
    def kind_shares(self) -> dict[str, float]:
        """Part of the base's area of each kind of change, by its words."""
        kinds, areas = self.kinds, node_areas(self.base.points, self.base.triangles)
        return {kind.words: float(areas[kinds == kind].sum() / areas.sum()) for kind in Kind}

    def extrinsic(self) -> dict[str, float | None]:
        """Areas, volumes, Hausdorff distances and displacements: :func:`extrinsic_summary`."""
        along = np.einsum("nd,nd->n", self.displacement, self.base.normals)
        match = replace(self.correspondence, distance=along)
        motion = self.alignment.motion
        return extrinsic_summary(self.base, self.perturbed_in_place, match, motion=motion)

    @property
    def deformation(self) -> Floats:
        """What the best rigid motion leaves of the displacement (n, 3), applied or not."""
        there = self.base.points + self.displacement
        deformation: Floats = self.alignment.motion.apply(there) - self.base.points
        return deformation

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

    @property
    def group_table(self) -> tuple[GroupFacts, ...]:
        """A row for each group: its area, place, mean change and dominant scale."""
        return group_table(self.base, self.clusters, self.change)

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
    groups: int | Literal["auto"] = 3,
    clustering: Clustering = k_medians,
    area_weighted: bool = False,
    mesher: Mesher = marching_cubes,
    laplacian: Operator = fem,
    signature: Signature = heat_kernel_signature,
    correspondence: Match | None = None,
    align: bool = True,
    isometric: bool = True,
    through: Sequence[ScalarField] = (),
    only_matching: bool = False,
    accuracy: float | None = None,
    noise_meshes: int = 1,
    rng: int = 7,
    progress: Progress | None = None,
) -> Comparison:
    """Intrinsic change of an isosurface between two fields: where, at which scale, how much.

    The perturbed field is moved rigidly until its isosurface lies nearest to the base's.
    The base isosurface is meshed with curved elements and carried onto the perturbed one
    by the map that changes lengths least; the heat kernel signatures of both are compared
    node by node; the whole is done on a coarser base mesh, with every other sample and
    with fewer eigenpairs too, which gives the noise floor; the nodes whose change exceeds
    twice that are grouped.

    Parameters
    ----------
    base, perturbed : ScalarField
        The same quantity of two runs, in the same coordinates.
    isovalue : float
        In the fields' unit.
    vertices : int, optional
        Vertices of the base mesh. By default the accuracy decides.
    order : int
        2: curved quadratic elements; 1: flat linear ones, as in the thesis.
    pairs : int
        Eigenpairs. The smallest time resolved is 4 ln 10 / lambda_pairs, so more
        pairs see finer scales. A multiplet cut by the count is left out.
    times : int
        Diffusion times, logarithmic; the number of samples of any other signature.
    groups : int or "auto"
        Groups of significant nodes; fewer where they do not differ by more than noise. "auto"
        takes the number, up to 8, with the best silhouette of those that repeat on parts of
        the nodes, one if none does; see :func:`isovary.choose_count`.
    clustering : callable
        A method of :mod:`isovary.clustering`, with options through functools.partial:
        ``partial(k_medians, metric="l2")``.
    area_weighted : bool
        Each node counts as much in the groups as the area around it; if not, all alike.
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
    align : bool
        Take the best rigid motion out first. If not, it is told where it is large.
    isometric : bool
        Slide the carried mesh to the map that changes lengths least; if not, nodes stay
        where their normals met the perturbed isosurface.
    through : sequence of ScalarField
        Members of the sweep between the two, in order: the mesh is carried from one to the
        next. Without them a large step leads through blends of the two fields.
    only_matching : bool
        Compare the components that have a partner of equal topology; the others are unknown
        (NaN). By default a difference in topology is an error.
    accuracy : float, optional
        Noise of the mesh over change (rms) that is good enough: the base mesh is doubled
        until then, up to 32 000 vertices. Default: 0.05, but at most 2 000 vertices.
    noise_meshes : int
        Coarser base meshes that make the noise floor; more make it surer.
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
    check_fields(base, perturbed, isovalue, through)
    check_numbers(vertices, order, pairs, times, groups, accuracy, noise_meshes)
    walk, methods = Walk(progress), Methods(laplacian, signature, mesher)
    check_methods(methods, clustering, correspondence, through)
    with noted_warnings() as warned:
        with walk.stage("interpolation"):
            fields = same_interpolation((base, *through, perturbed), isovalue)
        with walk.stage("alignment"):
            alignments = aligned(fields, isovalue)
        task = Task(
            fields,
            isovalue,
            alignments,
            methods,
            align,
            order,
            pairs,
            correspondence,
            isometric,
            only_matching,
        )
        solved = _solved(task, times, walk, vertices, accuracy, noise_meshes)
    group = partial(grouped, count=groups, clustering=partial(clustering, rng=rng), seed=rng)
    result = _measured(task, solved, group, area_weighted, walk)
    asked = {
        "vertices": "by accuracy" if vertices is None else vertices,
        "accuracy": accuracy or WANTED_NOISE,
        "times": times,
        "clustering": method_name(clustering),
        "area_weighted": area_weighted,
        "groups": groups,
        "seed": rng,
    }
    others = (text for text in warned if not text.endswith("[M14]"))  # reader_notes tells it
    notes = (*reader_notes(result, accuracy or WANTED_NOISE), *others)
    walk.finish()
    return replace(result, choices={**result.choices, **asked}, notes=notes, timings=walk.timings)


def _solved(
    task: Task,
    times: int,
    walk: Walk,
    vertices: int | None,
    accuracy: float | None,
    noise_meshes: int,
) -> Refinement:
    """The eigenpairs on meshes fine enough; an error of topology is told its place."""
    try:
        return refined_levels(
            partial(make_level, task, walk),
            task,
            times,
            walk,
            vertices=vertices,
            accuracy=accuracy,
            noise_meshes=noise_meshes,
        )
    except CorrespondenceError as error:
        if error.code == "C01":
            error.add_note(where_topology_changes(task))
        raise


def _measured(
    task: Task,
    solved: Refinement,
    group: Callable[..., tuple[Clusters, dict[str, object]]],
    area_weighted: bool,
    walk: Walk,
) -> Comparison:
    """All that follows from the eigenpairs, but for the notes."""
    level, samples, isovalue = solved.level, solved.samples, task.isovalue
    with walk.stage("signatures and noise floor"):
        before, after, change = level.change(samples)
        unit_area_change = level.change(samples, unit_area=True)[2]
        floors = {"mesh": solved.noise_floor, "pairs": level.truncation_floor(samples)}
    with walk.stage("noise floor of the samples"), noted_warnings():
        floors["samples"] = sample_floor(task, solved) if change.any() else 0 * change
        floors["rounding"] = rounding_floor(task, level, change)
        floor = np.sqrt(sum(np.nan_to_num(part) ** 2 for part in floors.values()))
        floor[np.isnan(change)] = np.nan
    with walk.stage("groups"):
        significant = change_norm(change) > SIGNIFICANCE * change_norm(floor)
        weights = node_areas(level.base.points, level.base.triangles) if area_weighted else None
        clusters, chosen = group(change, floor, significant, weights=weights)
    with walk.stage("mesh quality"):
        sizing = task.methods.sizing
        base_quality = mesh_quality(level.base, task.base, isovalue, sizing=sizing)
        in_place = task.motion.inverse.surface(level.perturbed)
        perturbed_quality = mesh_quality(in_place, task.perturbed, isovalue)
        audited = audit(level.base, level.perturbed, level.correspondence)
    noises = {f"noise_of_the_{part}": relative_rms(f, change) for part, f in floors.items()}
    return Comparison(
        isovalue=isovalue,
        base=level.base,
        perturbed=level.perturbed,
        base_pairs=level.base_pairs,
        perturbed_pairs=level.perturbed_pairs,
        methods=task.methods,
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
        alignment=task.alignments[-1],
        motion=task.motion,
        distortion=distortion(level.base, level.partners),
        strain=level.strain,
        strain_floor=solved.strain_floor,
        audit=audited,
        components=level.components,
        notes=(),
        choices={
            **task.choices,
            **solved.facts,
            **noises,
            **chosen,
        },
        timings={},
    )
