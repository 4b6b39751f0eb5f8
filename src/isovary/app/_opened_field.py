"""What the page shows of a field before anything is compared: its values, and a quick isosurface.

No spline is made: that takes seconds and 40 bytes a sample, and only the comparison needs it.
"""

from __future__ import annotations

import os
import re
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ..errors import FieldError, FileError
from ..geometry import Bools, Floats, Ints, components, frozen
from ..io import _cube, _numpy, _vti
from ..io._checks import check_file, check_grid, check_magic, check_shape
from ..io._fields import _READERS, _suffix
from ..io._vti_header import read_header

BINS = 64
_MOST_TRIANGLES = 600_000  # of a preview
_MOST_SAMPLES = 2**21  # that are contoured: 128^3
_MOST_STUDIED = 2**20  # whose gradient is looked at
_LARGE = 1000.0  # faces of a cell, the area of an isosurface worth suggesting
_MOST_COUNTED = 200_000  # triangles whose components are counted
_CLEAR = 0.01  # part of the range by which a signed distance is beyond 0 on both sides
_DISTANCE = re.compile(r"(?<![a-z])(dist|distance|sdf|level[ _-]?set)(?![a-z])", re.IGNORECASE)


@dataclass(frozen=True, eq=False)
class OpenedField:
    """A field as its file holds it, and what its histogram tells.

    Parameters
    ----------
    name, array : str
        Of the quantity; what to ask :func:`read_field` for, None where a file has only one.
    arrays : tuple of str
        Everything that the file offers.
    values : array (nx, ny, nz)
        Samples in the file's own number type; perhaps not finite.
    spacing, origin : array (3,)
        Length.
    counts, edges : array (b,), (b + 1,)
        Histogram of the finite values.
    logarithmic : bool
        Whether the edges grow by equal factors rather than by equal steps.
    isovalue, reason : float, str
        A value to begin with, and where it comes from.
    bad : int
        Number of values that are not finite; :func:`read_field` refuses a field with any.
    notes : tuple of str
        What a reader must know.
    """

    name: str
    array: str | None
    arrays: tuple[str, ...]
    values: NDArray[Any]
    spacing: Floats
    origin: Floats
    counts: Ints
    edges: Floats
    logarithmic: bool
    isovalue: float
    reason: str
    bad: int
    notes: tuple[str, ...] = ()

    @property
    def shape(self) -> tuple[int, int, int]:
        """Number of samples along x, y, z."""
        x, y, z = self.values.shape
        return x, y, z

    @property
    def range(self) -> tuple[float, float]:
        """Smallest and largest finite value."""
        return float(self.edges[0]), float(self.edges[-1])


@dataclass(frozen=True, eq=False)
class Preview:
    """A quick isosurface, to be looked at and not to be computed with.

    Parameters
    ----------
    points : array (n, 3) of float32
        Relative to ``offset``, so that single precision suffices however far the box lies.
    triangles : array (m, 3) of int32
        Counter-clockwise seen from where the field is smaller.
    offset : array (3,)
        Middle of the box; length.
    stride : int
        Every how many samples along each axis were taken.
    cut : bool
        Whether the isosurface leaves the box.
    components : int or None
        Of the surface shown; None if there are too many triangles to count.
    words : str
        Why there is nothing to see, or what is left out; else empty.
    """

    points: NDArray[np.float32]
    triangles: NDArray[np.int32]
    offset: Floats
    stride: int
    cut: bool
    components: int | None
    words: str = ""


class Sampled(Protocol):
    """Samples on a regular grid: an :class:`OpenedField` or a :class:`ScalarField`."""

    @property
    def values(self) -> NDArray[Any]: ...
    @property
    def spacing(self) -> Floats: ...
    @property
    def origin(self) -> Floats: ...


class _Histogram(NamedTuple):
    counts: Ints
    edges: Floats
    logarithmic: bool


def opened(
    path: str | os.PathLike[str],
    array: str | None = None,
    *,
    progress: Callable[[str, float], None] | None = None,
) -> OpenedField:
    """Open a field's file and say what is in it.

    Parameters
    ----------
    path : path
        As for :func:`isovary.read_field`.
    array : str, optional
        Array to take. Default: the first; the others are named in ``arrays``.
    progress : callable, optional
        Called with the stage and the part done, as :func:`isovary.app._jobs.start` does.

    Returns
    -------
    OpenedField

    Raises
    ------
    FileError
        As :func:`isovary.read_field`.
    FieldError
        I01 if no value is finite, I03 if all of them are equal.

    Notes
    -----
    Histogram: 64 bins between the smallest and the largest finite value. If all are positive it is
    made with equal steps and with equal factors, and the one is taken whose bins are filled more
    evenly, that is whose entropy is larger: it tells more.

    Suggested isovalue: 0 for a signed distance, which is told by its name, or by values that are
    negative inside and positive on all faces of the box, both by at least a hundredth of the
    range, so that noise around 0 is none. Else the one whose isosurface has the largest mean
    gradient, that is where the field's transition is sharpest. For the bin of a value v the mean
    over the isosurface is the sum of the squared gradient over the sum of the gradient, since the
    volume between two isosurfaces is their distance, dv over the gradient, times the area. Of the
    bins only those count whose isosurface stays inside the box and has an area of at least 1 000
    faces of a cell; if there is none, those with that area, or else the one of largest area.

    Cost: that of reading, in a child process for ``.vti``, and 0.3 s for a million samples or more;
    at most a million are looked at for the gradient.

    References
    ----------
    V. Pekar, R. Wiemker and D. Hempel, *Fast detection of meaningful isosurfaces for volume data
    visualization*, IEEE Visualization (2001); C. Bajaj, V. Pascucci and D. Schikore, *The contour
    spectrum*, IEEE Visualization (1997).
    """
    tell = progress or (lambda stage, done: None)
    _load()
    tell("reading", 0.0)
    path = Path(path)
    check_file(path)
    suffix = _suffix(path)
    check_magic(path, suffix)
    arrays = _arrays(path, suffix)
    chosen = array if array is not None else arrays[0] if arrays else None
    samples = _READERS[suffix](path, chosen)
    check_shape(path, samples.values.shape)
    check_grid(path, samples.spacing, samples.origin)
    spacing = frozen(np.ones(3) if samples.spacing is None else samples.spacing)
    origin = frozen(np.zeros(3) if samples.origin is None else samples.origin)
    tell("histogram", 0.6)
    values = samples.values
    values.setflags(write=False)
    histogram, bad = _histogram(values, path)
    if _is_signed_distance(samples.name, values, histogram):
        isovalue, reason = 0.0, "the surface of a signed distance"
    else:
        isovalue, reason = _suggested(values, spacing, histogram)
    notes = []
    if samples.spacing is None:
        notes.append("The file states no spacing: 1 is used [I07]")
    if bad:
        notes.append(f"{bad} values are NaN or infinite: such a field cannot be compared [I01]")
    tell("done", 1.0)
    return OpenedField(
        samples.name,
        chosen,
        arrays,
        values,
        spacing,
        origin,
        *histogram,
        isovalue,
        reason,
        bad,
        tuple(notes),
    )


def _load() -> None:
    """Import what the preview needs, which takes 0.3 s, while nobody waits for a picture."""
    import scipy.sparse.csgraph  # noqa: F401
    import vtkmodules.util.numpy_support
    import vtkmodules.vtkFiltersCore  # noqa: F401


def _arrays(path: Path, suffix: str) -> tuple[str, ...]:
    """What a file offers to choose from; nothing for an ``.npy`` file of three axes."""
    if suffix == ".vti":
        return tuple(_vti._scalars(path, read_header(path), None))
    if suffix == ".npy":
        with path.open("rb") as stream:
            return _indexed("", _numpy._header(path, stream).shape)
    if suffix == ".npz":
        return _members(path)
    return tuple(map(str, range(_values_each(path, suffix))))


def _members(path: Path) -> tuple[str, ...]:
    with _numpy._reported(path), zipfile.ZipFile(path) as archive:
        headers = {}
        for key, info in _numpy._members(path, archive).items():
            with archive.open(info) as stream:
                headers[key] = _numpy._header(path, stream)
        keys = _numpy._candidates(path, headers)
    return tuple(name for key in keys for name in _indexed(key, headers[key].shape) or (key,))


def _indexed(key: str, shape: tuple[int, ...]) -> tuple[str, ...]:
    return tuple(f"{key}[{i}]" for i in range(shape[0])) if len(shape) == 4 else ()


def _values_each(path: Path, suffix: str) -> int:
    import gzip

    opener: Callable[..., IO[str]] = gzip.open if suffix == ".cube.gz" else open
    try:
        with opener(path, "rt", encoding="latin-1") as stream:
            return _cube._header(path, stream).each
    except (EOFError, OSError) as error:
        raise FileError(
            "F03", f"{path}: expected whole gzip data, got {error}; the file is damaged"
        ) from None


def _histogram(values: NDArray[Any], path: Path) -> tuple[_Histogram, int]:
    """The more telling histogram of the finite values, and how many are not finite."""
    low, high = _range(values)
    if np.isnan(low):
        raise FieldError("I01", f"{path}: expected finite values, got none; find out why")
    if low == high:
        raise FieldError(
            "I03", f"{path}: expected a varying field, got the constant {low}; another array?"
        )
    if not BINS * np.spacing(max(abs(low), abs(high))) < high - low < np.inf:
        raise FieldError(
            "I03",
            f"{path}: expected values that a histogram can tell apart, got {low} to {high}; "
            "subtract their mean, or scale them",
        )
    stride = _stride(values, _MOST_STUDIED)
    few = values[::stride, ::stride, ::stride]
    kinds = [False, True] if low > 0 else [False]
    telling = max(kinds, key=lambda kind: _entropy(_counted(few, low, high, kind)))
    edges = np.geomspace(low, high, BINS + 1) if telling else np.linspace(low, high, BINS + 1)
    edges[[0, -1]] = low, high
    counts = _counted(values, low, high, telling)
    return _Histogram(counts, frozen(edges), telling), values.size - int(counts.sum())


def _counted(values: NDArray[Any], low: float, high: float, logarithmic: bool) -> Ints:
    """How many finite values lie in each bin, a slab at a time."""
    counts = np.zeros(BINS, dtype=np.int64)
    ends = np.log([low, high]) if logarithmic else np.array([low, high])
    with np.errstate(invalid="ignore", divide="ignore"):
        for slab in values if values.flags.c_contiguous else values.T:
            scale = np.log(slab.astype(float)) if logarithmic else slab.astype(float)
            counts += np.histogram(scale, BINS, (ends[0], ends[1]))[0]
    return counts


def _entropy(counts: Ints) -> float:
    shares = counts[counts > 0] / counts.sum()
    return -float((shares * np.log(shares)).sum())


def _is_signed_distance(name: str, values: NDArray[Any], histogram: _Histogram) -> bool:
    """Whether the name or the values say that 0 is a surface with the negative side inside."""
    low, high = float(histogram.edges[0]), float(histogram.edges[-1])
    if not low < 0 < high:
        return False
    least = _CLEAR * (high - low)
    both = low <= -least and high >= least
    return both and (bool(_DISTANCE.search(name)) or bool(_border(values)[0] >= least))


def _suggested(values: NDArray[Any], spacing: Floats, histogram: _Histogram) -> tuple[float, str]:
    """The value of the isosurface with the largest mean gradient, and these words."""
    stride = _stride(values, _MOST_STUDIED)
    size, middles, widths, gradient = _spectrum(values, spacing, stride, histogram)
    area = size / widths / float(np.prod(spacing)) ** (2 / 3)
    large = area >= _LARGE
    low, high = _border(values)
    inside = (middles > high) | (middles < low)
    reason = "largest mean gradient of the isosurface"
    if (large & inside).any():
        best = int(np.where(large & inside, gradient, -1).argmax())
        reason += ", among those inside the box"
    elif large.any():
        best = int(np.where(large, gradient, -1).argmax())
    else:
        best, reason = int(area.argmax()), "largest isosurface"
    value = float(middles[best])
    short = float(f"{value:.2g}")
    within = histogram.edges[best] < short < histogram.edges[best + 1]
    return (short if within else value), reason


def _spectrum(
    values: NDArray[Any], spacing: Floats, stride: int, histogram: _Histogram
) -> tuple[Floats, Floats, Floats, Floats]:
    """For each bin: the gradient's volume integral, its middle, its width, its mean gradient."""
    part = values[::stride, ::stride, ::stride].astype(float)
    if min(part.shape) < 2:
        part, stride = values.astype(float), 1
    with np.errstate(invalid="ignore", over="ignore"):
        slopes = np.gradient(part, *(spacing * stride))
        steepness = np.sqrt(sum(slope**2 for slope in slopes))
    good: Bools = np.isfinite(steepness)
    bins = np.searchsorted(histogram.edges, part[good], side="right") - 1
    bins = np.clip(bins, 0, BINS - 1)
    first = np.bincount(bins, steepness[good], BINS)
    second = np.bincount(bins, steepness[good] ** 2, BINS)
    lower, upper = histogram.edges[:-1], histogram.edges[1:]
    middles = np.sqrt(lower) * np.sqrt(upper) if histogram.logarithmic else (lower + upper) / 2
    volume = float(np.prod(spacing * stride))
    mean = second / np.where(first > 0, first, 1.0)
    size: Floats = first.astype(float) * volume
    return size, np.asarray(middles), upper - lower, mean


def _faces(values: NDArray[Any]) -> list[NDArray[Any]]:
    return [values[(slice(None),) * axis + (end,)] for axis in range(3) for end in (0, -1)]


def _border(values: NDArray[Any]) -> tuple[float, float]:
    """Smallest and largest finite value on the faces of the box."""
    faces = np.concatenate([face.ravel() for face in _faces(values)]).astype(float)
    faces = faces[np.isfinite(faces)]
    return (float(faces.min()), float(faces.max())) if len(faces) else (np.inf, -np.inf)


def _stride(values: NDArray[Any], most: int) -> int:
    """Every how many samples leave at most so many, and at least four along each axis."""
    stride, shortest = 1, min(values.shape)
    while np.prod(np.ceil(np.array(values.shape) / stride)) > most:
        stride += 1
    return int(max(min(stride, (shortest - 1) // 3), 1))


def preview(field: Sampled, isovalue: float) -> Preview:
    """A quick isosurface of every stride-th sample, whatever the isovalue.

    Parameters
    ----------
    field : OpenedField or ScalarField
        May hold values that are not finite: there is no surface beside them.
    isovalue : float
        In the field's unit. Outside its range the preview is empty and has words.

    Returns
    -------
    Preview
        Linear between the samples, which is not quite where the comparison's spline has it.

    Notes
    -----
    Cost: 10 ms for 64^3 samples, 0.1 s for 128^3 and for more, of which every second, third, ...
    is taken along each axis, so that 128^3 are left.

    References
    ----------
    The contourer is VTK's flying edges, W. Lorensen and H. Cline's marching cubes.
    """
    values, level = field.values, float(isovalue)
    stride = _stride(values, _MOST_SAMPLES)
    offset = frozen(field.origin + field.spacing * (np.array(values.shape) - 1) / 2)
    low, high = _range(values)
    if not low < level < high:
        words = f"No isosurface at {level:.6g}: the values go from {low:.6g} to {high:.6g}."
        return _nothing(offset, stride, words)
    index, triangles = _contoured(values, level, stride)
    while len(triangles) > _MOST_TRIANGLES and min(values.shape) > 4 * stride:
        stride *= 2  # noise, all of it surface
        index, triangles = _contoured(values, level, stride)
    if len(triangles) == 0:
        words = f"No isosurface at {level:.6g} that every {_ordinal(stride)} sample would show."
        return _nothing(offset, stride, words)
    middle = (np.array(values.shape) - 1) / 2
    points = (field.spacing * (index * stride - middle)).astype(np.float32)
    border = _border(values)
    count = int(components(triangles).max()) + 1 if len(triangles) <= _MOST_COUNTED else None
    words = "" if stride == 1 else f"Every {_ordinal(stride)} sample along each axis."
    cut = border[0] < level < border[1]
    return Preview(points, triangles.astype(np.int32), offset, stride, cut, count, words)


def _ordinal(stride: int) -> str:
    return {1: "", 2: "second", 3: "third"}.get(stride, f"{stride}th")


def _range(values: NDArray[Any]) -> tuple[float, float]:
    low, high = float(values.min()), float(values.max())
    if np.isfinite([low, high]).all():
        return low, high
    finite = values[np.isfinite(values)]
    return (float(finite.min()), float(finite.max())) if finite.size else (np.nan, np.nan)


def _nothing(offset: Floats, stride: int, words: str) -> Preview:
    points, triangles = np.zeros((0, 3), np.float32), np.zeros((0, 3), np.int32)
    return Preview(points, triangles, offset, stride, False, 0, words)


def _contoured(values: NDArray[Any], level: float, stride: int) -> tuple[Floats, Ints]:
    """Vertices in index coordinates of the samples taken, and triangles.

    The samples are handed over in the order in which they lie; VTK's x runs fastest.
    """
    from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
    from vtkmodules.vtkCommonDataModel import vtkImageData
    from vtkmodules.vtkFiltersCore import vtkFlyingEdges3D

    part = values[::stride, ::stride, ::stride]
    turned = not part.flags.f_contiguous and part.strides[0] >= part.strides[2]
    part = part if turned else part.T
    with np.errstate(over="ignore", invalid="ignore"):
        scalars = np.subtract(part, level, dtype=np.float64).astype(np.float32)
    image, contourer = vtkImageData(), vtkFlyingEdges3D()
    image.SetDimensions(*scalars.shape[::-1])
    flat = np.ascontiguousarray(scalars).ravel()
    image.GetPointData().SetScalars(numpy_to_vtk(flat))
    contourer.SetInputData(image)
    contourer.SetValue(0, 0.0)
    contourer.ComputeNormalsOff()
    contourer.ComputeScalarsOff()
    contourer.Update()
    output = contourer.GetOutput()
    if output.GetNumberOfPolys() == 0:
        return np.zeros((0, 3)), np.zeros((0, 3), np.int64)
    points = vtk_to_numpy(output.GetPoints().GetData()).astype(float)
    triangles = vtk_to_numpy(output.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    triangles = triangles.astype(np.int64)
    if turned:
        points, triangles = points[:, ::-1], triangles[:, ::-1]
    return _finite(points, triangles)


def _finite(points: Floats, triangles: Ints) -> tuple[Floats, Ints]:
    """Without the triangles beside samples that are not finite, and the points of those alone."""
    good: Bools = np.asarray(np.isfinite(points).all(axis=1))
    if good.all():
        return points, triangles
    triangles = triangles[good[triangles].all(axis=1)]
    used, numbers = np.unique(triangles, return_inverse=True)
    return points[used], numbers.reshape(-1, 3)
