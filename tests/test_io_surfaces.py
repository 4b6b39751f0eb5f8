"""Surfaces from files: the mesh that was written, mended aloud, or an error that says why."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv

from isovary.errors import IsovaryError, MeshError
from isovary.geometry import topology, triangle_areas
from isovary.io import _surfaces, read_surface
from isovary.io._surface_repairs import Mended, mend
from isovary.records import Surface
from isovary.shapes import icosphere

SPHERE = icosphere(1, order=1)
TETRAHEDRON = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
OUTWARD = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])


def _off(path: Path, points: np.ndarray, faces: list[list[int]]) -> Path:
    """A text file of polygons."""
    lines = ["OFF", f"{len(points)} {len(faces)} 0"]
    lines += [" ".join(f"{x:.17g}" for x in point) for point in points]
    lines += [" ".join(map(str, [len(face), *face])) for face in faces]
    path.write_text("\n".join(lines) + "\n")
    return path


def _save(path: Path, surface: Surface = SPHERE, **options: object) -> Path:
    """A file of flat triangles that PyVista writes, or an .off of our own."""
    if path.suffix == ".off":
        return _off(path, surface.points, surface.triangles.tolist())
    mesh = pv.PolyData.from_regular_faces(surface.points, surface.triangles)
    if path.suffix == ".vtu":
        pv.UnstructuredGrid({5: surface.triangles}, surface.points).save(path, **options)
    else:
        mesh.save(path, **options)
    return path


def _fails(code: str, text: str, path: Path) -> None:
    with pytest.raises(IsovaryError, match=text) as caught:
        read_surface(path)
    assert caught.value.code == code
    assert path.name in str(caught.value)


def _volume(points: np.ndarray, triangles: np.ndarray) -> float:
    a, b, c = np.moveaxis(points[triangles[:, :3]], 1, 0)
    return float((a * np.cross(b, c)).sum() / 6)


def _codes(mended: Mended) -> list[str]:
    return [note[-4:-1] for note in mended.notes]


# -- what is read ---------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".vtp", ".vtu", ".vtk", ".ply", ".obj", ".off"])
def test_round_trip(tmp_path: Path, suffix: str) -> None:
    """Oracle: data. The same triangles, and points equal to what the format keeps."""
    surface = read_surface(_save(tmp_path / f"a{suffix}"))
    assert np.array_equal(surface.triangles, SPHERE.triangles)
    digits = {".ply": 1e-7, ".obj": 1e-9}.get(suffix, 0)  # single precision; text of 10 decimals
    assert abs(surface.points - SPHERE.points).max() <= digits
    assert surface.points.dtype == np.float64


@pytest.mark.parametrize("binary", [True, False])
def test_stl_soup_becomes_a_sphere(tmp_path: Path, binary: bool) -> None:
    """Oracle: analytic. 3 m corners become m / 2 + 2 points; Euler number 2, and it is said."""
    path = _save(tmp_path / "a.stl", binary=binary)
    with pytest.warns(UserWarning, match=r"198 points .* merged \[M01\]") as caught:
        surface = read_surface(path)
    assert caught[0].filename == __file__
    assert (len(surface.points), len(surface.triangles)) == (42, 80)
    assert topology(surface.triangles) == topology(SPHERE.triangles)
    assert surface.area == pytest.approx(SPHERE.area, rel=1e-6)


@pytest.mark.parametrize("suffix", [".vtu", ".vtk"])
def test_curved_triangles(tmp_path: Path, suffix: str) -> None:
    """Oracle: data. Six-node triangles, as change.vtu has them, come back with all six."""
    sphere = icosphere(1)
    pv.UnstructuredGrid({22: sphere.triangles}, sphere.points).save(tmp_path / f"a{suffix}")
    surface = read_surface(tmp_path / f"a{suffix}")
    assert surface.order == 2
    assert np.array_equal(surface.points, sphere.points)
    assert np.array_equal(surface.triangles, sphere.triangles)


@pytest.mark.parametrize("mode", ["Ascii", "Binary", "Appended"])
@pytest.mark.parametrize("kind", [".vtp", ".vtu"])
def test_uncompressed_xml(tmp_path: Path, mode: str, kind: str) -> None:
    """Oracle: algebra. Whole, it is read; with 40 bytes of data cut out, F03 without VTK."""
    from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter, vtkXMLUnstructuredGridWriter

    mesh = pv.PolyData.from_regular_faces(SPHERE.points, SPHERE.triangles)
    mesh["height"] = SPHERE.points[:, 2]
    writer = vtkXMLPolyDataWriter() if kind == ".vtp" else vtkXMLUnstructuredGridWriter()
    writer.SetInputData(mesh if kind == ".vtp" else mesh.cast_to_unstructured_grid())
    path = tmp_path / f"a{kind}"
    writer.SetFileName(str(path))
    getattr(writer, f"SetDataModeTo{mode}")()
    writer.SetCompressorTypeToNone()
    writer.Write()
    surface = read_surface(path)
    assert np.allclose(surface.points, SPHERE.points, atol=1e-6)
    assert np.array_equal(surface.triangles, SPHERE.triangles)
    text = path.read_bytes()
    start = text.index(b"<Points>")
    end = b"</AppendedData>" if mode == "Appended" else b"<InformationKey"
    place = text.index(end, start) - 200
    path.write_bytes(text[:place] + text[place + 40 :])
    _fails("F03", "of array", path)


@pytest.mark.parametrize("text", [True, False])
def test_ply_in_double_precision(tmp_path: Path, text: bool) -> None:
    """Oracle: data. VTK rounds them to 1/16 at 1e6; read_surface keeps the file's doubles."""
    points = TETRAHEDRON + [1e6, 2e6, 3e6] + 1 / 3
    head = f"ply\nformat {'ascii' if text else 'binary_big_endian'} 1.0\nelement vertex 4\n"
    head += "".join(f"property double {axis}\n" for axis in "xyz")
    head += "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
    if text:
        body = "".join(" ".join(map(repr, row)) + "\n" for row in points.tolist())
        body += "".join(f"3 {a} {b} {c}\n" for a, b, c in OUTWARD)
        (tmp_path / "a.ply").write_text(head + body)
    else:
        rows = b"".join(b"\3" + row.astype(">i4").tobytes() for row in OUTWARD)
        (tmp_path / "a.ply").write_bytes(head.encode() + points.astype(">f8").tobytes() + rows)
    assert np.array_equal(read_surface(tmp_path / "a.ply").points, points)


def test_quads_and_polygons_are_split(tmp_path: Path) -> None:
    """Oracle: analytic. A flat sheet of 1 x 3 keeps its area, dents of a quad included."""
    points = [[0, 0], [1, 0], [1, 1], [0, 1], [0.5, 0.9], [0, 2], [1, 2], [0, 3], [1, 3], [0.5, 3]]
    faces = [[0, 1, 2, 4], [0, 4, 3], [4, 2, 3], [3, 2, 6, 5], [5, 6, 8, 9, 7]]
    path = _off(tmp_path / "a.off", np.column_stack([points, np.zeros(10)]), faces)
    with pytest.warns(UserWarning, match=r"3 quads, polygons or strips split .*\[M13\]"):
        surface = read_surface(path)
    assert len(surface.triangles) == 2 + 2 + 2 + 3
    assert surface.area == pytest.approx(3, rel=1e-14)
    assert surface.normals == pytest.approx(np.tile([0, 0, 1], (10, 1)))


def test_strips_pixels_and_lines(tmp_path: Path) -> None:
    """Oracle: analytic. A strip of two triangles and a pixel are unit squares."""
    grid = pv.UnstructuredGrid(
        [4, 0, 1, 2, 3, 4, 1, 4, 3, 5, 2, 0, 1],
        [pv.CellType.TRIANGLE_STRIP, pv.CellType.PIXEL, pv.CellType.LINE],
        np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [2, 0, 0], [2, 1, 0]]),
    )
    grid.save(tmp_path / "a.vtu")
    with pytest.warns(UserWarning, match="M13") as caught:
        surface = read_surface(tmp_path / "a.vtu")
    assert [str(item.message)[-30:] for item in caught] == [
        "strips split into triangles [M13]"[-30:],
        "vertices and lines left out [M13]"[-30:],
    ]
    assert surface.area == pytest.approx(2)
    assert surface.normals[:, 2] == pytest.approx(np.ones(6))


def test_normals_of_the_file_are_not_trusted(tmp_path: Path) -> None:
    """Oracle: analytic. Normals of a sphere point outward, whatever the file says."""
    mesh = pv.PolyData.from_regular_faces(SPHERE.points, SPHERE.triangles)
    mesh.point_data["Normals"] = -SPHERE.points
    mesh.GetPointData().SetActiveNormals("Normals")
    mesh.save(tmp_path / "a.vtp")
    normals = read_surface(tmp_path / "a.vtp").normals
    assert ((normals * SPHERE.points).sum(axis=1) > 0.99).all()


def test_it_is_parsed_elsewhere(tmp_path: Path) -> None:
    """Oracle: algebra. After reading, the calling process has not loaded VTK."""
    code = (
        "import sys; from isovary import read_surface; read_surface(sys.argv[1]); "
        "sys.exit(any(name.startswith(('vtk', 'pyvista')) for name in sys.modules))"
    )
    path = _save(tmp_path / "a.ply")
    assert subprocess.run([sys.executable, "-c", code, str(path)], check=False).returncode == 0


# -- what is refused ------------------------------------------------------------


def test_files_that_are_none(tmp_path: Path) -> None:
    """Oracle: algebra. Missing, empty, of another format: refused before VTK sees them."""
    _fails("F01", "No such file", tmp_path / "none.ply")
    (tmp_path / "empty.stl").touch()
    _fails("F02", "empty file", tmp_path / "empty.stl")
    (tmp_path / "a.xyz").write_text("0 0 0\n")
    _fails("F04", "got '.xyz'; convert it", tmp_path / "a.xyz")
    pv.ImageData(dimensions=(4, 4, 4)).save(tmp_path / "a.vti")
    _fails("F04", "got '.vti'.*read_field", tmp_path / "a.vti")
    (tmp_path / "a.vti").rename(tmp_path / "b.vtp")
    _fails("F04", "looks like .vti.*read_field", tmp_path / "b.vtp")
    _save(tmp_path / "c.ply").rename(tmp_path / "c.obj")
    _fails("F04", "looks like .ply; rename it", tmp_path / "c.obj")
    (tmp_path / "d.off").write_text("hello\n")
    _fails("F04", "bytes of another format", tmp_path / "d.off")
    (tmp_path / "e.obj").write_bytes(b"v 0 0\0 0\n")
    _fails("F04", "expected text", tmp_path / "e.obj")


@pytest.mark.parametrize("suffix", [".vtp", ".vtu", ".vtk", ".ply", ".stl", ".obj", ".off"])
@pytest.mark.parametrize("binary", [True, False])
def test_truncated(tmp_path: Path, suffix: str, binary: bool) -> None:
    """Oracle: algebra. Cut in the last number: an error, and F03 wherever counts are at hand."""
    if suffix in (".off", ".obj") and binary:
        pytest.skip("text only")
    path = tmp_path / f"a{suffix}"
    _save(path, **({} if suffix in (".off", ".obj") else {"binary": binary}))
    whole = path.read_bytes()
    path.write_bytes(whole[: -2 if suffix in (".obj", ".ply", ".off") else -9])
    _fails("F06" if suffix == ".vtk" and binary else "F03", "expected", path)


@pytest.mark.parametrize(
    ("code", "text", "old", "new"),
    [
        ("F03", "expected 9999999 rows of 'vertex'", b"vertex 42", b"vertex 9999999"),
        ("F06", "three nodes or more, got 2", b"vertex 42", b"vertex 43"),  # eats a triangle
        ("F03", "80 rows of 'face', got fewer", b"vertex 42", b"vertex 44"),
        ("F03", "the last row to end at byte", b"face 80", b"face 79"),
        ("F03", "expected end_header", b"end_header", b"end_headex"),
        ("M10", "knn_graph", b"element face", b"element fase"),
        ("F06", "an element vertex", b"element vertex", b"element vortex"),
        ("F06", "got 'element vertex 4x'", b"vertex 42", b"vertex 4x"),
        ("F06", "got 'property floot x'", b"property float x", b"property floot x"),
        ("F06", "a format and counts", b"vertex 42", b"vertex -42"),
    ],
)
def test_ply_headers(tmp_path: Path, code: str, text: str, old: bytes, new: bytes) -> None:
    """Oracle: algebra. A header that promises what is not there is refused."""
    path = _save(tmp_path / "a.ply")
    whole = path.read_bytes()
    assert whole.count(old) == 1
    path.write_bytes(whole.replace(old, new))
    _fails(code, text, path)


def test_xml_promises(tmp_path: Path) -> None:
    """Oracle: algebra. A DOCTYPE, other types and counts that no array has are refused."""
    path = _save(tmp_path / "a.vtp")
    whole = path.read_bytes()
    for code, text, old, new in [
        ("F12", "DOCTYPE", b"<VTKFile", b'<!DOCTYPE a [<!ENTITY b "c">]><VTKFile'),
        ("F04", "bytes of another format|PolyData", b'"PolyData"', b'"Poly"'),
        ("F06", "got: ERROR", b'NumberOfPoints="42"', b'NumberOfPoints="43"'),
        ("F06", "expected an integer", b'NumberOfPoints="42"', b'NumberOfPoints="inf"'),
        ("F06", "its NumberOfPoints attribute", b"<Piece NumberOfPoints", b"<Piece Number"),
    ]:
        assert whole.count(old) == 1
        path.write_bytes(whole.replace(old, new))
        _fails(code, text, path)


def test_point_clouds(tmp_path: Path) -> None:
    """Oracle: algebra. Points without triangles: M10, with the Laplacians that take them."""
    remedy = r"cloud of 42 points.*pyvista\.read.*knn_graph, epsilon_graph or point_cloud; if"
    pv.PolyData(SPHERE.points).save(tmp_path / "a.vtp")
    _fails("M10", remedy, tmp_path / "a.vtp")
    vertices = "\n".join(f"v {x} {y} {z}" for x, y, z in SPHERE.points)
    (tmp_path / "a.obj").write_text(vertices + "\n")
    _fails("M10", remedy, tmp_path / "a.obj")
    _fails("M10", "cloud of points", _off(tmp_path / "a.off", SPHERE.points, []))


def test_no_points(tmp_path: Path) -> None:
    """Oracle: algebra. A file that holds nothing is F05."""
    (tmp_path / "a.stl").write_bytes(bytes(84))
    _fails("F05", "no points|triangles, got none", tmp_path / "a.stl")
    (tmp_path / "a.obj").write_text("# nothing\n")
    _fails("F05", "no points", tmp_path / "a.obj")


def test_other_cells(tmp_path: Path) -> None:
    """Oracle: algebra. Volumes, mixed orders and lines alone are refused with their names."""
    box = pv.ImageData(dimensions=(2, 2, 2)).cast_to_unstructured_grid()
    box.save(tmp_path / "a.vtu")
    _fails("M13", r"got 1 vtkVoxel; extract the surface.*triangulate\(\)", tmp_path / "a.vtu")
    points = np.vstack([TETRAHEDRON, TETRAHEDRON[:2] + 0.5])
    mixed = pv.UnstructuredGrid([6, 0, 1, 2, 3, 4, 5, 3, 0, 1, 2], [22, 5], points)
    mixed.save(tmp_path / "b.vtu")
    _fails("M13", "1 vtkQuadraticTriangle, 1 vtkTriangle", tmp_path / "b.vtu")
    pv.lines_from_points(TETRAHEDRON).save(tmp_path / "c.vtp")
    _fails("M13", "3 vtkLine", tmp_path / "c.vtp")
    pv.ImageData(dimensions=(4, 4, 4)).save(tmp_path / "d.vtk")
    _fails("F04", "got a vtkStructuredPoints", tmp_path / "d.vtk")


def test_index_of_no_point(tmp_path: Path) -> None:
    """Oracle: algebra. Index 42 of 42 points is refused; VTK would take it."""
    triangles = SPHERE.triangles.copy()
    triangles[3, 1] = 42
    lines = [f"v {x} {y} {z}" for x, y, z in SPHERE.points]
    lines += [f"f {a} {b} {c}" for a, b, c in triangles + 1]
    (tmp_path / "a.obj").write_text("\n".join(lines) + "\n")
    _fails("M01", r"expected indices in \[0, 42\), got 42.*at 1\)", tmp_path / "a.obj")
    path = _save(tmp_path / "a.ply", binary=False)
    text = path.read_text()
    row = "\n3 " + " ".join(map(str, SPHERE.triangles[3].tolist()))
    changed = text.replace(row, "\n3 " + " ".join(map(str, triangles[3].tolist())))
    assert changed != text
    path.write_text(changed)
    _fails("M01", r"expected indices in \[0, 42\), got 42", path)


def test_not_finite(tmp_path: Path) -> None:
    """Oracle: algebra. NaN, inf and 1e200 among the points are I01 with the file's name."""
    for bad in (np.nan, np.inf, 1e200):
        points = TETRAHEDRON.copy()
        points[2, 1] = bad
        pv.PolyData.from_regular_faces(points, OUTWARD).save(tmp_path / "a.vtp")
        _fails("I01", r"got 1 others, first \[2\]", tmp_path / "a.vtp")


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_a_crash_is_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Oracle: algebra. A child that dies of SIGSEGV ends in F06 with the signal's number."""
    child = tmp_path / "child.py"
    child.write_text("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)")
    monkeypatch.setattr(_surfaces, "_CHILD", child)
    crash = rf"a crash \(signal {int(signal.SIGSEGV)}\)"
    _fails("F06", crash, _save(tmp_path / "a.ply"))


# -- what is mended -------------------------------------------------------------


def test_nothing_to_mend() -> None:
    """Oracle: algebra. A sound mesh comes back as it is, curved or flat, without a note."""
    for sphere in (SPHERE, icosphere(1)):
        mended = mend(sphere.points, sphere.triangles)
        assert np.array_equal(mended.points, sphere.points)
        assert np.array_equal(mended.triangles, sphere.triangles)
        assert mended.notes == []


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_soup_is_merged_within_rounding(order: int, scale: float) -> None:
    """Oracle: analytic. Every corner on its own, off by 1e-7 of the size: Euler number 2."""
    sphere = icosphere(1, order=order)
    points = sphere.points[sphere.triangles].reshape(-1, 3)
    points = points + 1e-7 * np.random.default_rng(3).uniform(-1, 1, points.shape)
    mended = mend(points * scale, np.arange(len(points)).reshape(-1, 3 * order))
    assert topology(mended.triangles).euler == 2
    assert len(mended.points) == len(sphere.points)
    assert mended.notes == [
        f"{len(points) - len(sphere.points)} points that coincide with another on an open edge "
        "merged [M01]"
    ]


def test_a_fine_mesh_beside_a_far_one_is_not_merged() -> None:
    """Oracle: algebra. Edges of 1e-7 of the box survive: a tenth of an edge is the limit."""
    points = np.vstack([TETRAHEDRON * 1e-7, TETRAHEDRON + 1])
    open_one = np.vstack([OUTWARD[:3], OUTWARD[:3] + 4])
    mended = mend(points, open_one)
    assert np.array_equal(mended.triangles, open_one)
    assert mended.notes == []


def test_closed_sheets_that_touch_stay_apart() -> None:
    """Oracle: algebra. Two tetrahedra with a corner in the same place are two components."""
    points = np.vstack([TETRAHEDRON, -TETRAHEDRON])
    triangles = np.vstack([OUTWARD, OUTWARD[:, [0, 2, 1]] + 4])
    mended = mend(points, triangles)
    assert topology(mended.triangles).components == 2
    assert mended.notes == []


def test_far_origin() -> None:
    """Oracle: symmetry. Soup at 1e6 is merged as at 0, where its coordinates tell it apart."""
    points = SPHERE.points[SPHERE.triangles].reshape(-1, 3) + 1e6
    mended = mend(points, np.arange(len(points)).reshape(-1, 3))
    assert topology(mended.triangles) == topology(SPHERE.triangles)


def test_unused_points_are_dropped() -> None:
    """Oracle: algebra. One point of no triangle more, NaN even: the rest is renumbered."""
    points = np.vstack([[[np.nan, 0, 0]], SPHERE.points])
    mended = mend(points, SPHERE.triangles + 1)
    assert np.array_equal(mended.points, SPHERE.points)
    assert np.array_equal(mended.triangles, SPHERE.triangles)
    assert mended.notes == ["1 points on no triangle dropped [M02]"]


def test_flat_triangles_are_dropped() -> None:
    """Oracle: algebra. A repeated index, three points in line, two points in one place."""
    points = np.vstack([TETRAHEDRON, [[0.5, 0, 0], [1.0, 0, 0]]])
    extra = [[0, 1, 1], [0, 4, 1], [1, 5, 2]]
    mended = mend(points, np.vstack([OUTWARD, extra]))
    assert np.array_equal(mended.triangles, OUTWARD)
    assert mended.notes == [
        "2 points on no triangle dropped [M02]",
        "3 of 7 triangles without area dropped [M03]",
    ]
    with pytest.raises(MeshError, match="got 2 without") as caught:
        mend(np.zeros((6, 3)), np.arange(6).reshape(2, 3))
    assert caught.value.code == "M03"


def test_doubled_triangles_are_dropped() -> None:
    """Oracle: algebra. The first of each is kept, whatever way round the second goes."""
    mended = mend(TETRAHEDRON, np.vstack([OUTWARD, OUTWARD[1:2, ::-1], OUTWARD[2:3]]))
    assert np.array_equal(mended.triangles, OUTWARD)
    assert mended.notes == ["2 triangles that are there twice dropped [M04]"]


@pytest.mark.parametrize("order", [1, 2])
def test_mixed_orientation(order: int) -> None:
    """Oracle: algebra. Triangles turned at random, more than half: outward and equal again."""
    sphere = icosphere(1, order=order)
    turn = np.random.default_rng(7).random(80) < 0.7
    reverse = [0, 2, 1] if order == 1 else [0, 2, 1, 5, 4, 3]
    triangles = np.where(turn[:, None], sphere.triangles[:, reverse], sphere.triangles)
    mended = mend(sphere.points, triangles)
    assert np.array_equal(mended.triangles, sphere.triangles)
    assert mended.notes[0].startswith(f"{turn.sum()} of 80 triangles turned over")
    areas = triangle_areas(mended.points, mended.triangles)
    assert areas == pytest.approx(triangle_areas(sphere.points, sphere.triangles))


def test_open_parts_turn_the_fewer() -> None:
    """Oracle: algebra. One triangle of a sheet faces the other way: that one is turned."""
    sheet = SPHERE.triangles[:30].copy()
    wrong = sheet.copy()
    wrong[0] = wrong[0, ::-1]
    mended = mend(SPHERE.points, wrong)
    normals = Surface(mended.points, mended.triangles).normals
    assert (normals * mended.points).sum(axis=1).min() > 0
    assert _codes(mended) == ["M02", "M06"]
    assert mended.notes[1].startswith("1 of 30 triangles turned")


@pytest.mark.parametrize("inward", [False, True])
def test_cavities_keep_their_side(inward: bool) -> None:
    """Oracle: analytic. A shell between radii 1 and 1/2 has their volumes' difference."""
    points = np.vstack([SPHERE.points, SPHERE.points / 2, SPHERE.points + 5])
    shell = [SPHERE.triangles, SPHERE.triangles[:, ::-1] + 42]
    shell = [part[:, ::-1] for part in shell] if inward else shell
    mended = mend(points, np.vstack([*shell, SPHERE.triangles + 84]))
    whole = _volume(SPHERE.points, SPHERE.triangles)
    volume = _volume(mended.points, mended.triangles[:160])
    assert volume == pytest.approx(7 / 8 * whole)
    assert _volume(mended.points, mended.triangles[160:]) == pytest.approx(whole)
    assert _codes(mended) == (["M06"] if inward else [])


def test_one_side_only() -> None:
    """Oracle: analytic. The Moebius strip of five triangles cannot be oriented, and is told."""
    angle = 2 * np.pi * np.arange(5) / 5
    points = np.column_stack([np.cos(angle), np.sin(angle), np.cos(2 * angle)])
    strip = np.array([[i, (i + 1) % 5, (i + 2) % 5] for i in range(5)])
    mended = mend(points, strip)
    assert np.array_equal(mended.triangles, strip)
    assert mended.notes[0].startswith("5 triangles form a part with one side only")
    assert _codes(mended) == ["M07"]
    ring = np.array([[i, (i + 1) % 6, (i + 2) % 6] for i in range(6)])  # two sides
    assert len(mend(np.random.default_rng(5).random((6, 3)), ring).notes) == 1


def test_three_triangles_at_an_edge() -> None:
    """Oracle: algebra. A fin on a tetrahedron is kept, and its edge told by its ends."""
    points = np.vstack([TETRAHEDRON, [[0, -1, -1]]])
    mended = mend(points, np.vstack([OUTWARD, [[0, 1, 4]]]))
    assert len(mended.triangles) == 5
    assert mended.notes == ["1 edges with three or more triangles kept, first [[0, 1]] [M05]"]


# -- damage ---------------------------------------------------------------------


def _mutants(whole: bytes, count: int, seed: int) -> Iterator[bytes]:
    """Bytes flipped, cut off, cut out or doubled."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        data = bytearray(whole)
        where = int(rng.integers(len(data)))
        if (way := rng.integers(5)) <= 1:
            for place in rng.integers(len(data), size=rng.integers(1, 20)):
                data[place] ^= 1 << int(rng.integers(8))
        elif way == 2:  # in the header, where it hurts
            data[int(rng.integers(min(300, len(data))))] = int(rng.integers(32, 127))
        elif way == 3:
            del data[where:]
        else:
            data[where : where + 40] = data[where : where + 20]
        yield bytes(data)


def survives(path: Path, data: bytes) -> str:
    """ "surface" or the error's code; anything else that happens is a failure."""
    path.write_bytes(data)
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            surface = read_surface(path)
    except IsovaryError as error:
        return error.code
    assert all(re.search(r"\[M\d\d\]$", str(item.message)) for item in caught)
    assert np.isfinite(surface.points).all()
    assert np.isfinite(surface.normals).all()
    return "surface"


@pytest.mark.parametrize("suffix", [".ply", ".stl", ".vtp", ".obj"])
def test_damaged_files(tmp_path: Path, suffix: str) -> None:
    """Oracle: algebra. However a file is damaged, the end is a surface or an IsovaryError."""
    whole = _save(tmp_path / f"a{suffix}").read_bytes()
    ends = [survives(tmp_path / f"b{suffix}", data) for data in _mutants(whole, 10, 20240611)]
    assert any(end != "surface" for end in ends)
