"""Fields from files: the right numbers on the right grid, or an error that says why."""

from __future__ import annotations

import gzip
import io
import os
import re
import signal
import struct
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv

from isovary.data import water_pair
from isovary.errors import ArgumentError, FieldError, FileError
from isovary.io import _vti, read_field
from isovary.scalar_field import ScalarField

DATA = Path(__file__).parent / "data"
SPACING, ORIGIN, SHAPE = (0.5, 0.4, 0.3), (-1.0, 2.0, 0.5), (5, 4, 6)
BOHR = 0.529177210903


def _linear(shape: tuple[int, ...] = SHAPE) -> np.ndarray:
    """10 + x + 2 y + 4 z on the test grid."""
    axes = [o + s * np.arange(n) for o, s, n in zip(ORIGIN, SPACING, shape, strict=True)]
    x, y, z = np.meshgrid(*axes, indexing="ij")
    return 10 + x + 2 * y + 4 * z


def _vti_file(path: Path, arrays: dict[str, np.ndarray] | None = None, **options: object) -> Path:
    """A .vti that PyVista writes."""
    grid = pv.ImageData(dimensions=SHAPE, spacing=SPACING, origin=ORIGIN)
    for name, values in (arrays or {"rho": _linear()}).items():
        grid.point_data[name] = values.ravel(order="F") if values.ndim == 3 else values
    grid.save(path, **options)
    return path


def _fails(code: str, text: str, path: Path, *args: str, **grid: object) -> None:
    with pytest.raises((FileError, FieldError), match=text) as caught:
        read_field(path, *args, **grid)
    assert caught.value.code == code
    assert path.name in str(caught.value)


# -- any file -----------------------------------------------------------------


def test_missing_empty_and_folder(tmp_path: Path) -> None:
    """Oracle: algebra. What is no readable file is named with the system's reason."""
    _fails("F01", "No such file", tmp_path / "none.vti")
    (tmp_path / "folder.npy").mkdir()
    _fails("F01", "folder or a device", tmp_path / "folder.npy")
    (tmp_path / "empty.npz").touch()
    _fails("F02", "empty file", tmp_path / "empty.npz")


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="rights do not bind root")
def test_unreadable(tmp_path: Path) -> None:
    """Oracle: algebra. A file without the right to read it is F01."""
    path = _vti_file(tmp_path / "a.vti")
    path.chmod(0)
    _fails("F01", "ermission", path)


@pytest.mark.parametrize(
    ("content", "guess"),
    [
        (b'<?xml version="1.0"?><VTKFile type="ImageData">', "looks like .vti"),
        (b"\x93NUMPY\x01\x00", "looks like .npy"),
        (b"PK\x03\x04", "looks like .npz"),
        (b"\x1f\x8b\x08", "looks like .cube.gz"),
        (b"# vtk DataFile Version 3.0", "looks like .vtk"),
        (b"hello", "got '.dat'; convert"),
    ],
)
def test_unknown_suffix_is_guessed(tmp_path: Path, content: bytes, guess: str) -> None:
    """Oracle: data. The first bytes each format prescribes give the guess."""
    path = tmp_path / "field.dat"
    path.write_bytes(content)
    _fails("F04", re.escape(guess), path)


@pytest.mark.parametrize("suffix", [".vti", ".npy", ".npz", ".cube.gz", ".cube"])
def test_wrong_suffix_is_found(tmp_path: Path, suffix: str) -> None:
    """Oracle: data. A file under another format's suffix is refused with a guess."""
    path = tmp_path / f"field{suffix}"
    if suffix == ".npy":
        np.savez(tmp_path / "a.npz", s=_linear())
        (tmp_path / "a.npz").rename(path)
    else:
        with path.open("wb") as stream:
            np.save(stream, _linear())
    _fails("F04", "looks like .np", path)


@pytest.mark.parametrize("name", ["a.vti", "linear.cube"])
def test_own_grid_cannot_be_overridden(tmp_path: Path, name: str) -> None:
    """Oracle: algebra. A spacing beside the file's own is an ArgumentError."""
    path = DATA / name if name == "linear.cube" else _vti_file(tmp_path / name)
    for grid in ({"spacing": (1, 1, 1)}, {"origin": (0, 0, 0)}):
        with pytest.raises(ArgumentError, match="states its own") as caught:
            read_field(path, **grid)
        assert caught.value.code == "A03"


def test_array_must_be_a_name() -> None:
    """Oracle: algebra. An index instead of a name is an ArgumentError."""
    with pytest.raises(ArgumentError, match="expected a name, got 0"):
        read_field(DATA / "linear.cube", 0)


@pytest.mark.parametrize("writer", ["vti", "npy", "cube"])
def test_nan_is_reported_with_the_file(tmp_path: Path, writer: str) -> None:
    """Oracle: algebra. One NaN at index (1, 2, 3) is counted and located."""
    values = _linear()
    values[1, 2, 3] = np.nan
    path = tmp_path / f"a.{writer}"
    if writer == "vti":
        _vti_file(path, {"rho": values})
    elif writer == "npy":
        np.save(path, values)
    else:
        path.write_text(_cube(values=values))
    grid = {"spacing": SPACING} if writer == "npy" else {}
    _fails("I01", r"got 1 NaN or inf within indices \[1, 2, 3\]", path, **grid)


# -- .vti -----------------------------------------------------------------------


@pytest.mark.parametrize("binary", [True, False])
@pytest.mark.parametrize("dtype", ["f8", "f4", "i2", "u1"])
def test_vti_round_trip(tmp_path: Path, binary: bool, dtype: str) -> None:
    """Oracle: peer. PyVista writes it, we read the same numbers and grid."""
    values = _linear().astype(dtype)
    field = read_field(_vti_file(tmp_path / "a.vti", {"rho": values}, binary=binary))
    assert np.array_equal(field.values, values.astype(float))
    assert (field.spacing.tolist(), field.origin.tolist()) == (list(SPACING), list(ORIGIN))
    assert field.name == "rho"


def _vtk_file(path: Path, **options: object) -> Path:
    """A .vti with VTK's own writer: ``SetDataModeToAppended=()`` and the like."""
    from vtkmodules.vtkIOXML import vtkXMLImageDataWriter

    grid = pv.ImageData(dimensions=SHAPE, spacing=SPACING, origin=ORIGIN)
    grid.point_data["rho"] = _linear().ravel(order="F")
    writer = vtkXMLImageDataWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(grid)
    for name, argument in options.items():
        getattr(writer, name)(*argument)
    assert writer.Write()
    return path


@pytest.mark.parametrize("mode", ["Ascii", "Binary", "Appended"])
@pytest.mark.parametrize("compressor", ["None", "ZLib", "LZ4", "LZMA"])
@pytest.mark.parametrize("order", ["LittleEndian", "BigEndian"])
def test_vti_encodings(tmp_path: Path, mode: str, compressor: str, order: str) -> None:
    """Oracle: peer. Every encoding VTK writes gives the same field."""
    if mode == "Ascii" and (compressor, order) != ("None", "LittleEndian"):
        pytest.skip("text has neither")
    path = _vtk_file(
        tmp_path / "a.vti",
        **{
            f"SetDataModeTo{mode}": (),
            f"SetCompressorTypeTo{compressor}": (),
            f"SetByteOrderTo{order}": (),
            "SetEncodeAppendedData": (False,),
        },
    )
    assert np.allclose(read_field(path).values, _linear(), rtol=1e-12 if mode != "Ascii" else 1e-5)


def test_vti_extent_not_from_zero(tmp_path: Path) -> None:
    """Oracle: analytic. The first sample stands at origin + extent minimum times spacing."""
    grid = pv.ImageData(dimensions=SHAPE, spacing=SPACING, origin=ORIGIN)
    grid.extent = (2, 6, -3, 0, 1, 6)
    grid.point_data["rho"] = _linear().ravel(order="F")
    grid.save(tmp_path / "a.vti")
    field = read_field(tmp_path / "a.vti")
    assert field.origin == pytest.approx([-1 + 2 * 0.5, 2 - 3 * 0.4, 0.5 + 1 * 0.3])
    assert field.values == pytest.approx(_linear())


def test_vti_array_choice(tmp_path: Path) -> None:
    """Oracle: algebra. By name, or an error that lists the names: the active one is no choice."""
    arrays = {"a": _linear(), "b": -_linear(), "v": np.ones((120, 3))}
    path = _vti_file(tmp_path / "a.vti", arrays)
    assert read_field(path, "b").value([[0, 3, 1]]) == pytest.approx(-20)
    text = path.read_bytes()
    path.write_bytes(re.sub(rb"<PointData[^>]*>", b'<PointData Scalars="b">', text))
    _fails("F09", "among 'a', 'b', got none; name one", path)
    _fails("F09", "one of 'a', 'b', got 'v'", path, "v")
    _fails("F09", "got 'c'", path, "c")


def test_vti_without_point_scalars(tmp_path: Path) -> None:
    """Oracle: algebra. Cell data and vectors are refused with the way out."""
    grid = pv.ImageData(dimensions=SHAPE)
    grid.cell_data["c"] = np.arange(grid.n_cells, dtype=float)
    grid.save(tmp_path / "cell.vti")
    _fails("F09", r"got cell data \['c'\]; convert it.*Cell Data to Point", tmp_path / "cell.vti")
    _fails("F09", "got cell data", tmp_path / "cell.vti", "c")
    path = _vti_file(tmp_path / "v.vti", {"v": np.ones((120, 3))})
    _fails("F09", "one component, got 'v'", path)
    pv.ImageData(dimensions=SHAPE).save(tmp_path / "none.vti")
    _fails("F09", "got none", tmp_path / "none.vti")


def test_vti_direction_matrix(tmp_path: Path) -> None:
    """Oracle: algebra. A rotated image is refused, not read as if it were straight."""
    grid = pv.ImageData(dimensions=SHAPE, direction_matrix=[[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    grid.point_data["rho"] = _linear().ravel(order="F")
    grid.save(tmp_path / "a.vti")
    _fails("F14", "direction: expected the identity", tmp_path / "a.vti")


def _change(old: bytes, new: bytes) -> Callable[[bytes], bytes]:
    def change(text: bytes) -> bytes:
        changed, count = re.subn(old, new, text, flags=re.DOTALL)
        assert count
        return changed

    return change


@pytest.mark.parametrize(
    ("code", "text", "change"),
    [
        ("F12", "DOCTYPE", _change(rb"<VTKFile", b'<!DOCTYPE a [<!ENTITY b "c">]><VTKFile')),
        ("F04", "'UnstructuredGrid', a .vtu file", _change(rb'"ImageData"', b'"UnstructuredGrid"')),
        ("F04", "bytes of another format", _change(rb"<VTKFile", b"<PVDs")),
        ("F04", "got a ''", _change(rb"<VTKFile", b"<a><VTKFile")),
        ("F05", r"shape \(5, 4, 0\)", _change(rb'0 4 0 3 0 5"', b'0 4 0 3 0 -1"')),
        ("F05", r"shape \(5, 4, 1\)", _change(rb'0 4 0 3 0 5"', b'0 4 0 3 0 0"')),
        ("F08", "crop or coarsen", _change(rb'0 4 0 3 0 5"', b'0 99999 0 99999 0 99999"')),
        ("F08", "the header is damaged", _change(rb'0 4 0 3 0 5"', b'0 99 0 99 0 999"')),
        ("F06", "got: ERROR", _change(rb'0 4 0 3 0 5"', b'0 4 0 3 0 6"')),
        ("F06", "24 samples in none", _change(rb'Piece Extent="0 4', b'Piece Extent="0 3')),
        ("F06", "expected inside", _change(rb'Piece Extent="0 4', b'Piece Extent="1 5')),
        ("F06", "6 numbers, got '0 4'", _change(rb'WholeExtent="[^"]*"', b'WholeExtent="0 4"')),
        ("F06", "syntax error", _change(rb"</PointData>", b"")),
        ("F06", "got: ERROR", _change(rb'offset="0"', b'offset="8"')),
        ("F14", "spacing: expected 3 positive", _change(rb'Spacing="0.5', b'Spacing="-0.5')),
        ("F14", "origin: expected 3 finite", _change(rb'Origin="-1', b'Origin="nan')),
        ("F03", "truncated", _change(rb"</VTKFile>\s*$", b"")),
    ],
)
def test_vti_faults(tmp_path: Path, code: str, text: str, change: Callable[[bytes], bytes]) -> None:
    """Oracle: algebra. Each damaged header is refused under its code."""
    path = _vtk_file(tmp_path / "a.vti", SetDataModeToAppended=(), SetEncodeAppendedData=(False,))
    path.write_bytes(change(path.read_bytes()))
    _fails(code, text, path)


@pytest.mark.parametrize("mode", ["Ascii", "Binary", "Appended"])
@pytest.mark.parametrize("compressor", ["None", "ZLib"])
def test_vti_with_data_cut_out(tmp_path: Path, mode: str, compressor: str) -> None:
    """Oracle: algebra. Data cut from the middle, all tags left: an error, never a field."""
    path = _vtk_file(
        tmp_path / "a.vti", **{f"SetDataModeTo{mode}": (), f"SetCompressorTypeTo{compressor}": ()}
    )
    text = path.read_bytes()
    closing = b"</AppendedData>" if mode == "Appended" else b"</DataArray>"
    end = text.index(closing) - 1
    path.write_bytes(text[: end - 40] + text[end:])
    silent = compressor == "None" or mode == "Ascii"  # no checksum: VTK would not notice
    _fails("F03" if silent else "F06", "of array" if silent else "expected VTK to read", path)


@pytest.mark.parametrize("encoded", [True, False])
@pytest.mark.parametrize(
    "change",
    [
        _change(rb'0 4 0 3 0 5"', b'0 4 0 3 0 6"'),
        _change(rb'offset="0"', b'offset="8"'),
        _change(rb'offset="0"', b'offset="-8"'),
        _change(rb"  <AppendedData([^>]*)>\s*_", rb"  <AppendedData\1>_A"),
    ],
    ids=["extent", "offset", "negative", "inserted"],
)
def test_vti_uncompressed_out_of_place(
    tmp_path: Path, encoded: bool, change: Callable[[bytes], bytes]
) -> None:
    """Oracle: algebra. The length word must state the array's size: VTK would read on."""
    path = _vtk_file(
        tmp_path / "a.vti", SetCompressorTypeToNone=(), SetEncodeAppendedData=(encoded,)
    )
    path.write_bytes(change(path.read_bytes()))
    _fails("F03", "of array 'rho'", path)


@pytest.mark.parametrize("encoded", [True, False])
def test_vti_bytes_inserted(tmp_path: Path, encoded: bool) -> None:
    """Oracle: algebra. Four bytes put among uncompressed data shifts them: refused."""
    path = _vtk_file(
        tmp_path / "a.vti", SetCompressorTypeToNone=(), SetEncodeAppendedData=(encoded,)
    )
    text = path.read_bytes()
    middle = text.index(b"<AppendedData") + 400
    path.write_bytes(text[:middle] + b"AAAA" + text[middle:])
    _fails("F03", "bytes left over", path)


@pytest.mark.skipif(os.name == "nt", reason="signals")
def test_vti_crash_is_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Oracle: algebra. A child that dies of SIGSEGV ends in F06 with the signal's number."""
    child = tmp_path / "child.py"
    child.write_text("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)")
    monkeypatch.setattr(_vti, "_CHILD", child)
    _fails("F06", rf"a crash \(signal {int(signal.SIGSEGV)}\)", _vti_file(tmp_path / "a.vti"))
    child.write_text("raise ImportError('no vtk')")
    _fails("F06", "a failure: ImportError: no vtk", tmp_path / "a.vti")


def test_vti_is_parsed_elsewhere(tmp_path: Path) -> None:
    """Oracle: algebra. After reading, the calling process has not loaded VTK."""
    import subprocess

    path = _vti_file(tmp_path / "a.vti")
    code = (
        "import sys; from isovary.io import read_field; read_field(sys.argv[1]); "
        "sys.exit(any(name.startswith(('vtk', 'pyvista')) for name in sys.modules))"
    )
    assert subprocess.run([sys.executable, "-c", code, str(path)], check=False).returncode == 0


def test_vti_without_spacing_warns(tmp_path: Path) -> None:
    """Oracle: data. The format's default spacing is 1; that it is assumed is said."""
    path = _vti_file(tmp_path / "a.vti")
    path.write_bytes(re.sub(rb'Spacing="[^"]*"', b"", path.read_bytes()))
    with pytest.warns(UserWarning, match="I07"):
        assert read_field(path).spacing.tolist() == [1, 1, 1]


# -- .npy and .npz --------------------------------------------------------------


def _read_only(values: np.ndarray) -> np.ndarray:
    values.setflags(write=False)
    return values


@pytest.mark.parametrize("suffix", [".npy", ".npz"])
@pytest.mark.parametrize(
    "make",
    [
        lambda a: a.astype(">f8"),
        lambda a: a.astype("<f4"),
        lambda a: a.astype(">f2"),
        lambda a: a.astype(">i4"),
        lambda a: a.astype("u1"),
        np.asfortranarray,
        lambda a: a[::-1, :, ::-1],
        _read_only,
    ],
    ids=["big-endian", "float32", "float16", "integer", "byte", "fortran", "negative", "read-only"],
)
def test_numpy_layouts(
    tmp_path: Path, suffix: str, make: Callable[[np.ndarray], np.ndarray]
) -> None:
    """Oracle: algebra. Whatever the layout in the file, the values are those that went in."""
    values = make(_linear())
    path = tmp_path / f"a{suffix}"
    if suffix == ".npy":
        np.save(path, values)
    else:
        np.savez_compressed(path, s=values)
    field = read_field(path, spacing=SPACING, origin=ORIGIN)
    assert np.array_equal(field.values, values.astype(float))
    assert field.origin.tolist() == list(ORIGIN)


def test_npz_grid_and_override(tmp_path: Path) -> None:
    """Oracle: algebra. The file's grid is kept; an argument takes its place, one by one."""
    path = tmp_path / "a.npz"
    np.savez(path, s=_linear(), spacing=SPACING, origin=ORIGIN, atoms=np.ones((8, 3, 3)))
    field = read_field(path)
    assert (field.spacing.tolist(), field.origin.tolist()) == (list(SPACING), list(ORIGIN))
    assert field.value([[0.1, 2.3, 1.2]]) == pytest.approx(10 + 0.1 + 4.6 + 4.8)
    other = read_field(path, spacing=(2, 2, 2))
    assert (other.spacing.tolist(), other.origin.tolist()) == ([2, 2, 2], list(ORIGIN))


def test_numpy_without_spacing_warns_the_caller(tmp_path: Path) -> None:
    """Oracle: algebra. The notice I07 points at this file, not at the library."""
    np.save(tmp_path / "a.npy", _linear())
    with pytest.warns(UserWarning, match="I07") as caught:
        field = read_field(tmp_path / "a.npy")
    assert caught[0].filename == __file__
    assert (field.spacing.tolist(), field.origin.tolist()) == ([1, 1, 1], [0, 0, 0])


def test_four_dimensional_arrays(tmp_path: Path) -> None:
    """Oracle: algebra. Member i of a stack scaled by i + 1 has i + 1 times the values."""
    stack = np.stack([_linear() * (i + 1) for i in range(3)])
    np.savez(tmp_path / "a.npz", s=stack, spacing=SPACING)
    np.save(tmp_path / "a.npy", stack)
    npz, npy = tmp_path / "a.npz", tmp_path / "a.npy"
    for array in ("s[2]", "[2]"):
        field = read_field(npz, array)
        assert (field.name, field.values.tolist()) == ("s[2]", stack[2].tolist())
    assert np.array_equal(read_field(npy, "[1]", spacing=SPACING).values, stack[1])
    _fails("F09", r"one of 's\[0\]' .. 's\[2\]'.*got none", npz)
    _fails("F09", r"got 's\[3\]'", npz, "s[3]")
    _fails("F09", r"expected one of 's', got 't'", npz, "t[0]")
    _fails("F09", r"one of '\[0\]' .. '\[2\]'", npy)
    _fails("F09", "expected None or", npy, "s")


def test_npz_array_choice(tmp_path: Path) -> None:
    """Oracle: algebra. Several fields need a name; a 3-D array takes no index."""
    path = tmp_path / "a.npz"
    np.savez(path, a=_linear(), b=-_linear(), **{"c[0]": 2 * _linear()}, spacing=SPACING)
    assert read_field(path, "b").values.max() == -_linear().min()
    assert read_field(path, "c[0]").values.max() == 2 * _linear().max()
    _fails("F09", r"among 'a', 'b', 'c\[0\]', got none", path)
    _fails("F09", "no index for the 3-D array", path, "a[0]")


@pytest.mark.parametrize(
    ("code", "text", "arrays"),
    [
        ("F09", r"got 's' \(4, 4\)", {"s": np.ones((4, 4))}),
        ("F09", r"got 's' \(3, 4, 4\)", {"s": np.ones((3, 4, 4))}),
        ("F09", "complex128", {"s": _linear() + 1j}),
        ("F10", "never loaded", {"s": np.full(SHAPE, None, dtype=object)}),
        ("F14", r"spacing: .*got shape \(\)", {"s": _linear(), "spacing": 0.5}),
        ("F14", "spacing: expected 3 positive", {"s": _linear(), "spacing": (1, 0, 1)}),
        ("F14", "origin: expected 3 finite", {"s": _linear(), "origin": (1, np.inf, 1)}),
        ("F10", "never loaded", {"s": _linear(), "spacing": np.array([None] * 3)}),
        ("I03", "constant 1.0", {"s": np.ones(SHAPE), "spacing": (1, 1, 1)}),
    ],
)
def test_npz_faults(tmp_path: Path, code: str, text: str, arrays: dict[str, np.ndarray]) -> None:
    """Oracle: algebra. Each unusable content is refused under its code."""
    np.savez(tmp_path / "a.npz", **arrays)
    _fails(code, text, tmp_path / "a.npz")


def _npy(shape: str, descr: str = "'<f8'", data: bytes = b"") -> bytes:
    text = f"{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}"
    padding = " " * (63 - (10 + len(text)) % 64) + "\n"
    head = (text + padding).encode()
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head + data


@pytest.mark.parametrize(
    ("code", "text", "content"),
    [
        ("F08", "crop or coarsen", _npy("(99999, 99999, 99999)")),
        ("F03", "truncated", _npy("(9999, 9, 9)")),
        ("F03", "bytes left over", _npy("(4, 4, 4)", data=bytes(513))),
        ("F03", "truncated", _npy("(4, 4, 4)", data=bytes(511))),
        ("F03", "expected a shape", _npy("(-4, 4, 4)")),
        ("F03", "header", _npy("(4, 4, 4")),
        ("F03", "header", _npy("(((((((((")),
        ("F03", "header", b"\x93NUMPY\x07\x00" + bytes(100)),
        ("F05", "at least 4 samples", _npy("(0, 4, 4)")),
        ("F05", r"got shape \(64,\)", _npy("(64,)", data=bytes(512))),
        ("F09", "real numbers", _npy("(4, 4, 4)", "[('a', '<f8')]", bytes(512))),
        ("F10", "never loaded", _npy("(4, 4, 4)", "'|O'", bytes(512))),
    ],
)
def test_npy_faults(tmp_path: Path, code: str, text: str, content: bytes) -> None:
    """Oracle: algebra. Headers that lie are refused before anything is allocated."""
    (tmp_path / "a.npy").write_bytes(content)
    _fails(code, text, tmp_path / "a.npy")


def test_pickle_is_never_run(tmp_path: Path) -> None:
    """Oracle: algebra. A pickle that would make a file leaves none behind."""

    class Trap:
        def __reduce__(self) -> tuple[object, tuple[str]]:
            return os.mkdir, (str(tmp_path / "trapped"),)

    np.save(tmp_path / "a.npy", np.full(SHAPE, Trap(), dtype=object), allow_pickle=True)
    _fails("F10", "pickled", tmp_path / "a.npy")
    assert not (tmp_path / "trapped").exists()


@pytest.mark.parametrize("name", ["../s.npy", "/s.npy", "a/../../s.npy", "..\\s.npy", "C:s.npy"])
def test_zip_names(tmp_path: Path, name: str) -> None:
    """Oracle: algebra. A member that points out of the archive is refused."""
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        archive.writestr(name, _npy("(4, 4, 4)", data=bytes(512)))
    _fails("F11", "relative member names", tmp_path / "a.npz")


def test_zip_bombs(tmp_path: Path) -> None:
    """Oracle: data. Deflate ends at a ratio of 1032; more, and doubled members, are refused."""
    with zipfile.ZipFile(tmp_path / "a.npz", "w", zipfile.ZIP_LZMA) as archive:
        archive.writestr("s.npy", _npy("(128, 128, 128)", data=bytes(128**3 * 8)))
    _fails("F11", "compression ratio below 1100", tmp_path / "a.npz")
    with zipfile.ZipFile(tmp_path / "b.npz", "w") as archive:
        archive.writestr("s.npy", _npy("(4, 4, 4)", data=bytes(512)))
        with pytest.warns(UserWarning, match="Duplicate"):
            archive.writestr("s.npy", _npy("(4, 4, 4)", data=bytes(512)))
    _fails("F11", "distinct members", tmp_path / "b.npz")


def test_zip_checksum(tmp_path: Path) -> None:
    """Oracle: algebra. One flipped bit among stored numbers fails the archive's CRC."""
    path = tmp_path / "a.npz"
    np.savez(path, s=_linear(), spacing=SPACING)
    content = bytearray(path.read_bytes())
    content[600] ^= 1
    path.write_bytes(content)
    _fails("F03", "CRC", path)


# -- .cube ----------------------------------------------------------------------


def _cube(
    axes: np.ndarray | None = None,
    origin: tuple[float, ...] = ORIGIN,
    values: np.ndarray | None = None,
    sign: int = 1,
    extra: str = "",
    orbitals: str = "",
) -> str:
    """Text of a cube file; values (n0, n1, n2[, m]) in the file's own order."""
    axes = np.diag(SPACING) if axes is None else axes
    values = _linear() if values is None else values
    lines = ["title", "second", f"{-1 if orbitals else 1} " + " ".join(map(str, origin)) + extra]
    for count, axis in zip(values.shape, axes, strict=False):
        lines.append(f"{sign * count} " + " ".join(f"{step:.10f}" for step in axis))
    lines.append("1 1.0 0.0 0.0 0.0")
    lines += [orbitals] if orbitals else []
    lines += [f"{value:.10E}" for value in values.ravel()]
    return "\n".join(lines) + "\n"


def _read_text(tmp_path: Path, text: str, array: str | None = None) -> ScalarField:
    path = tmp_path / "a.cube"
    path.write_text(text)
    return read_field(path, array)


@pytest.mark.parametrize("zipped", [False, True])
def test_cube_grid_and_values(tmp_path: Path, zipped: bool) -> None:
    """Oracle: analytic. Grid parsed from the header here; values are 10 + x + 2 y + 4 z."""
    path = DATA / "linear.cube"
    rows = [[float(word) for word in line.split()] for line in path.read_text().splitlines()[2:6]]
    if zipped:
        zipped_path = tmp_path / "linear.CUBE.GZ"
        zipped_path.write_bytes(gzip.compress(path.read_bytes()))
        path = zipped_path
    field = read_field(path)
    assert field.origin.tolist() == rows[0][1:4]
    assert field.spacing.tolist() == [rows[1][1], rows[2][2], rows[3][3]]
    assert list(field.values.shape) == [row[0] for row in rows[1:]]
    points = np.array([[-0.7, 2.9, 0.6], [0.9, 2.1, 1.9]])
    assert field.value(points) == pytest.approx(10 + points @ [1, 2, 4])
    assert field.name == "value = 10 + x + 2 y + 4 z, in bohr"


def test_cube_same_as_pyvista_values() -> None:
    """Oracle: peer. VTK's cube reader finds the same samples (it loses the grid)."""
    from vtkmodules.vtkIOChemistry import vtkGaussianCubeReader2

    reader = vtkGaussianCubeReader2()
    reader.SetFileName(str(DATA / "linear.cube"))
    reader.Update()
    grid = pv.wrap(reader.GetGridOutput())
    theirs = np.asarray(grid.active_scalars).reshape(grid.dimensions, order="F")
    assert read_field(DATA / "linear.cube").values == pytest.approx(theirs, rel=1e-6)


def test_cube_angstrom(tmp_path: Path) -> None:
    """Oracle: analytic. Negative voxel counts: 1 angstrom is 1/0.529177210903 bohr."""
    field = _read_text(tmp_path, _cube(sign=-1))
    assert field.spacing == pytest.approx(np.array(SPACING) / BOHR)
    assert field.origin == pytest.approx(np.array(ORIGIN) / BOHR)
    text = _cube().replace("\n4 ", "\n-4 ")
    with pytest.raises(FileError, match="all positive or all negative") as caught:
        _read_text(tmp_path, text)
    assert caught.value.code == "F14"


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 0, 1), (1, 0, 2)])
@pytest.mark.parametrize("signs", [(1, 1, 1), (-1, 1, 1), (1, -1, -1)])
def test_cube_turned_axes(
    tmp_path: Path, order: tuple[int, int, int], signs: tuple[int, int, int]
) -> None:
    """Oracle: symmetry. However its axes run, the same field gives the same value at a point."""
    axes, origin, values = np.zeros((3, 3)), list(ORIGIN), _linear()
    for row, direction in enumerate(order):
        axes[row, direction] = SPACING[direction] * signs[direction]
    for direction in range(3):
        if signs[direction] < 0:
            origin[direction] += SPACING[direction] * (SHAPE[direction] - 1)
            values = np.flip(values, direction)
    text = _cube(axes, tuple(origin), np.ascontiguousarray(values.transpose(order)))
    field = _read_text(tmp_path, text)
    assert field.spacing == pytest.approx(SPACING)
    assert field.origin == pytest.approx(ORIGIN)
    assert field.value([[0.1, 2.3, 1.2]]) == pytest.approx(10 + 0.1 + 4.6 + 4.8)


def test_cube_skewed_axes(tmp_path: Path) -> None:
    """Oracle: algebra. A skewed or degenerate grid is refused."""
    for row in ([0.1, 0.4, 0.0], [0.4, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, np.nan, 0.0]):
        axes = np.diag(SPACING)
        axes[1] = row
        with pytest.raises(FileError, match="along x, y and z") as caught:
            _read_text(tmp_path, _cube(axes))
        assert caught.value.code == "F14"


@pytest.mark.parametrize("kind", ["orbitals", "several values"])
def test_cube_several_values(tmp_path: Path, kind: str) -> None:
    """Oracle: algebra. Value k of every voxel is k + 1 times the first; one must be named."""
    values = np.stack([_linear() * (k + 1) for k in range(3)], axis=-1)
    options = {"orbitals": "3 5 6\n7"} if kind == "orbitals" else {"extra": " 3"}
    text = _cube(values=values, **options)
    for k in range(3):
        field = _read_text(tmp_path, text, str(k))
        assert field.values == pytest.approx(_linear() * (k + 1))
    with pytest.raises(FileError, match="among '0', '1', '2', got none") as caught:
        _read_text(tmp_path, text)
    assert caught.value.code == "F09"
    with pytest.raises(FileError, match="got '3'"):
        _read_text(tmp_path, text, "3")


def test_cube_single_orbital_is_the_default(tmp_path: Path) -> None:
    """Oracle: algebra. With one orbital there is nothing to choose."""
    assert _read_text(tmp_path, _cube(orbitals="1 5")).values == pytest.approx(_linear())


@pytest.mark.parametrize(
    ("code", "text", "content"),
    [
        ("F03", "more numbers or text after", _cube() + "1.0\n"),
        ("F03", "more numbers or text after", _cube() + "end of file\n"),
        ("F03", "expected 120 values, got 119", _cube()[: _cube()[:-1].rindex("\n") + 1]),
        ("F03", "a line end after the last number", _cube()[:-1]),
        ("F03", "a line end after the last number", _cube()[:-2]),
        ("F03", "could not convert", _cube().replace("E+01", "x+01", 1)),
        ("F03", "numbers", "a\nb\nc d e f\n"),
        ("F03", "end of the file", "title\nsecond\n1 0 0 0\n4 1 0 0\n"),
        ("F03", "atoms, got the end", _cube().replace("\n1 -1.0", "\n9999999 -1.0")),
        ("F03", "values a voxel", _cube(extra=" 99999999999")),
        ("F03", "values a voxel", _cube(orbitals="1 2 3")),
        ("F03", "expected 24000 values", _cube().replace("\n5 ", "\n1000 ")),
        ("F05", "at least 4 samples", _cube(values=_linear()[:, :3])),
        ("F08", "crop or coarsen", _cube().replace("\n5 ", "\n99999999999 ")),
        ("F14", "origin: expected 3 finite", _cube(origin=(np.nan, 0, 0))),
    ],
)
def test_cube_faults(tmp_path: Path, code: str, text: str, content: str) -> None:
    """Oracle: algebra. Each damaged cube is refused under its code."""
    (tmp_path / "a.cube").write_text(content)
    _fails(code, text, tmp_path / "a.cube")


def test_cube_gz_damage(tmp_path: Path) -> None:
    """Oracle: algebra. A flipped byte or a cut in the gzip stream is F03."""
    whole = bytearray(gzip.compress((DATA / "linear.cube").read_bytes()))
    path = tmp_path / "a.cube.gz"
    path.write_bytes(whole[:-9])
    _fails("F03", "truncated or damaged", path)
    whole[-6] ^= 1
    path.write_bytes(whole)
    _fails("F03", "truncated or damaged", path)


# -- truncation -----------------------------------------------------------------


def _whole(kind: str) -> bytes:
    buffer = io.BytesIO()
    if kind == "npy":
        np.save(buffer, _linear())
    elif kind == "npz":
        np.savez_compressed(buffer, s=_linear(), spacing=SPACING)
    elif kind == "cube":
        return (DATA / "linear.cube").read_bytes()
    elif kind == "cube.gz":
        return gzip.compress((DATA / "linear.cube").read_bytes())
    return buffer.getvalue()


def _read_bytes(path: Path, content: bytes) -> ScalarField:
    path.write_bytes(content)
    return read_field(path, **({"spacing": SPACING} if path.suffix == ".npy" else {}))


@pytest.mark.parametrize("kind", ["npy", "npz", "cube", "cube.gz", "vti"])
def test_truncated_anywhere(tmp_path: Path, kind: str) -> None:
    """Oracle: algebra. Whatever prefix is left, the answer is a FileError, never a field."""
    path = tmp_path / f"a.{kind}"
    whole = _vtk_file(path).read_bytes() if kind == "vti" else _whole(kind)
    assert np.allclose(_read_bytes(path, whole).values, _linear())
    cuts = {*range(1, len(whole), 23), *range(len(whole) - 30, len(whole))}
    if kind == "vti":  # a final line end is no part of the XML
        cuts -= {len(whole) - 1}
    for cut in sorted(cuts):
        with pytest.raises(FileError):
            _read_bytes(path, whole[:cut])


# -- demonstration data ---------------------------------------------------------


def test_demo_fields() -> None:
    """Oracle: data. Ten electrons, 0.002 at least five voxels inside the box, small files."""
    base, perturbed = (read_field(path) for path in water_pair())
    for field, path in zip((base, perturbed), water_pair(), strict=True):
        inside = np.argwhere(field.values >= 0.002)
        assert inside.min() >= 5
        assert (np.array(field.values.shape) - 1 - inside.max(axis=0) >= 5).all()
        electrons = field.values.sum() * field.spacing.prod()
        assert electrons == pytest.approx(10, rel=0.05)  # a sum cannot resolve the core
        assert path.stat().st_size < 300_000
    assert base.spacing.tolist() == perturbed.spacing.tolist()
    assert base.origin.tolist() == perturbed.origin.tolist()


def test_demo_fields_differ_where_the_bond_is_stretched() -> None:
    """Oracle: analytic. The density changes most at the hydrogen that moves, x < 0."""
    base, perturbed = (read_field(path) for path in water_pair())
    where = np.argmax(abs(perturbed.values - base.values))
    index = np.unravel_index(where, base.values.shape)
    point = base.origin + base.spacing * index
    angle = np.radians(104.52 / 2)
    hydrogen = 0.975 / BOHR * np.array([-np.sin(angle), 0, np.cos(angle)])
    assert np.linalg.norm(point - hydrogen) < 0.5
