"""``isovary compare`` and ``isovary demo``."""

from __future__ import annotations

import inspect
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal, cast, get_args, get_origin, get_type_hints

import numpy as np
from cyclopts import Parameter

from ..comparison import Comparison, compare
from ..data import water_pair
from ..errors import ArgumentError, IsovaryError
from ..io import read_field
from ..io._atomic import check_output
from ..io._results import save
from ..names import CLUSTERINGS, LAPLACIANS, MATCHES, MESHERS, SIGNATURES, SIZINGS, WITH_BOUNDARY
from ..scalar_field import ScalarField
from ._app import Whole, WholeOrAuto, WholeOrNone, app, progress, say
from ._record import another, command_line, file_facts

_DEMO_ISOVALUE = 0.05
_SAME = "vertices order times groups area_weighted align isometric only_matching noise_meshes"


@app.command
def demo(out: Annotated[Path, Parameter(name=["--out", "-o"])] = Path("isovary-demo")) -> None:
    """Compare the two electron densities of water that ship with isovary.

    Parameters
    ----------
    out
        Folder for the results.
    """
    paths = water_pair()
    say("Water: one O-H bond goes from 0.95 to 1.00 angstrom; isosurface at 0.05 e/bohr^3.")
    command = command_line("demo", demo, {"out": another(out)})
    start = time.perf_counter()
    with progress() as tell:
        result = _run(
            paths,
            lambda: [read_field(path) for path in paths],
            _DEMO_ISOVALUE,
            out,
            command,
            {},
            tell,
        )
    _tell_result(result, out, time.perf_counter() - start)


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
    vertices: WholeOrNone = None,
    order: Literal[1, 2] = 2,
    eigenpairs: Whole = 300,
    times: Whole = 100,
    groups: WholeOrAuto = 3,
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
    noise_meshes: Whole = 1,
    seed: Whole = 7,
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
        Number of groups of changed nodes; auto lets the data choose.
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
    given = dict(locals())
    start = time.perf_counter()
    with progress() as tell:
        result = compare_as_asked(given, tell)
    _tell_result(result, out, time.perf_counter() - start)


def completed(given: Mapping[str, object]) -> dict[str, Any]:
    """The arguments of :func:`compare_files`, the defaults where none are given; paths as such.

    ArgumentError A02 for a name that it does not have, or a word that it does not take.
    """
    parameters = inspect.signature(compare_files).parameters
    hints = get_type_hints(compare_files)
    for name, value in given.items():
        if name not in parameters:
            raise ArgumentError(
                "A02", f"options: expected names among {', '.join(parameters)}, got {name!r}"
            )
        words = get_args(hints[name]) if get_origin(hints[name]) is Literal else ()
        if words and value not in words:
            expected = ", ".join(map(str, words))
            raise ArgumentError("A02", f"{name}: expected one of {expected}, got {value!r}")
    made = {name: parameter.default for name, parameter in parameters.items()} | dict(given)
    made |= {name: Path(made[name]) for name in ("base", "perturbed", "out")}
    return made | {"through": [Path(path) for path in made["through"]]}


def compare_as_asked(given: Mapping[str, Any], tell: Callable[[str, float], None]) -> Comparison:
    """Read, compare and save, as :func:`compare_files` was called."""
    sources = [(path, given["array"]) for path in (given["base"], *given["through"])]
    sources.append((given["perturbed"], given["perturbed_array"] or given["array"]))
    smooth = given["smooth"]

    def read() -> list[ScalarField]:
        grid = {"spacing": given["spacing"], "origin": given["origin"]}
        fields = [read_field(path, array, **grid) for path, array in sources]
        return fields if smooth is None else [field.smoothed(smooth) for field in fields]

    command = command_line("compare", compare_files, {**given, "out": another(given["out"])})
    paths = [path for path, _ in sources]
    return _run(paths, read, given["isovalue"], given["out"], command, _options(given), tell)


def _options(given: Mapping[str, Any]) -> dict[str, object]:
    """What the words of the command line mean to :func:`isovary.compare`."""
    laplacian, accuracy = given["laplacian"], given["accuracy"]
    operator = LAPLACIANS[laplacian]
    if given["boundary"] == "dirichlet":
        if laplacian not in WITH_BOUNDARY:
            raise ArgumentError(
                "A02",
                f"boundary: expected natural with --laplacian {laplacian}, got dirichlet; only "
                f"{', '.join(WITH_BOUNDARY)} have one",
            )
        operator = partial(operator, dirichlet=True)
    return {
        **{name: given[name] for name in _SAME.split()},
        "mesher": partial(MESHERS[given["mesher"]], sizing=SIZINGS[given["sizing"]]),
        "laplacian": operator,
        "signature": SIGNATURES[given["signature"]],
        "pairs": given["eigenpairs"],
        "clustering": CLUSTERINGS[given["cluster"]],
        "correspondence": MATCHES[given["correspondence"]],
        "accuracy": None if accuracy is None else _part(accuracy),
        "rng": given["seed"],
    }


def _part(text: str) -> float:
    """A part given as 5% or 0.05."""
    number = text.strip().removesuffix("%")
    try:
        return float(number) / (100 if number != text.strip() else 1)
    except ValueError:
        raise ArgumentError(
            "A02", f"accuracy: expected a part such as 5% or 0.05, got {text}"
        ) from None


def _run(
    paths: Sequence[Path],
    read: Callable[[], list[ScalarField]],
    isovalue: float,
    out: Path,
    command: str,
    options: Mapping[str, object],
    tell: Callable[[str, float], None],
) -> Comparison:
    """Read, compare and save."""
    start = time.perf_counter()
    check_output(out)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", UserWarning)
        tell("reading", 0.0)
        base, *through, perturbed = fields = read()
        read_notes = tuple(dict.fromkeys(str(warning.message) for warning in caught))
        facts = [file_facts(path, f.name) for path, f in zip(paths, fields, strict=True)]
        reading = time.perf_counter() - start
        try:
            result = compare(
                base,
                perturbed,
                isovalue,
                through=through,
                progress=lambda s, d: tell(s, 0.75 * d),
                **options,  # type: ignore[arg-type]
            )
        except IsovaryError as error:  # what was noticed on reading may tell why
            for note in read_notes:
                error.add_note(f"note: {note}")
            raise
        result = replace(
            result,
            choices={"command": command, "files": facts, **result.choices},
            notes=read_notes + result.notes,
            timings={"reading": reading, **result.timings},
        )
        save(result, out, progress=lambda s, d: tell(s, 0.75 + 0.25 * d))
    return result


def _tell_result(result: Comparison, out: Path, seconds: float) -> None:
    norm = result.change_norm
    most = np.nanmax(norm[result.significant] if result.significant.any() else norm)
    steps = cast(list[dict[str, float]], result.choices["refinement"])
    meshes = ", ".join(f"{step['vertices']}" for step in steps) + " vertices"
    for note in result.notes:
        say(f"note: {note}")
    lines = [
        f"largest change  {most:.3g} of the mean signature (mean over its columns)",
        f"noise floor     {result.relative_noise:.2g} of the change (rms), meshes of {meshes}",
        f"significant     {result.significant.mean():.0%} of {len(norm)} nodes",
        f"coverage        {result.coverage:.1%}",
        f"time            {seconds:.0f} s",
        f"open            {out / 'report.html'}",
    ]
    for line in lines:
        say(line)
