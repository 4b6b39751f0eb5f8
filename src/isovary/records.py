"""The nouns of isovary: frozen records, checked once when they are made.

Arrays are copied on the way in, stored as float64 or int64 and set read-only,
so a record cannot change behind its owner's back.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import geometry
from .errors import ArgumentError, FieldError, MeshError
from .geometry import Bools, Floats, Ints

if TYPE_CHECKING:
    from scipy.interpolate import NdBSpline
    from scipy.sparse import csr_array


def _frozen(array: ArrayLike, dtype: type = np.float64) -> NDArray[Any]:
    copy: NDArray[Any] = np.array(array, dtype=dtype, order="C", copy=True)
    copy.setflags(write=False)
    return copy


def _first(mask: Bools) -> str:
    return ", ".join(str(int(i)) for i in np.flatnonzero(mask)[:5])


@dataclass(frozen=True, eq=False, repr=False)
class ScalarField:
    """A scalar field sampled on a regular grid, interpolated by a tensor-product cubic spline.

    The spline is C2, passes through every sample and uses the not-a-knot end
    condition, so it is fourth-order accurate up to the box. With
    ``logarithmic=True`` the spline interpolates log(values): right for positive
    fields over many decades, such as electron densities
    (see :func:`isovary.meshing.better_interpolation`). Outside the box every
    quantity is NaN: nothing is extrapolated.

    Parameters
    ----------
    values : array (nx, ny, nz)
        Samples, indexed x, y, z; any real dtype, byte order or memory layout.
    spacing : array (3,) or float
        Distance of neighbouring samples along x, y, z. Default 1.
    origin : array (3,)
        Position of ``values[0, 0, 0]``. Default 0.
    name : str
        Name of the quantity, for titles.
    logarithmic : bool
        Interpolate log(values) instead of values.

    Raises
    ------
    FieldError
        I01 for NaN or inf, I02 if ``logarithmic`` and a value is not positive,
        I03 for a constant field.
    ArgumentError
        A03 for wrong shapes, fewer than four samples along an axis, or spacing <= 0.

    Notes
    -----
    Cost: about 20 ms and four times the memory of the samples for 64^3.

    Examples
    --------
    A quadratic is reproduced exactly, with its gradient and Hessian:

    >>> square = ScalarField.from_function(
    ...     lambda p: (p**2).sum(axis=-1), bounds=((-1, -1, -1), (1, 1, 1)), shape=(5, 5, 5))
    >>> point = [[0.3, 0.2, 0.1]]
    >>> square.value(point).round(12).tolist(), square.gradient(point).round(12).tolist()
    ([0.14], [[0.6, 0.4, 0.2]])
    >>> square.hessian(point).round(10).diagonal(axis1=1, axis2=2).tolist()
    [[2.0, 2.0, 2.0]]
    """

    values: Floats
    spacing: Floats = field(default_factory=lambda: np.ones(3))
    origin: Floats = field(default_factory=lambda: np.zeros(3))
    name: str = "field"
    logarithmic: bool = False
    _spline: NdBSpline = field(init=False, repr=False)

    def __post_init__(self) -> None:
        values = np.asarray(self.values)
        if values.ndim != 3 or min(values.shape) < 4:
            raise ArgumentError(
                "A03",
                "values: expected an array (nx, ny, nz) with at least 4 samples along each axis, "
                f"got shape {values.shape}; a cubic spline needs four",
            )
        if values.dtype.kind not in "biuf":
            raise ArgumentError("A03", f"values: expected real numbers, got dtype {values.dtype}")
        object.__setattr__(self, "values", _frozen(values))
        for name in ("spacing", "origin"):
            vector = _frozen(getattr(self, name))
            if name == "spacing" and vector.ndim == 0:
                vector = _frozen(np.full(3, vector))
            if vector.shape != (3,) or not np.isfinite(vector).all():
                raise ArgumentError("A03", f"{name}: expected 3 finite numbers, got {vector}")
            object.__setattr__(self, name, vector)
        if not (self.spacing > 0).all():
            raise ArgumentError("A03", f"spacing: expected positive, got {self.spacing}")
        self._check_values()
        object.__setattr__(self, "_spline", self._make_spline())

    def _check_values(self) -> None:
        bad = ~np.isfinite(self.values)
        if bad.any():
            where = np.argwhere(bad)
            raise FieldError(
                "I01",
                f"values of {self.name!r}: expected finite numbers, got {len(where)} NaN or inf "
                f"within indices {where.min(axis=0).tolist()} to {where.max(axis=0).tolist()}; "
                "fill or crop them first",
            )
        low, high = self.values.min(), self.values.max()
        if low == high:
            raise FieldError(
                "I03", f"values of {self.name!r}: expected a varying field, got the constant {low}"
            )
        if self.logarithmic and low <= 0:
            raise FieldError(
                "I02",
                f"values of {self.name!r}: expected positive values to interpolate their "
                f"logarithm, got a minimum of {low}; use logarithmic=False",
            )

    @property
    def _middle(self) -> float:
        """Middle of the interpolated range: taken off before, so that an offset costs no digits."""
        ends = np.array([self.values.min(), self.values.max()])
        return float((np.log(ends) if self.logarithmic else ends).mean())

    def _make_spline(self) -> NdBSpline:
        from scipy.interpolate import NdBSpline, make_interp_spline

        coefficients = (np.log(self.values) if self.logarithmic else self.values) - self._middle
        knots = []
        for axis, count in enumerate(self.values.shape):
            spline = make_interp_spline(np.arange(count, dtype=float), coefficients, axis=axis)
            knots.append(spline.t)
            coefficients = np.moveaxis(spline.c, 0, axis)
        return NdBSpline(tuple(knots), np.ascontiguousarray(coefficients), 3, extrapolate=False)

    @classmethod
    def from_function(
        cls,
        function: Callable[[Floats], ArrayLike],
        bounds: tuple[ArrayLike, ArrayLike],
        shape: tuple[int, int, int],
        *,
        name: str = "field",
        logarithmic: bool = False,
    ) -> ScalarField:
        """Sample a callable on a box.

        Parameters
        ----------
        function : callable
            Takes points (..., 3), returns values (...).
        bounds : (low, high)
            Opposite corners of the box, each (3,).
        shape : (nx, ny, nz)
            Number of samples along each axis, both ends included.
        name, logarithmic
            As in :class:`ScalarField`.

        Returns
        -------
        ScalarField

        Examples
        --------
        >>> ScalarField.from_function(
        ...     lambda p: p[..., 0], bounds=((0, 0, 0), (3, 3, 3)), shape=(4, 4, 4)).spacing
        array([1., 1., 1.])
        """
        low, high = np.asarray(bounds[0], dtype=float), np.asarray(bounds[1], dtype=float)
        axes = [np.linspace(low[a], high[a], shape[a]) for a in range(3)]
        grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        spacing = (high - low) / (np.array(shape) - 1)
        values = np.asarray(function(grid))
        return cls(values, spacing, low, name, logarithmic)

    def __repr__(self) -> str:
        shape = " x ".join(map(str, self.values.shape))
        kind = ", logarithmic" if self.logarithmic else ""
        low, high = self.values.min(), self.values.max()
        return f"ScalarField({self.name!r}, {shape}, {low:.4g} to {high:.4g}{kind})"

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """Opposite corners (low, high) of the box, each (3,)."""
        return self.origin, self.origin + self.spacing * (np.array(self.values.shape) - 1)

    def _derivative(self, points: ArrayLike, nu: tuple[int, int, int]) -> Floats:
        index = (np.asarray(points, dtype=float) - self.origin) / self.spacing
        top = np.array(self.values.shape) - 1.0
        edge = 1e-6  # points that rounding put just outside the box belong to it
        inside = np.asarray(((index >= -edge) & (index <= top + edge)).all(axis=-1))
        index = np.where(inside[..., None], np.clip(index, 0, top), np.nan)
        scale = float(np.prod(self.spacing ** np.array(nu, dtype=float)))
        result: Floats = self._spline(index, nu=nu) / scale
        return result

    def value(self, points: ArrayLike) -> Floats:
        """Field values at points (..., 3), NaN outside the box; field unit."""
        spline = self._derivative(points, (0, 0, 0)) + self._middle
        return np.exp(spline) if self.logarithmic else spline

    def gradient(self, points: ArrayLike) -> Floats:
        """Gradients (..., 3) at points (..., 3); field unit / length."""
        units = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
        spline = np.stack([self._derivative(points, nu) for nu in units], axis=-1)
        return spline * self.value(points)[..., None] if self.logarithmic else spline

    def hessian(self, points: ArrayLike) -> Floats:
        """Hessians (..., 3, 3) at points (..., 3); field unit / length^2."""
        unit = np.eye(3, dtype=int)
        rows = [
            [self._derivative(points, tuple((unit[i] + unit[j]).tolist())) for j in range(3)]
            for i in range(3)
        ]
        spline = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
        if not self.logarithmic:
            return spline
        value = self.value(points)[..., None]
        log_gradient = self.gradient(points) / value
        outer = log_gradient[..., :, None] * log_gradient[..., None, :]
        return value[..., None] * (spline + outer)

    def level_set(self, points: ArrayLike, isovalue: float) -> tuple[Floats, Floats]:
        """Function whose zero is the isosurface, and its gradient, as the spline sees them.

        The function is value - isovalue, or log(value) - log(isovalue) for a
        logarithmic field, which is nearly linear where a density decays.

        Parameters
        ----------
        points : array (n, 3)
        isovalue : float

        Returns
        -------
        level : array (n,)
            Zero on the isosurface, NaN outside the box.
        gradient : array (n, 3)
            Per length.
        """
        level = (np.log(isovalue) if self.logarithmic else isovalue) - self._middle
        units = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
        gradient = np.stack([self._derivative(points, nu) for nu in units], axis=-1)
        return self._derivative(points, (0, 0, 0)) - level, gradient

    @property
    def rounding(self) -> float:
        """Error that rounding leaves in :meth:`level_set`, in its unit."""
        return 16 * float(np.finfo(float).eps * np.abs(self._spline.c).max())

    def refine(self, factors: Ints, low: Ints, high: Ints) -> Floats:
        """The level set function's spline on a finer grid over a range of samples.

        Parameters
        ----------
        factors : (3,) int
            How many times finer along each axis.
        low, high : (3,) int
            First and last sample of the range.

        Returns
        -------
        array (1 + (high - low) * factors)
            Values, or their logarithm for a logarithmic field; every factor-th
            is one of the field's own samples.
        """
        from scipy.interpolate import BSpline

        samples = self._spline.c
        for axis, (factor, first, last) in enumerate(zip(factors, low, high, strict=True)):
            index = np.linspace(first, last, 1 + (last - first) * factor)
            basis = BSpline.design_matrix(index, self._spline.t[axis], 3)
            flat = np.moveaxis(samples, axis, 0).reshape(self.values.shape[axis], -1)
            others = np.delete(samples.shape, axis)
            samples = np.moveaxis((basis @ flat).reshape(len(index), *others), 0, axis)
        finer: Floats = samples + self._middle
        return finer

    def check_isovalue(self, isovalue: float) -> None:
        """Raise FieldError I02 unless the isovalue lies strictly inside the field's range."""
        low, high = float(self.values.min()), float(self.values.max())
        if low < isovalue < high:
            return
        suggestions = ", ".join(f"{v:.4g}" for v in np.quantile(self.values, (0.5, 0.9, 0.99)))
        raise FieldError(
            "I02",
            f"isovalue: expected a value inside the range of {self.name!r}, "
            f"{low:.6g} to {high:.6g}, got {isovalue:.6g}; quantiles 0.5, 0.9 and 0.99 of the "
            f"field are {suggestions}",
        )


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
        object.__setattr__(self, "points", _frozen(self.points))
        object.__setattr__(self, "triangles", _frozen(self.triangles, np.int64))
        self._check()
        if self.normals is None:
            normals = geometry.node_normals(self.points, self.triangles)
        else:
            normals = np.asarray(self.normals, dtype=float)
        if normals.shape != self.points.shape:
            raise ArgumentError(
                "A03", f"normals: expected shape {self.points.shape}, got {normals.shape}"
            )
        object.__setattr__(self, "normals", _frozen(normals))

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
        object.__setattr__(self, "unknowns", _frozen(unknowns, np.int64))
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
            object.__setattr__(self, name, _frozen(getattr(self, name)))
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
            object.__setattr__(self, name, _frozen(getattr(self, name), dtype))
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
        object.__setattr__(self, "labels", _frozen(self.labels, np.int64))
        object.__setattr__(self, "centers", _frozen(self.centers))
        if self.memberships is not None:
            object.__setattr__(self, "memberships", _frozen(self.memberships))
