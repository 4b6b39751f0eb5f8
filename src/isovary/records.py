"""The nouns of isovary: frozen records, checked once when they are made.

Arrays are copied on the way in, stored as float64 or int64 and set read-only,
so a record cannot change behind its owner's back.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from . import geometry
from .errors import ArgumentError, MeshError
from .geometry import Bools, Floats, Ints, frozen

if TYPE_CHECKING:
    from scipy.sparse import csr_array


def _first(mask: Bools) -> str:
    return ", ".join(str(int(i)) for i in np.flatnonzero(mask)[:5])


@dataclass(frozen=True, eq=False, repr=False)
class Surface:
    """A triangle mesh of a surface, flat (order 1) or curved (order 2).

    Normals point to where the field is below the isovalue; triangles are
    counter-clockwise seen from there.

    Parameters
    ----------
    points : array (n, 3)
        Nodes: vertices, and for order 2 the edge midpoints.
    triangles : array (m, 3) or (m, 6)
        Node indices; six-node triangles in VTK order (corners, then the
        midpoints of edges 01, 12, 20).
    normals : array (n, 3), optional
        Unit normals at the nodes. By default averaged from the triangles; a
        mesher that knows the field gives the field's exact normals.

    Raises
    ------
    MeshError
        M01 for an index outside [0, n), M02 for nodes on no triangle,
        M03 for a triangle that names a node twice, I01 for NaN or inf.
    ArgumentError
        A03 for wrong shapes.

    Examples
    --------
    >>> triangle = Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> triangle.order, triangle.normals[0].tolist()
    (1, [0.0, 0.0, 1.0])
    """

    points: Floats
    triangles: Ints
    normals: Floats = field(default=None)  # type: ignore[arg-type]

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", frozen(self.points))
        object.__setattr__(self, "triangles", frozen(self.triangles, np.int64))
        self._check()
        if self.normals is None:
            normals = geometry.node_normals(self.points, self.triangles)
        else:
            normals = np.asarray(self.normals, dtype=float)
        if normals.shape != self.points.shape:
            raise ArgumentError(
                "A03", f"normals: expected shape {self.points.shape}, got {normals.shape}"
            )
        object.__setattr__(self, "normals", frozen(normals))

    def _check(self) -> None:
        points, triangles = self.points, self.triangles
        if points.ndim != 2 or points.shape[1] != 3:
            raise ArgumentError("A03", f"points: expected shape (n, 3), got {points.shape}")
        if triangles.ndim != 2 or triangles.shape[1] not in (3, 6) or len(triangles) == 0:
            raise ArgumentError(
                "A03", f"triangles: expected shape (m, 3) or (m, 6), m > 0, got {triangles.shape}"
            )
        bad = ~np.asarray(np.isfinite(points).all(axis=1))
        if bad.any():
            raise MeshError(
                "I01", f"points: expected finite, got {bad.sum()} with NaN or inf, {_first(bad)}"
            )
        outside = (triangles < 0) | (triangles >= len(points))
        if outside.any():
            raise MeshError(
                "M01",
                f"triangles: expected indices in [0, {len(points)}), "
                f"got {int(triangles[outside][0])}",
            )
        ordered = np.sort(triangles, axis=1)
        repeated = (ordered[:, 1:] == ordered[:, :-1]).any(axis=1)
        if repeated.any():
            raise MeshError(
                "M03",
                f"triangles: expected distinct nodes, got {repeated.sum()} triangles that name a "
                f"node twice, first {_first(repeated)}; remove them",
            )
        unused = np.ones(len(points), dtype=bool)
        unused[triangles] = False
        if unused.any():
            raise MeshError(
                "M02",
                f"points: expected each on a triangle, got {unused.sum()} on none, "
                f"first {_first(unused)}; drop them",
            )

    def __repr__(self) -> str:
        return (
            f"Surface({len(self.points)} points, {len(self.triangles)} triangles, "
            f"order {self.order})"
        )

    @property
    def order(self) -> int:
        """1 for flat triangles, 2 for curved six-node triangles."""
        return 1 if self.triangles.shape[1] == 3 else 2

    @property
    def corners(self) -> Ints:
        """Corner indices (m, 3) of each triangle."""
        return self.triangles[:, :3]

    @property
    def area(self) -> float:
        """Area, in squared length units."""
        return float(geometry.triangle_areas(self.points, self.triangles).sum())

    def quadratic(self) -> Surface:
        """The same shape with order 2: the middle of each edge of a flat mesh becomes a node.

        For meshes without a field, such as files: the functions on the surface are then
        approximated better, the flat triangles stay. A surface of order 2 is returned as it is.
        """
        if self.order == 2:
            return self
        return Surface(*geometry.with_midpoints(self.points, self.triangles))


@dataclass(frozen=True, eq=False, repr=False)
class Laplacian:
    """A discrete Laplace-Beltrami operator: stiffness phi = lambda mass phi.

    Parameters
    ----------
    stiffness : sparse (u, u)
        Symmetric positive semidefinite; constants in its kernel, unless nodes are fixed; unit 1.
    mass : sparse (u, u)
        Symmetric positive definite; its entries sum to the area, unless nodes are fixed; length^2.
    unknowns : array (u,), optional
        Node of each unknown. Default: every node is one, in order.
    nodes : int, optional
        Number of the surface's nodes; the functions are 0 at those that are no unknowns.
    area : float, optional
        Area of the surface, length^2. Default: the sum of the mass.

    Raises
    ------
    ArgumentError
        A03 if the matrices are not square and of equal shape, or the unknowns are no
        distinct nodes.
    """

    stiffness: csr_array
    mass: csr_array
    unknowns: Ints = field(default=None)  # type: ignore[arg-type]
    nodes: int = field(default=None)  # type: ignore[assignment]
    area: float = field(default=None)  # type: ignore[assignment]

    def __post_init__(self) -> None:
        shapes = self.stiffness.shape, self.mass.shape
        if shapes[0] != shapes[1] or shapes[0][0] != shapes[0][1]:
            raise ArgumentError(
                "A03", f"stiffness, mass: expected equal square matrices, got {shapes}"
            )
        size = shapes[0][0]
        unknowns = np.arange(size) if self.unknowns is None else self.unknowns
        object.__setattr__(self, "unknowns", frozen(unknowns, np.int64))
        if self.nodes is None:
            object.__setattr__(self, "nodes", size)
        if self.area is None:
            object.__setattr__(self, "area", float(self.mass.sum()))
        known = np.unique(self.unknowns)
        inside = ((known >= 0) & (known < self.nodes)).all()
        if not (len(known) == len(self.unknowns) == size and inside):
            raise ArgumentError(
                "A03",
                f"unknowns: expected {size} distinct nodes in [0, {self.nodes}), got "
                f"{len(known)} distinct ones of {len(self.unknowns)}",
            )

    def __repr__(self) -> str:
        fixed = self.nodes - len(self.unknowns)
        kept = f", {fixed} fixed at 0" if fixed else ""
        return f"Laplacian({self.nodes} nodes{kept}, {self.stiffness.nnz} entries)"


@dataclass(frozen=True, eq=False, repr=False)
class Eigenpairs:
    """The smallest eigenpairs of a Laplacian, ascending, the constant first.

    Parameters
    ----------
    values : array (k,)
        Eigenvalues; 1/length^2.
    vectors : array (n, k)
        Eigenvectors, mass-orthonormal, 0 at fixed nodes; 1/length. Their signs, and any
        rotation within a repeated eigenvalue, are arbitrary: never compare them.
    residuals : array (k,)
        Length of stiffness phi - lambda mass phi, each row divided by the root of
        the mass's diagonal, relative to the last eigenvalue; for unit area.
    area : float
        Area of the surface; length^2.
    solver : str
        What computed them.
    """

    values: Floats
    vectors: Floats
    residuals: Floats
    area: float
    solver: str = ""

    def __post_init__(self) -> None:
        for name in ("values", "vectors", "residuals"):
            object.__setattr__(self, name, frozen(getattr(self, name)))
        count = self.values.shape
        if self.vectors.ndim != 2 or self.vectors.shape[1:] != count:
            raise ArgumentError(
                "A03", f"vectors: expected shape (n, {count[0]}), got {self.vectors.shape}"
            )

    def __repr__(self) -> str:
        return f"Eigenpairs({len(self.values)} pairs, {len(self.vectors)} nodes)"

    @property
    def zero_count(self) -> int:
        """Number of zero eigenvalues, one for each component of the surface."""
        return int((self.values <= 1e-9 * self.values[-1]).sum())

    def truncate(self, count: int) -> Eigenpairs:
        """The first ``count`` pairs."""
        return Eigenpairs(
            self.values[:count],
            self.vectors[:, :count],
            self.residuals[:count],
            self.area,
            self.solver,
        )

    def scaled(self, area: float) -> Eigenpairs:
        """The pairs of the surface scaled to another area."""
        ratio = self.area / area
        vectors = self.vectors * np.sqrt(ratio)
        return Eigenpairs(self.values * ratio, vectors, self.residuals, area, self.solver)


@dataclass(frozen=True, eq=False)
class Correspondence:
    """For each node of a base surface, the corresponding point of a perturbed surface.

    Parameters
    ----------
    triangle : array (n,)
        Index of the perturbed surface's triangle, -1 where no partner was found.
    barycentric : array (n, 3)
        Barycentric coordinates in that triangle, in [0, 1] with sum 1; NaN without a partner.
    distance : array (n,)
        Signed distance along the base normal (or to the closest point); length, NaN without
        a partner.
    hits : array (n,)
        Number of candidates that were found for each node.
    """

    triangle: Ints
    barycentric: Floats
    distance: Floats
    hits: Ints

    def __post_init__(self) -> None:
        for name, dtype in (
            ("triangle", np.int64),
            ("barycentric", np.float64),
            ("distance", np.float64),
            ("hits", np.int64),
        ):
            object.__setattr__(self, name, frozen(getattr(self, name), dtype))
        count = len(self.triangle)
        shapes = (self.barycentric.shape, self.distance.shape, self.hits.shape)
        if shapes != ((count, 3), (count,), (count,)):
            raise ArgumentError(
                "A03", f"correspondence: expected {count} rows in every array, got {shapes}"
            )

    @property
    def found(self) -> Bools:
        """Mask (n,) of the nodes that have a partner."""
        return self.triangle >= 0


@dataclass(frozen=True, eq=False)
class Clusters:
    """A grouping of rows.

    Parameters
    ----------
    labels : array (n,)
        Group of each row from 0, ordered by the norm of the group's center; -1 = unknown.
    centers : array (k, T)
        Group centers.
    memberships : array (n, k), optional
        Degrees of membership with row sum 1, for soft groupings.
    """

    labels: Ints
    centers: Floats
    memberships: Floats | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "labels", frozen(self.labels, np.int64))
        object.__setattr__(self, "centers", frozen(self.centers))
        if self.memberships is not None:
            object.__setattr__(self, "memberships", frozen(self.memberships))
