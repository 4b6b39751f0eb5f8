"""The command line: ``isovary demo``, ``info``, ``mesh``, ``compare``.

Exit codes: 0 done, 1 the data cannot be compared (the message says why),
2 wrong usage.
"""

from __future__ import annotations

import sys
import time
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, Literal, cast

import numpy as np
from cyclopts import App, CycloptsError, Parameter
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from . import (
    __version__,
    closest_point,
    compare,
    contour,
    isometric_match,
    normal_rays,
    read_field,
    topology,
)
from . import clustering as clusterings
from . import laplacian as operators
from . import signature as signatures
from .comparison import Comparison
from .data import water_pair
from .errors import ArgumentError, IsovaryError
from .groups import Clustering
from .io._atomic import check_output
from .io._export import export_csv
from .io._meshes import save_mesh
from .io._results import save
from .levels import Walk
from .meshing import (
    DEFAULT_VERTICES,
    Mesher,
    Sizing,
    better_interpolation,
    curvature_sizing,
    distmesh,
    interpolation_errors,
    marching_cubes,
    nonuniform_sizing,
    particles,
    uniform_sizing,
)
from .methods import Signature, method_name
from .notes import noted_warnings
from .quality import mesh_quality
from .records import Laplacian
from .scalar_field import ScalarField
from .task import Match, field_facts

_MATCHES: dict[str, Match | None] = {
    "carried": None,
    "isometric-match": isometric_match,
    "normal-rays": normal_rays,
    "closest-point": closest_point,
}
_LAPLACIANS: dict[str, Callable[..., Laplacian]] = {
    "fem": operators.fem,
    "fem-lumped": partial(operators.fem, lumped=True),
    "cotangent": operators.cotangent,
    "robust": operators.robust,
    "mesh-laplacian": operators.mesh_laplacian,
    "point-cloud": operators.point_cloud,
    "uniform-graph": operators.uniform_graph,
    "knn-graph": operators.knn_graph,
    "epsilon-graph": operators.epsilon_graph,
}
_WITH_BOUNDARY = ("fem", "fem-lumped", "cotangent")
_CLUSTERINGS: dict[str, Clustering] = {
    "k-medians": clusterings.k_medians,
    "k-medoids": clusterings.k_medoids,
    "fuzzy-c-means": clusterings.fuzzy_c_means,
    "agglomerative": clusterings.agglomerative,
    "deterministic-annealing": clusterings.deterministic_annealing,
    "norm-bins": clusterings.norm_bins,
}
_SIGNATURES: dict[str, Signature] = {
    "heat-kernel": signatures.heat_kernel_signature,
    "scale-invariant-heat-kernel": signatures.scale_invariant_heat_kernel_signature,
    "wave-kernel": signatures.wave_kernel_signature,
    "global-point": signatures.global_point_signature,
}
_MESHERS: dict[str, Mesher] = {
    "marching-cubes": marching_cubes,
    "distmesh": distmesh,
    "particles": particles,
}
_SIZINGS: dict[str, Sizing] = {
    "uniform": uniform_sizing,
    "curvature": curvature_sizing,
    "nonuniform": nonuniform_sizing,
}
_DEMO_ISOVALUE = 0.05
_QUANTILES = (0.5, 0.9, 0.99)

app = App(
    name="isovary",
    help="Intrinsic change of isosurfaces between simulation runs.",
    version=__version__,
    default_parameter=Parameter(negative_iterable=()),
)
_err = Console(stderr=True, highlight=False)
_out = Console(highlight=False)


def main() -> None:
    """Run the command line; never returns."""
    try:
        app(exit_on_error=False, print_error=False)
    except CycloptsError as error:
        _fail(f"{error}\nTry: isovary --help", 2)
    except IsovaryError as error:
        words = "\n".join([str(error), *getattr(error, "__notes__", ())])
        _fail(words, 2 if isinstance(error, ArgumentError) else 1)
    except KeyboardInterrupt:
        _fail("stopped; nothing was written", 130)
    sys.exit(0)


def _fail(message: str, code: int) -> None:
    _err.print(f"isovary: {message}", markup=False, soft_wrap=True)
    sys.exit(code)


@app.command
def demo(out: Annotated[Path, Parameter(name=["--out", "-o"])] = Path("isovary-demo")) -> None:
    """Compare the two electron densities of water that ship with isovary.

    Parameters
    ----------
    out
        Folder for the results.
    """
    base, perturbed = water_pair()
    _out.print("Water: one O-H bond goes from 0.95 to 1.00 angstrom; isosurface at 0.05 e/bohr^3.")
    _run(base, perturbed, _DEMO_ISOVALUE, out, read_field, {})


@app.command(name="compare")
def compare_files(
    base: Path,
    perturbed: Path,
    /,
    *,
    isovalue: float,
    out: Annotated[Path, Parameter(name=["--out", "-o"])],
    array: str | None = None,
    perturbed_array: str | None = None,
    spacing: tuple[float, float, float] | None = None,
    origin: tuple[float, float, float] | None = None,
    smooth: float | None = None,
    vertices: int | None = None,
    order: Literal[1, 2] = 2,
    eigenpairs: int = 300,
    times: int = 100,
    groups: int = 3,
    cluster: Literal[
        "k-medians",
        "k-medoids",
        "fuzzy-c-means",
        "agglomerative",
        "deterministic-annealing",
        "norm-bins",
    ] = "k-medians",
    area_weighted: bool = False,
    mesher: Literal["marching-cubes", "distmesh", "particles"] = "marching-cubes",
    sizing: Literal["uniform", "curvature", "nonuniform"] = "uniform",
    laplacian: Literal[
        "fem",
        "fem-lumped",
        "cotangent",
        "robust",
        "mesh-laplacian",
        "point-cloud",
        "uniform-graph",
        "knn-graph",
        "epsilon-graph",
    ] = "fem",
    boundary: Literal["natural", "dirichlet"] = "natural",
    signature: Literal[
        "heat-kernel", "scale-invariant-heat-kernel", "wave-kernel", "global-point"
    ] = "heat-kernel",
    correspondence: Literal[
        "carried", "isometric-match", "normal-rays", "closest-point"
    ] = "carried",
    align: bool = True,
    isometric: bool = True,
    through: Annotated[Sequence[Path], Parameter(consume_multiple=True)] = (),
    only_matching: bool = False,
    accuracy: str | None = None,
    noise_meshes: int = 1,
    seed: int = 7,
) -> None:
    """Compare the isosurfaces of two fields and write pictures, data and a report.

    Parameters
    ----------
    base
        Field file: .vti, .npy, .npz, .cube or .cube.gz.
    perturbed
        Field file of the run to compare with.
    isovalue
        Value of both isosurfaces, in the fields' unit.
    out
        Folder for the results; an earlier result in it is replaced.
    array
        Array to read, where a file holds several; "s[3]" takes index 3 of a 4-D array.
    perturbed_array
        The same for the perturbed file. Default: as --array.
    spacing
        Distance of samples along x, y, z for .npy and .npz files.
    origin
        Position of the first sample for .npy and .npz files.
    smooth
        Width of a Gaussian that smooths both fields first, in the unit of the spacing: for noisy
        volumes, integers and masks.
    vertices
        Vertices of the base mesh. Default: the accuracy decides.
    order
        2: curved quadratic elements; 1: flat linear ones.
    eigenpairs
        Number of eigenpairs.
    times
        Number of diffusion times, or of what else the signature is sampled at.
    groups
        Number of groups of changed nodes.
    cluster
        How they are grouped: around medians, around true rows, softly, by merging, by cooling
        (which finds its own number, at most --groups), or by how much alone.
    area_weighted
        Each node counts as much as the area around it; if not, all alike.
    mesher
        How the base is meshed: marching cubes remeshed, a truss, or repelling particles.
    sizing
        Edge lengths: equal, shorter where the surface curves, or graded along x without regard
        to shape (the thesis's, for comparison).
    laplacian
        Discretization of the Laplace-Beltrami operator. fem is the most accurate by far;
        the others are the thesis's, for comparison.
    boundary
        Of open surfaces: natural (no heat crosses a rim), or dirichlet (0 there; fem and
        cotangent only).
    signature
        What is compared at each node.
    correspondence
        carried: one mesh follows the field; the others mesh both isosurfaces independently and
        match them by the map that changes lengths least, by rays or by closest points.
    align
        Take the best rigid motion between the isosurfaces out first.
    isometric
        Let the carried mesh slide to the map that changes lengths least; if not, it stays where
        the normals met the perturbed isosurface.
    through
        Field files of members between base and perturbed, in order, through which the mesh is
        carried: for large changes.
    only_matching
        Where components came, went, joined or parted, compare the others.
    accuracy
        Noise of the mesh over change that is good enough, as 5% or 0.05: the mesh is refined
        until then. Default: 5%, with at most 2000 vertices.
    noise_meshes
        Coarser meshes that make the noise floor.
    seed
        Seed of the grouping.
    """

    def read(path: Path) -> ScalarField:
        name = (perturbed_array or array) if path is perturbed else array
        field = read_field(path, name, spacing=spacing, origin=origin)
        return field if smooth is None else field.smoothed(smooth)

    operator = _LAPLACIANS[laplacian]
    if boundary == "dirichlet":
        if laplacian not in _WITH_BOUNDARY:
            raise ArgumentError(
                "A02",
                f"boundary: expected natural with --laplacian {laplacian}, got dirichlet; only "
                f"{', '.join(_WITH_BOUNDARY)} have one",
            )
        operator = partial(operator, dirichlet=True)
    options = {
        "mesher": partial(_MESHERS[mesher], sizing=_SIZINGS[sizing]),
        "laplacian": operator,
        "signature": _SIGNATURES[signature],
        "vertices": vertices,
        "order": order,
        "pairs": eigenpairs,
        "times": times,
        "groups": groups,
        "clustering": _CLUSTERINGS[cluster],
        "area_weighted": area_weighted,
        "correspondence": _MATCHES[correspondence],
        "align": align,
        "isometric": isometric,
        "through": [read(path) for path in through],
        "only_matching": only_matching,
        "accuracy": None if accuracy is None else _part(accuracy),
        "noise_meshes": noise_meshes,
        "rng": seed,
    }
    _run(base, perturbed, isovalue, out, read, options)


def _part(text: str) -> float:
    """A part given as 5% or 0.05."""
    number = text.strip().removesuffix("%")
    try:
        return float(number) / (100 if number != text.strip() else 1)
    except ValueError:
        raise ArgumentError(
            "A02", f"accuracy: expected a part such as 5% or 0.05, got {text}"
        ) from None


@app.command
def info(file: Path, /, *, array: str | None = None, isovalue: float | None = None) -> None:
    """Tell what a field file holds, and with --isovalue what its isosurface is like.

    Parameters
    ----------
    file
        Field file: .vti, .npy, .npz, .cube or .cube.gz.
    array
        Array to read, where the file holds several.
    isovalue
        Value of the isosurface to describe.
    """
    field = read_field(file, array)
    low, high = field.bounds
    rows = {
        "array": field.name,
        "samples": " x ".join(map(str, field.values.shape)),
        "spacing": _numbers(field.spacing),
        "box": f"{_numbers(low)}  to  {_numbers(high)}",
        "values": f"{field.values.min():.6g} to {field.values.max():.6g}",
        "quantiles": "  ".join(
            f"{q:.0%}: {v:.4g}"
            for q, v in zip(_QUANTILES, np.quantile(field.values, _QUANTILES), strict=True)
        ),
    }
    if isovalue is not None:
        surface = contour(field, isovalue)
        errors = interpolation_errors(field, isovalue)
        rows["isosurface"] = f"{topology(surface.triangles)}, area about {surface.area:.5g}"
        rows["half-grid error"] = ", ".join(f"{k} {v:.2g}" for k, v in errors.items()) + " (length)"
    for name, text in rows.items():
        _out.print(f"{name:<16} {text}", markup=False, soft_wrap=True)


@app.command(name="export")
def export_result(
    result: Path,
    /,
    *,
    csv: Path | None = None,
    full: bool = False,
) -> None:
    """Write a table of all nodes of a result, one row each.

    Parameters
    ----------
    result
        Folder that compare wrote.
    csv
        File for the table. Default: nodes.csv here.
    full
        Also the signatures and the change at every time.
    """
    path = csv or Path("nodes.csv")
    count = export_csv(result, path, full=full)
    _out.print(f"{path}: {count} nodes", markup=False, soft_wrap=True)


@app.command(name="mesh")
def mesh_file(
    field: Path,
    /,
    *,
    isovalue: float,
    out: Annotated[Path, Parameter(name=["--out", "-o"])],
    array: str | None = None,
    spacing: tuple[float, float, float] | None = None,
    origin: tuple[float, float, float] | None = None,
    smooth: float | None = None,
    vertices: int | None = None,
    mesher: Literal["marching-cubes", "distmesh", "particles"] = "marching-cubes",
    sizing: Literal["uniform", "curvature", "nonuniform"] = "uniform",
    edge_length: float | None = None,
    growth: float = 0.3,
    order: Literal[1, 2] = 2,
) -> None:
    """Mesh an isosurface, and tell how good the mesh is.

    Parameters
    ----------
    field
        Field file: .vti, .npy, .npz, .cube or .cube.gz.
    isovalue
        Value of the isosurface, in the field's unit.
    out
        Folder for the mesh; an earlier result in it is replaced.
    array
        Array to read, where the file holds several; "s[3]" takes index 3 of a 4-D array.
    spacing
        Distance of samples along x, y, z for .npy and .npz files.
    origin
        Position of the first sample for .npy and .npz files.
    smooth
        Width of a Gaussian that smooths the field first, in the unit of the spacing.
    vertices
        Vertices of the mesh. Default: 1000; as many as it takes with --sizing curvature or
        --edge-length.
    mesher
        marching-cubes: remeshed to equal edges; distmesh: a truss; particles: repelling.
    sizing
        Edge lengths: equal, shorter where the surface curves, or graded along x.
    edge_length
        Length of all edges, in the unit of the spacing, in place of a number of vertices.
    growth
        Largest difference of two edge lengths over the distance between them.
    order
        2: curved quadratic elements; 1: flat linear ones.
    """
    start = time.perf_counter()
    check_output(out)
    wanted: Sizing | float = _SIZINGS[sizing]
    if edge_length is not None:
        if vertices is not None or sizing != "uniform":
            raise ArgumentError("A02", "edge-length: expected no --vertices or --sizing beside it")
        wanted = edge_length
    elif vertices is None and sizing != "curvature":  # the others' lengths are in no unit
        vertices = DEFAULT_VERTICES
    chosen = {"vertices": vertices, "growth": growth, "order": order}
    said = {"edge_length": edge_length, **chosen}
    with _progress() as tell:
        walk = Walk(tell)
        with noted_warnings() as notes:
            with walk.stage("reading", 0.1):
                read = read_field(field, array, spacing=spacing, origin=origin)
                read = read if smooth is None else read.smoothed(smooth)
                used = better_interpolation(read, isovalue)
            with walk.stage("meshing", 0.4):
                surface = _MESHERS[mesher](used, isovalue, sizing=wanted, **chosen)
            with walk.stage("mesh quality", 0.2):
                quality = mesh_quality(surface, used, isovalue, sizing=wanted)
        save_mesh(
            surface,
            quality,
            out,
            title=f"isosurface {used.name} = {isovalue:g}, {mesher}, {sizing} edges",
            choices=_mesh_choices(field, used, isovalue, mesher, sizing, said),
            notes=notes,
            timings=walk.timings,
            progress=lambda s, d: tell(s, 0.7 + 0.3 * d),
        )
    for line in (*(f"note: {note}" for note in notes), *str(quality).splitlines()):
        _out.print(line, markup=False, soft_wrap=True)
    _out.print(f"time        {time.perf_counter() - start:.0f} s", markup=False)
    _out.print(f"open        {out / 'mesh_quality.png'}", markup=False, soft_wrap=True)


def _mesh_choices(
    path: Path,
    field: ScalarField,
    isovalue: float,
    mesher: str,
    sizing: str,
    chosen: Mapping[str, object],
) -> dict[str, object]:
    """Everything that made a mesh, default or not."""
    return {
        "field_file": str(path.resolve()),
        "field": field.name,
        "samples": field_facts(field),
        "isovalue": isovalue,
        "interpolation": "logarithmic" if field.logarithmic else "plain",
        "interpolation_errors_at_half_resolution": interpolation_errors(field, isovalue),
        "mesher": method_name(_MESHERS[mesher]),
        "sizing": method_name(_SIZINGS[sizing]),
        **chosen,
        "vertices": chosen["vertices"] or "by sizing",
    }


def _numbers(values: np.ndarray) -> str:
    return " ".join(f"{value:.6g}" for value in values)


def _run(
    base: Path,
    perturbed: Path,
    isovalue: float,
    out: Path,
    read: Callable[[Path], ScalarField],
    options: Mapping[str, object],
) -> None:
    """Read, compare, save, and say what came out."""
    start = time.perf_counter()
    check_output(out)
    with _progress() as tell, warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", UserWarning)
        tell("reading", 0.0)
        fields = read(base), read(perturbed)
        read_notes = tuple(dict.fromkeys(str(warning.message) for warning in caught))
        reading = time.perf_counter() - start
        try:
            result = compare(*fields, isovalue, progress=lambda s, d: tell(s, 0.75 * d), **options)  # type: ignore[arg-type]
        except IsovaryError as error:  # what was noticed on reading may tell why
            for note in read_notes:
                error.add_note(f"note: {note}")
            raise
        files = {"base_file": str(base.resolve()), "perturbed_file": str(perturbed.resolve())}
        result = replace(
            result,
            choices={**files, **result.choices},
            notes=read_notes + result.notes,
            timings={"reading": reading, **result.timings},
        )
        save(result, out, progress=lambda s, d: tell(s, 0.75 + 0.25 * d))
    _tell_result(result, out, time.perf_counter() - start)


def _tell_result(result: Comparison, out: Path, seconds: float) -> None:
    norm = result.change_norm
    most = np.nanmax(norm[result.significant] if result.significant.any() else norm)
    steps = cast(list[dict[str, float]], result.choices["refinement"])
    meshes = ", ".join(f"{step['vertices']}" for step in steps) + " vertices"
    for note in result.notes:
        _out.print(f"note: {note}", markup=False, soft_wrap=True)
    lines = [
        f"largest change  {most:.3g} of the mean signature (mean over its columns)",
        f"noise floor     {result.relative_noise:.2g} of the change (rms), meshes of {meshes}",
        f"significant     {result.significant.mean():.0%} of {len(norm)} nodes",
        f"coverage        {result.coverage:.1%}",
        f"time            {seconds:.0f} s",
        f"open            {out / 'report.html'}",
    ]
    for line in lines:
        _out.print(line, markup=False, soft_wrap=True)


@contextmanager
def _progress() -> Iterator[Callable[[str, float], None]]:
    """A bar with the stage and the time left on a terminal, a line a stage elsewhere."""
    if not _err.is_terminal:
        yield lambda stage, done: _err.print(f"{done:4.0%}  {stage}")
        return
    columns = (
        BarColumn(),
        TextColumn("{task.percentage:3.0f}%  {task.description}"),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=_err, transient=True) as bar:
        task = bar.add_task("starting", total=1.0)
        yield lambda stage, done: bar.update(task, description=stage, completed=done)
