"""Uploaded files are what their first bytes say, and lie where they are put."""

from __future__ import annotations

import gzip
import os
import pickle
import re
import struct
import zipfile

import numpy as np
import pytest
import pyvista as pv

import isovary as iv
from isovary.app._uploads import (
    FIELD_SUFFIXES,
    SURFACE_SUFFIXES,
    accepted_suffixes,
    confined,
    random_name,
    sniff,
)
from isovary.data import water_pair
from isovary.errors import ArgumentError, FileError
from isovary.io._fields import _READERS
from isovary.io._surface_checks import SUFFIXES

CUBE = b"""title
second title
    1    0.000000    0.000000    0.000000
    4    1.000000    0.000000    0.000000
    4    0.000000    1.000000    0.000000
    4    0.000000    0.000000    1.000000
    8    8.000000    0.000000    0.000000    0.000000
 1.0 2.0
"""
STL = b"solid a\n facet normal 0 0 1\n  outer loop\n"
BINARY_STL = b"solid, but binary".ljust(80) + struct.pack("<I", 1) + bytes(50)
OBJ = b"# a cube\n\nmtllib cube.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/1 2/2 3/3\n"
PLY = b"ply\nformat ascii 1.0\nelement vertex 3\n"
VTK = b"# vtk DataFile Version 3.0\ntitle\nASCII\n"
XML = b'<?xml version="1.0"?>\n<VTKFile type="%s" version="1.0">\n'
NPY = b"\x93NUMPY\x01\x00v\x00{'descr': '<f8', 'fortran_order': False, 'shape': (4, 4, 4), }"

GOOD = {
    "a.vti": XML % b"ImageData",
    "A.VTI": b'<VTKFile version="0.1" type="ImageData">',
    "b.vtp": XML % b"PolyData",
    "c.vtu": b"\xef\xbb\xbf" + XML % b"UnstructuredGrid",
    "d.vtk": VTK,
    "e.npy": NPY,
    "e2.npy": NPY.replace(b"\x01\x00", b"\x02\x00", 1),
    "f.npz": b"PK\x03\x04\x14\x00\x00\x00",
    "g.cube": CUBE,
    "h.cube.gz": gzip.compress(CUBE * 100),
    "i.ply": PLY,
    "i2.ply": PLY.replace(b"\n", b"\r\n"),
    "j.stl": STL,
    "k.stl": BINARY_STL,
    "l.obj": OBJ,
    "m.off": b"OFF\n3 1 0\n",
    "../../etc/n.npy": NPY,
}


@pytest.mark.parametrize("name", GOOD)
def test_right_content_is_recognized(tmp_path, name):
    """Oracle: data. First bytes as the formats' specifications have them; only the end counts."""
    (tmp_path / "upload").write_bytes(GOOD[name])
    end = ".cube.gz" if name.endswith(".gz") else "." + name.lower().split(".")[-1]
    assert sniff(tmp_path / "upload", name) == end


def test_files_that_programs_write_are_recognized(tmp_path):
    """Oracle: peer. NumPy and VTK write what is taken for their format."""
    box = np.arange(64.0).reshape(4, 4, 4)
    np.save(tmp_path / "a.npy", box)
    np.savez(tmp_path / "b.npz", s=box)
    np.savez_compressed(tmp_path / "c.npz", s=box)
    sphere = pv.Sphere()
    for suffix in (".vtp", ".vtk", ".ply", ".stl"):
        sphere.save(tmp_path / f"d{suffix}")
    sphere.save(tmp_path / "e.stl", binary=False)
    sphere.save(tmp_path / "f.ply", binary=False)
    sphere.cast_to_unstructured_grid().save(tmp_path / "h.vtu")
    pv.ImageData(dimensions=(4, 4, 4)).save(tmp_path / "i.vti")
    for path in [*tmp_path.iterdir(), *water_pair()]:
        assert sniff(path, path.name) == path.suffix


BAD = {
    "empty.vti": (b"", "F02", "empty"),
    "program.npy": (b"\x7fELF\x02\x01\x01", "F04", "program"),
    "pickle.npy": (pickle.dumps({"a": 1}, 4), "F04", "pickle"),
    "page.obj": (b"<!DOCTYPE html><script>alert(1)</script>", "F04", "web page"),
    "script.obj": (b"#!/bin/sh\nrm -rf /\n", "F04", "script"),
    "text.obj": (b"v 0 0 0\nhello world\n", "F04", "other text"),
    "mesh.vti": (XML % b"PolyData", "F04", "PolyData"),
    "field.vtp": (XML % b"ImageData", "F04", "ImageData"),
    "hidden.vti": (b"MZ\x90" + XML % b"ImageData", "F04", "a VTKFile"),
    "comment.vti": (b'<html><!-- <VTKFile type="ImageData"> -->', "F04", "VTKFile"),
    "array.npz": (NPY, "F04", ".npy"),
    "archive.npy": (b"PK\x03\x04", "F04", ".npz"),
    "old.npy": (NPY.replace(b"\x01\x00", b"\x09\x00", 1), "F04", ".npy"),
    "picture.stl": (b"\x89PNG\r\n\x1a\n" + bytes(100), "F04", "PNG"),
    "short.stl": (BINARY_STL[:-1], "F04", "another format"),
    "novel.stl": (b"solid ground was what he wanted\nand he found it\n", "F04", "other text"),
    "words.cube": (b"one\ntwo\nthree 1 2 3\n4 1 0 0\n4 0 1 0\n4 0 0 1\n", "F04", "other text"),
    "axes.cube": (CUBE.replace(b"    1.000000    0.000000    0.0", b"  1", 1), "F04", "other text"),
    "volume.cube": (b"\x89HDF\r\n\x1a\n" + bytes(50), "F04", "HDF5"),
    "zipped.cube": (gzip.compress(CUBE), "F04", "gzip"),
    "plain.cube.gz": (CUBE, "F04", "other text"),
    "other.cube.gz": (gzip.compress(b"hello" * 100), "F04", "gzip"),
    "cut.cube.gz": (b"\x1f\x8b\x08", "F04", "gzip"),
    "legacy.ply": (VTK, "F04", ".vtk"),
    "polite.ply": (b"plywood\n", "F04", ".ply"),
    "stanford.off": (PLY, "F04", ".ply"),
    "officer.off": (b"OFFICER\n", "F04", ".off"),
    "stanford.vtk": (PLY, "F04", ".ply"),
    "a.exe": (b"MZ", "F04", "got 'a.exe'"),
    "a.vti.html": (XML % b"ImageData", "F04", "a name that ends in"),
    "a.vti\0": (XML % b"ImageData", "F04", r"got 'a.vti\x00'"),
    "vti": (XML % b"ImageData", "F04", "a name that ends in"),
    "a.gz": (gzip.compress(CUBE), "F04", "a name that ends in"),
}


@pytest.mark.parametrize("name", BAD)
def test_wrong_content_is_refused(tmp_path, name):
    """Oracle: data. The formats' magic bytes; the message says what was expected and what came."""
    content, code, text = BAD[name]
    (tmp_path / "upload").write_bytes(content)
    with pytest.raises(FileError, match=re.escape(text)) as caught:
        sniff(tmp_path / "upload", name)
    assert caught.value.code == code
    assert "expected" in str(caught.value)
    assert str(tmp_path) not in str(caught.value)


def test_long_names_do_not_fill_the_message(tmp_path):
    """Oracle: algebra. Sixty characters of it, in ASCII, without control characters."""
    (tmp_path / "upload").write_bytes(b"x")
    with pytest.raises(FileError) as caught:
        sniff(tmp_path / "upload", "\x1b[31m" + "ü" * 5000)
    assert len(str(caught.value)) < 600
    assert str(caught.value).isprintable()
    assert str(caught.value).isascii()


def test_accepted_is_what_the_readers_read():
    """Oracle: data. The tables of read_field and read_surface."""
    assert set(FIELD_SUFFIXES) == set(_READERS)
    assert set(SURFACE_SUFFIXES) == set(SUFFIXES)
    assert set(accepted_suffixes()) == {*_READERS, *SUFFIXES}


def test_a_random_name_keeps_nothing_but_the_suffix(tmp_path):
    """Oracle: data. 128 random bits in hexadecimal, each time others; the file can be read."""
    names = {random_name(".vti") for _ in range(100)}
    assert len(names) == 100
    assert all(re.fullmatch(r"[0-9a-f]{32}\.vti", name) for name in names)
    np.savez(tmp_path / random_name(".npz"), s=np.arange(64.0).reshape(4, 4, 4), spacing=np.ones(3))
    (path,) = tmp_path.iterdir()
    assert iv.read_field(path).values.shape == (4, 4, 4)
    for suffix in (".exe", "vti", "", "/../x.vti", ".VTI"):
        with pytest.raises(ArgumentError) as caught:
            random_name(suffix)
        assert caught.value.code == "A02"


NASTY = [
    "",
    ".",
    "..",
    "/",
    "../x",
    "a/../../x",
    "a/..",
    "a/./b",
    "a//b",
    "a/",
    "/etc/passwd",
    "//server/share",
    "~/../../x/..",
    "C:/x",
    "C:x",
    "c:",
    "a\\..\\..\\x",
    "\\\\server\\share",
    "x\0.vti",
    "\0",
    "x\n.vti",
    "x\r\nSet-Cookie: a=b",
    "x\x7f",
    "file:///etc/passwd",
    "x.vti:stream",
    "x.vti::$DATA",
    "CON",
    "nul.txt",
    "a/aux.vti",
    "COM1",
    "lpt9.log",
    "x.vti.",
    "x.vti ",
    ". .",
    ".. ",
    "...",
    "a/... /b",
    "a|b",
    "<x>",
    "x?",
    "x*",
    "x" * 256,
    "ü" * 128,
    "a/" + "y" * 5000 + "/b",
    "\ud800.vti",
    "link",
    "link/secret.txt",
    "link/new.txt",
    "up/outside/secret.txt",
    "loop",
    "loop/x",
    "here",
    "file-link",
    None,
    b"x",
]


@pytest.fixture
def root(tmp_path):
    """A folder with links that lead out, around, up and to itself."""
    (tmp_path / "outside").mkdir()
    (tmp_path / "outside" / "secret.txt").write_text("secret")
    root = tmp_path / "root"
    (root / "run").mkdir(parents=True)
    (root / "run" / "report.html").write_text("report")
    links = {
        "link": tmp_path / "outside",
        "up": tmp_path,
        "loop": root / "loop",
        "here": root,
        "file-link": tmp_path / "outside" / "secret.txt",
        "inner": root / "run",
    }
    for name, target in links.items():
        (root / name).symlink_to(target)
    return root


@pytest.mark.parametrize("name", NASTY)
def test_names_that_lead_out_are_refused(root, name):
    """Oracle: data. A02; the list holds what leaves a folder on Linux, macOS or Windows."""
    with pytest.raises(ArgumentError, match="expected a path inside the folder") as caught:
        confined(root, name)
    assert caught.value.code == "A02"
    assert str(caught.value).isprintable()


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        ("run/report.html", ["run", "report.html"]),
        ("new.vti", ["new.vti"]),
        ("a b (1).cube.gz", ["a b (1).cube.gz"]),
        (".hidden", [".hidden"]),
        ("~", ["~"]),
        ("%2e%2e", ["%2e%2e"]),
        ("Größe/π.vti", ["Größe", "π.vti"]),
        ("..a/b..c", ["..a", "b..c"]),
        ("console.log", ["console.log"]),
        ("inner/report.html", ["run", "report.html"]),
    ],
)
def test_plain_names_lie_below_the_folder(root, name, parts):
    """Oracle: algebra. The folder and the parts; a link inside leads to what it means."""
    assert confined(root, name) == root.resolve().joinpath(*parts)
    assert confined(os.path.relpath(root), name) == root.resolve().joinpath(*parts)


def test_a_sibling_whose_name_begins_alike_is_outside(root):
    """Oracle: algebra. root-2 begins with root, and is not in it."""
    (root.parent / "root-2").mkdir()
    (root / "twin").symlink_to(root.parent / "root-2")
    with pytest.raises(ArgumentError):
        confined(root, "twin")


def test_an_archive_is_not_opened_to_sniff(tmp_path):
    """Oracle: algebra. Four bytes decide: a bomb is the reader's to find."""
    with zipfile.ZipFile(tmp_path / "x", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("s.npy", bytes(10_000_000))
    assert sniff(tmp_path / "x", "x.npz") == ".npz"
    (tmp_path / "x").rename(tmp_path / "x.npz")
    with pytest.raises(FileError):
        iv.read_field(tmp_path / "x.npz")
