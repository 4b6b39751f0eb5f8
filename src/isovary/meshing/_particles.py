"""Particles that repel one another on an isosurface until they rest, joined to triangles."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from ..errors import MeshError
from ..geometry import Ints, Topology, node_components, topology
from ..records import Surface
from ..scalar_field import ScalarField
from ._draft import Draft
from ._finish import finished
from ._particle_energy import (
    FINE,
    IDEAL_ENERGY,
    STEPS,
    Cloud,
    Ground,
    State,
    first_apart,
    ground_of,
    relaxed,
    state_of,
)
from ._remesh import Progress
from ._sizing import Sizing
from ._sizing_field import GROWTH
from ._start import start
from ._triangulation import fault, is_sound, refined, triangulated

# All lengths are parts of the wanted edge length.
_APART = 0.67  # distance of the particles at the start: a few too many of them
_CANDIDATES = 7  # fine vertices tried for each particle at the start
_CONTROLS, _TRIES = 4, 8
_HOLES = 10_000  # fine vertices looked at to fill holes: pairs of them are many
_MOST_FINE = 100  # vertices of the fine mesh for each particle: some 30 are usual
_MOST = 0.9  # of the work, before the triangles
_LONELY, _CROWDED = 0.6, 1.5  # energies, of a particle's in the hexagonal packing


def particles(
    field: ScalarField,
    isovalue: float,
    *,
    vertices: int | None = None,
    sizing: Sizing | float | None = None,
    growth: float = GROWTH,
    order: int = 2,
    rng: int = 7,
    progress: Progress | None = None,
) -> Surface:
    """Curved (or flat) triangle mesh of an isosurface by particles that repel one another.

    Particles are strewn over the isosurface, dense where edges shall be short. Each repels those
    in its reach, and all of them slide in the surface, down their total energy, until that
    rests: then nearly every particle has six neighbours at the wanted distance. Particles that
    remain far too crowded are taken away, and new ones put into the widest holes. The resting
    particles are the vertices; their triangles are the Delaunay triangles on the surface.

    Parameters
    ----------
    field : ScalarField
        Any: no distance function is needed.
    isovalue : float
    vertices : int, optional
        Wanted number of vertices; order 2 has four times as many nodes. The sizing's lengths are
        multiplied by the one factor that gives this number. Default: 1 000, or with a ``sizing``
        as many as its lengths take.
    sizing : callable or float, optional
        Wanted edge lengths: :func:`isovary.uniform_sizing` (the default),
        :func:`isovary.curvature_sizing`, any function of points, field and isovalue, or one
        length.
    growth : float
        Largest difference of two edge lengths over the distance between them.
    order : int
        2 for curved six-node triangles, 1 for flat ones.
    rng : int
        Seed of the random numbers that strew the particles: the same seed, the same mesh.
    progress : callable, optional
        Called with a stage's name and the part of it done, 0 to 1.

    Returns
    -------
    Surface
        With the field's exact normals; nodes on the isosurface to rounding, rims on the faces
        of the box.

    Warns
    -----
    UserWarning
        M15 if the surface's curvature takes more vertices: no edge is longer than the radius of
        curvature, down to half the samples' distance.

    Raises
    ------
    FieldError
        I02 for an isovalue outside the field's range.
    MeshError
        M03 if curved triangles stay folded, M12 if the mesh cannot be made.
    ArgumentError
        A02 for fewer than 12 vertices, an order other than 1 and 2 or a growth that is not
        positive, A03 for a sizing that does not return positive lengths.

    Notes
    -----
    The energy is the sum over pairs of ``phi(|x_i - x_j| / (sqrt(3) h_ij))`` with
    ``phi(s) = cot(s pi / 2) + s pi / 2 - pi / 2`` for s < 1 and 0 beyond, and ``h_ij`` the mean of
    the lengths wanted at the two places. At rest the density goes as ``1 / h^2``. In a hexagonal
    packing the six neighbours are at s = 1 / sqrt(3), the next ones at s = 1. Particles on two
    sheets, whose normals disagree, do not see each other.

    Particles on rims stay there, those at the rims' corners do not move. One at the distance d
    from a rim has a pair with its mirror image beyond it, at ``s = 2 d / (sqrt(3) h)``, that
    counts half: zero at the distance of the hexagonal packing's second row.

    The descent is by BFGS with limited memory, in place of the papers' gradient steps; a step
    that would raise the energy is halved.

    Cost: 1.2 s for 1 000 vertices, 14 s for 12 000.

    References
    ----------
    Thesis, section 4.1.1; M. Meyer, P. Georgel and R. Whitaker, *Robust particle systems for
    curvature dependent sampling of implicit surfaces*, Shape Modeling International (2005);
    M. Meyer, R. Kirby and R. Whitaker, *Topology, accuracy, and quality of isosurface meshes
    using dynamic particles*, IEEE Transactions on Visualization and Computer Graphics 13 (2007)
    1704-1711.

    Examples
    --------
    >>> ball = ScalarField.from_function(
    ...     lambda p: -(p**2).sum(axis=-1), ((-2, -1.9, -1.8), (2, 2.1, 2.2)), (17, 18, 19))
    >>> sphere = particles(ball, -1.0, vertices=400)
    >>> len(set(sphere.corners.ravel())), round(sphere.area / 3.14159265, 3)
    (400, 4.0)
    """
    mesh, sizes, expected = start(field, isovalue, vertices, sizing, growth, order)
    ground = ground_of(mesh, sizes.lengths, _MOST_FINE * sizes.vertices, field, isovalue)
    state = state_of(_scattered(ground, sizes.vertices, np.random.default_rng(rng)), ground)
    for count in range(_CONTROLS):
        swaps = _misplaced(state) if count else 0
        if count and not swaps:
            break
        state = _controlled(state, ground, sizes.vertices, swaps)
        tell = partial(_tell, progress, count)
        state, _ = relaxed(state, ground, field, isovalue, STEPS, tell)
    if progress:
        progress("triangles", _MOST)
    draft = _meshed(state.cloud, ground, field, isovalue, expected)
    return finished(draft, field, isovalue, order, expected)


def _scattered(ground: Ground, wanted: int, rng: np.random.Generator) -> Cloud:
    """Particles on the rims, and a few too many others at random, none too near to another."""
    rim = _rim_particles(ground)
    weight = np.where(ground.draft.rank > 0, 0.0, ground.areas / ground.lengths**2)
    with np.errstate(divide="ignore"):
        order = np.argsort(rng.exponential(size=len(weight)) / weight, kind="stable")
    tried = min(_CANDIDATES * wanted, int((weight > 0).sum()))
    vertices = np.concatenate([rim, order[:tried]])
    cloud = _on(ground, vertices)
    return cloud[first_apart(cloud, _APART * ground.lengths[vertices], len(rim))]


def _on(ground: Ground, vertices: Ints) -> Cloud:
    """Particles on fine vertices."""
    none = np.empty((0, 3), dtype=np.int64)
    return Cloud(replace(ground.draft, triangles=none), ground.parts)[vertices]


def _tell(progress: Progress | None, count: int, done: float) -> None:
    if progress:
        progress("particles", _MOST * (count + done) / _CONTROLS)


def _rim_particles(ground: Ground) -> Ints:
    """Fine vertices a wanted length apart along the rims: all corners, and those between them."""
    draft, lengths = ground.draft, ground.lengths
    chosen = [np.empty(0, dtype=np.int64)]
    for chain in _chains(draft, ground.rim.edges) if ground.rim else []:
        i, j = chain[:-1], chain[1:]
        way = np.linalg.norm(draft.points[i] - draft.points[j], axis=1)
        along = np.append(0.0, np.cumsum(2 * way / (lengths[i] + lengths[j])))
        number = max(round(along[-1]), 3 if chain[0] == chain[-1] else 1)
        places = along[-1] * np.arange(number) / number
        chosen.append(chain[np.abs(along[:-1, None] - places).argmin(axis=0)])
    return np.unique(np.concatenate(chosen))


def _chains(draft: Draft, edges: Ints) -> list[Ints]:
    """The rims cut at their corners, as vertices one after another; a ring ends where it began."""
    following = dict(edges.tolist())
    corners = set(np.flatnonzero(draft.rank == 2).tolist()) & set(following)
    chains = []
    for begin in [*sorted(corners), *sorted(following)]:
        if begin not in following:
            continue
        chain = [begin, following.pop(begin)]
        while chain[-1] not in corners and chain[-1] in following:
            chain.append(following.pop(chain[-1]))
        chains.append(np.array(chain))
    return chains


def _misplaced(state: State) -> int:
    """Number of particles inside that are far too lonely, or too crowded if these are more."""
    share = state.energies[state.cloud.draft.rank == 0] / IDEAL_ENERGY
    return int(max((share < _LONELY).sum(), (share > _CROWDED).sum()))


def _controlled(state: State, ground: Ground, wanted: int, swaps: int) -> State:
    """The wanted number of particles; ``swaps`` of them go from crowds to holes."""
    for _ in range(_TRIES):
        surplus = len(state.lengths) - wanted
        if surplus == swaps == 0:
            break
        cloud = _thinned(state, max(surplus, 0) + swaps)
        cloud = _filled(cloud, ground, max(-surplus, 0) + swaps)
        state, swaps = state_of(cloud, ground), 0
    return state


def _thinned(state: State, number: int) -> Cloud:
    """Without the most crowded particles, of which no two are neighbours; rims keep all."""
    cloud, inside = state.cloud, np.flatnonzero(state.cloud.draft.rank == 0)
    order = inside[np.argsort(-state.energies[inside], kind="stable")][: 4 * number]
    gone = order[first_apart(cloud[order], 2 * state.lengths[order])][:number]
    return cloud[np.delete(np.arange(len(state.lengths)), gone)]


def _filled(cloud: Cloud, ground: Ground, number: int) -> Cloud:
    """With new particles in the widest holes, all in an order in which neighbours are near."""
    from scipy.spatial import cKDTree

    fine, old = ground.draft, cloud.draft
    tree = cKDTree(old.points)
    added = np.empty(0, dtype=np.int64)
    if number:
        distance, near = tree.query(fine.points, [1, 2, 3, 4])
        alike = np.einsum("nd,nkd->nk", fine.normals, old.normals[near]) > 0
        gaps = np.where(alike, distance, distance[:, -1:]).min(axis=1) / ground.lengths
        order = np.argsort(-np.where(fine.rank > 0, 0.0, gaps), kind="stable")[
            : min(200 * number, _HOLES)
        ]
        added = order[first_apart(_on(ground, order), ground.lengths[order])][:number]
    new = _on(ground, added)
    points = np.concatenate([old.points, new.draft.points])
    held = np.concatenate([old.held, new.draft.held])
    normals = np.concatenate([old.normals, new.draft.normals])
    parts = np.concatenate([cloud.parts, new.parts])
    return Cloud(Draft(points, old.triangles, held, normals), parts)[cKDTree(points).indices]


def _meshed(
    cloud: Cloud, ground: Ground, field: ScalarField, isovalue: float, expected: Topology
) -> Draft:
    """The particles with their triangles; on a finer mesh if the first one is too coarse."""
    draft, count, fine = cloud.draft, len(cloud.parts), ground.draft
    for finer in (False, True):
        if finer:
            fine, _ = refined(
                fine, ground.lengths, FINE / 2, 4 * _MOST_FINE * count, field, isovalue
            )
        triangles = triangulated(draft.points, draft.normals, _seeds(cloud, fine), fine)
        if is_sound(triangles, count) and topology(triangles) == expected:
            return replace(draft, triangles=triangles)
    raise MeshError(
        "M12",
        f"vertices: expected a mesh of the isosurface's topology ({expected}), got "
        f"{fault(triangles, count)} with {count} vertices; ask for more, or smooth the field if it "
        "is noisy",
    )


def _seeds(cloud: Cloud, fine: Draft) -> Ints:
    """For each particle a near fine vertex (n,) of its own, on its sheet, on a rim if it is.

    -1 if there is none.
    """
    from scipy.spatial import cKDTree

    draft, parts = cloud.draft, node_components(fine.triangles)
    seeds, taken = np.full(len(draft.points), -1), np.zeros(len(fine.points), dtype=bool)
    for on_rim in (False, True):
        mine = np.flatnonzero((draft.rank > 0) == on_rim)
        there = np.flatnonzero((fine.rank > 0) == on_rim)
        if len(mine) == 0:
            continue
        ranks = np.arange(1, min(12, len(there)) + 1)
        near = there[cKDTree(fine.points[there]).query(draft.points[mine], ranks)[1]]
        good = np.einsum("nd,nkd->nk", draft.normals[mine], fine.normals[near]) > 0
        good &= parts[near] == cloud.parts[mine, None]
        for k in range(len(ranks)):
            free = np.flatnonzero((seeds[mine] < 0) & good[:, k] & ~taken[near[:, k]])
            _, first = np.unique(near[free, k], return_index=True)
            seeds[mine[free[first]]] = near[free[first], k]
            taken[near[free, k]] = True
    return seeds
