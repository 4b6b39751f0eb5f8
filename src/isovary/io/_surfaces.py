"""Surfaces from files: one function, the format told by the suffix."""

from __future__ import annotations

import os
import tempfile
import warnings
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from ..errors import FileError, MeshError
from ..geometry import Floats, Ints
from ..records import Surface
from ._checks import check_file
from ._child import run_child
from ._surface_checks import Promise, check_content, check_suffix
from ._surface_repairs import mend

_CHILD = Path(__file__).with_name("_surface_child.py")


def read_surface(path: str | os.PathLike[str]) -> Surface:
    r"""Read a triangle mesh from a file, mend what can be mended, and say what was.

    ==================  ===================================  =======================
    suffix              what it holds                        precision of its points
    ==================  ===================================  =======================
    ``.vtp``, ``.vtk``  VTK PolyData                         the file's
    ``.vtu``, ``.vtk``  VTK UnstructuredGrid; the only ones  the file's
                        that know curved triangles
    ``.ply``            Stanford polygons                    the file's
    ``.obj``, ``.off``  Wavefront, Geomview                  the file's
    ``.stl``            three corners for each triangle      single
    ==================  ===================================  =======================

    Curved six-node triangles (VTK_QUADRATIC_TRIANGLE, as in the ``change.vtu`` that
    isovary writes) give a surface of order 2, flat triangles one of order 1. Quads,
    polygons and strips are split into triangles: quads along the diagonal that lies
    inside, or the shorter one. Volume cells are refused.

    Every repair is told in a ``UserWarning`` with its count and its code:

    - M01: points that coincide are merged if they lie on open edges, which are the seams
      of a mesh and all edges of an STL file. Points coincide that are nearer than 1e-6 of
      the diagonal of the mesh's box and than a tenth of the shortest edge at either.
    - M02, M03, M04: points on no triangle, triangles without area, and triangles that
      are there twice are dropped.
    - M06: triangles are turned over, as few as possible, so that neighbours agree, and
      closed parts face outward. A closed part in the box of another one may be a cavity:
      it is turned only together with the outermost part around it.
    - M13: faces were split, or vertices and lines left out.

    Three faults are kept and told: M05, edges with three or more triangles; M07, parts with
    one side only; open edges are no fault.

    Normals in the file are not read: the surface averages its own from the triangles. To
    silence a warning that is expected, ``warnings.filterwarnings("ignore", r".*\[M01\]")``.

    Parameters
    ----------
    path : path
        File to read.

    Returns
    -------
    Surface
        Points in the file's length unit, as float64 and where the file has them.

    Raises
    ------
    FileError
        F01 missing or unreadable; F02 empty; F03 truncated; F04 unknown or wrong suffix,
        or a data set that is no mesh; F05 no points, or nothing at all; F06 VTK complained
        or crashed, or found other numbers than the header says; F12 XML with a DOCTYPE.
    MeshError
        I01 for NaN, inf or absurdly large coordinates; M01 for an index of no point; M03 if no
        triangle has an area; M10 for a point cloud; M13 for cells that are no faces,
        for flat beside curved ones, and for polygons that cannot be split.

    Notes
    -----
    Cost: VTK parses in a child process (0.4 s to start), so that a crash of its native
    code ends in an error; then about 15 s and 2 GB for a million triangles. An ``.obj`` or a
    text file that was cut off at the end of a line cannot be told from a whole one.

    Examples
    --------
    The tetrahedron with corners 0, x, y and z, as text. Its first triangle faces inward:

    >>> import tempfile
    >>> lines = ["OFF", "4 4 0", "0 0 0", "1 0 0", "0 1 0", "0 0 1"]
    >>> lines += ["3 0 1 2", "3 0 1 3", "3 1 2 3", "3 2 0 3", ""]
    >>> with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings(record=True) as told:
    ...     warnings.simplefilter("always")
    ...     path = Path(folder) / "a.off"
    ...     _ = path.write_text("\n".join(lines))
    ...     surface = read_surface(path)
    >>> print(str(told[0].message).split(": ")[-1])
    1 of 4 triangles turned over, so that neighbours agree and closed parts face outward [M06]
    >>> surface.triangles[0].tolist(), round(surface.area, 3)  # 3/2 + sqrt(3)/2
    ([0, 2, 1], 2.366)
    """
    path = Path(path)
    check_file(path)
    suffix = check_suffix(path)
    promise = check_content(path, suffix)
    points, triangles, notes = _parse(path, suffix, promise)
    try:
        mended = mend(points, triangles)
        surface = Surface(mended.points, mended.triangles)
    except MeshError as error:
        raise MeshError(error.code, f"{path}: {error.message}") from None
    for note in notes + mended.notes:
        warnings.warn(f"{path}: {note}", UserWarning, stacklevel=2)
    return surface


def _parse(path: Path, suffix: str, promise: Promise) -> tuple[Floats, Ints, list[str]]:
    """Points and triangles as VTK reads them, and notes on cells that are no triangles."""
    with tempfile.TemporaryDirectory(prefix="isovary-") as folder:
        output = Path(folder) / "mesh.npz"
        report = run_child(_CHILD, path, suffix, str(output))
        _check_report(path, report)
        promise.check(path, report)
        _check_cells(path, report)
        with np.load(output, allow_pickle=False) as arrays:
            points, triangles = arrays["points"], arrays["triangles"]
    points = promise.points_of(path, points)
    return points, triangles, _cell_notes(report)


def _check_report(path: Path, report: dict[str, Any]) -> None:
    """FileError F04, F05 or F06 unless VTK read points of a mesh without complaints."""
    if "File contains 0 polygons" in report["log"]:  # VTK's .off reader
        _refuse_cloud(path, "points")
    if report["log"]:
        said = " ".join(report["log"].split())[:500]
        raise FileError("F06", f"{path}: expected VTK to read it, got: {said}; write it again")
    kind = report["kind"]
    if "points" not in report and kind != "nothing":
        raise FileError(
            "F04",
            f"{path}: expected a PolyData or UnstructuredGrid, got a {kind}; "
            "extract a surface from it, or write a .vti file for read_field",
        )
    if not report.get("points"):
        raise FileError(
            "F05", f"{path}: expected a mesh, got no points from VTK; it is damaged, or holds none"
        )


def _check_cells(path: Path, report: dict[str, Any]) -> None:
    """MeshError M01, M10, M13, or FileError F05, F06, unless the cells give triangles."""
    cells = ", ".join(f"{count} {name}" for name, count in report["cells"].items()) or "no cells"
    if report["outside"]:
        raise MeshError(
            "M01",
            f"{path}: expected indices in [0, {report['points']}), got {report['outside'][0]}; "
            "indices start at 0 (in .obj files at 1)",
        )
    if report["short"]:
        raise FileError(
            "F06",
            f"{path}: expected faces with three nodes or more, got {report['short']} with fewer; "
            "the file is damaged, or they are edges: write it without them",
        )
    if set(report["cells"]) <= {"vtkVertex", "vtkPolyVertex"}:
        if path.suffix.lower() == ".stl":
            raise FileError("F05", f"{path}: expected triangles, got none; write it again")
        _refuse_cloud(path, f"{report['points']} points with {cells}")
    if report["refused"] or report["thin"] == sum(report["cells"].values()):
        raise MeshError(
            "M13",
            f"{path}: expected flat faces, or six-node triangles alone, got {cells}; extract the "
            "surface and split it first: pyvista.read(path).extract_surface().triangulate()",
        )
    if report["lost"]:
        raise MeshError(
            "M13",
            f"{path}: expected polygons that can be split, got {cells}, of which VTK makes "
            f"{report['lost']} triangles too few; triangulate them in the program that wrote them",
        )


def _refuse_cloud(path: Path, got: str) -> NoReturn:
    points = "numpy.loadtxt" if path.suffix.lower() == ".off" else "pyvista.read(path).points"
    raise MeshError(
        "M10",
        f"{path}: expected triangles, got a cloud of {got}; read the points ({points}) and build "
        "a Laplacian on them with knn_graph, epsilon_graph or point_cloud; if it should have "
        "triangles, the file was cut off",
    )


def _cell_notes(report: dict[str, Any]) -> list[str]:
    notes = []
    if report["split"]:
        notes.append(f"{report['split']} quads, polygons or strips split into triangles [M13]")
    if report["thin"]:
        notes.append(f"{report['thin']} vertices and lines left out [M13]")
    return notes
