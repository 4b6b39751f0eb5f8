"""The house rules: who may import whom, what loading isovary costs, what its surface shows.

The checker below reads source text, so it also runs on small made-up sources:
a rule that cannot fail is no rule.
"""

from __future__ import annotations

import ast
import importlib.metadata
import importlib.util
import inspect
import os
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

import isovary

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "src" / "isovary"

# Imports go down only. A new file or room is added here, once.
LAYERS = {
    **dict.fromkeys(["records", "scalar_field", "errors", "geometry", "projection"], 0),
    **dict.fromkeys(["rigid_motion", "level_sets", "isometry", "sliding", "quasi_newton"], 0),
    **dict.fromkeys(["row_distances", "crossings", "dimple_checks"], 0),
    **dict.fromkeys(["meshing", "laplacian", "spectrum", "signature", "alignment", "rims"], 1),
    **dict.fromkeys(["carrying", "correspondence", "difference", "clustering"], 1),
    **dict.fromkeys(["embedding", "color", "deform", "shapes", "potentials"], 1),
    **dict.fromkeys(["comparison", "levels", "methods", "noise", "notes", "quality", "sweep"], 2),
    **dict.fromkeys(
        [
            "checks",
            "families",
            "task",
            "topology_change",
            "matching",
            "extrinsic",
            "groups",
            "names",
        ],
        2,
    ),
    **dict.fromkeys(["io", "view", "app", "paraview", "data", "thesis", "cli", "__main__"], 3),
}

# Packages that layers 0 to 2 may import inside a function, beside scipy.
HEAVY_INSIDE = {
    "laplacian": {"robust_laplacian"},
    "meshing": {"vtk", "vtkmodules", "pyvista"},
    "correspondence": {"vtk", "vtkmodules", "pyvista"},
    "spectrum": {"psutil", "threadpoolctl"},
    "sweep": {"dask", "distributed"},
}

# The one way up: (module, functions) -> rooms they may import. The methods are a convenience
# of the finished comparison; nothing of layer 3 is loaded until they are called.
WAYS_UP = {
    ("comparison", "plot"): {"view", "io"},
    ("comparison", "save"): {"view", "io"},
    ("quality", "plot"): {"view"},
}


@dataclass(frozen=True)
class Import:
    """One imported name: ``target`` is dotted, ``isovary.records.Surface`` or ``numpy``."""

    target: str
    line: int
    function: str | None  # name of the innermost function around it
    typing_only: bool


def imports_of(source: str, module: str, is_package: bool = False) -> Iterator[Import]:
    """Yield every import of a module of isovary, dynamic ones included."""
    parts = module.split(".")
    package = parts if is_package else parts[:-1]

    def visit(node: ast.AST, function: str | None, typing_only: bool) -> Iterator[Import]:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            function = node.name
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            for child in node.body:
                yield from visit(child, function, True)
            for child in node.orelse:
                yield from visit(child, function, typing_only)
            return
        names: list[str] = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            base = base + (node.module.split(".") if node.module else [])
            names = [".".join([*base, alias.name]) for alias in node.names]
        elif isinstance(node, ast.Call) and ast.unparse(node.func).split(".")[-1] in (
            "import_module",
            "__import__",
        ):
            names = ["<dynamic>"]
        for name in names:
            yield Import(name, node.lineno, function, typing_only)  # type: ignore[attr-defined]
        for child in ast.iter_child_nodes(node):
            yield from visit(child, function, typing_only)

    yield from visit(ast.parse(source), None, False)


def room_of(target: str) -> str:
    """Return the room or file of layer 0 to 3 that a dotted name of isovary lies in, or ''."""
    parts = target.split(".")
    return parts[1] if len(parts) > 1 and parts[1] in LAYERS else ""


def faults_of(source: str, module: str, is_package: bool = False) -> list[str]:
    """List the breaches of the import rules in one module's source."""
    faults = []
    own = room_of(module)
    is_root = module == "isovary"
    if not is_root and not own:
        return [f"{module}: give {module.split('.')[1]} a layer in tests/test_house.py"]
    layer = 2 if is_root else LAYERS[own]

    for found in imports_of(source, module, is_package):
        where = f"{module}:{found.line} imports {found.target}"
        top = found.target.split(".")[0]
        if top == "<dynamic>":
            if layer < 3 and not is_root:
                faults.append(f"{where}: no dynamic imports below layer 3")
        elif top == "isovary":
            room = room_of(found.target)
            if not room:
                # A file without a layer is reported once, where it stands. Names of the package
                # itself come from its __init__, which stands above layers 0 to 2.
                if layer < 3 and not is_root and found.target.count(".") < 2:
                    faults.append(f"{where}: import from the module that defines it")
            elif is_root:
                readers = ("isovary.io.read_field", "isovary.io.read_surface")
                if LAYERS[room] > 2 and found.target not in readers:
                    rule = "layers 0 to 2, io.read_field and io.read_surface"
                    faults.append(f"{where}: __init__ may name {rule}")
            elif room == own or room in WAYS_UP.get((own, found.function or ""), ()):
                pass
            elif LAYERS[room] > layer:
                faults.append(f"{where}: layer {layer} may not import layer {LAYERS[room]}")
            elif LAYERS[room] == layer == 1:
                faults.append(f"{where}: rooms of layer 1 do not know one another")
        elif layer < 3 and not found.typing_only and top not in sys.stdlib_module_names:
            allowed = {"numpy"}
            if found.function:
                allowed |= {"scipy"} | HEAVY_INSIDE.get(own, set())
            if top not in allowed:
                place = "inside a function" if found.function else "at module level"
                faults.append(f"{where} {place}: allowed there are {sorted(allowed)} and stdlib")
    return faults


def modules() -> Iterator[tuple[str, Path]]:
    """Yield the dotted name and the path of every module of isovary."""
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = ["isovary", *path.relative_to(PACKAGE).with_suffix("").parts]
        yield ".".join(parts[:-1] if parts[-1] == "__init__" else parts), path


def test_imports_go_down_only():
    """Oracle: algebra. Layers 0 <- 1 <- 2 <- 3; rooms of layer 1 do not know one another."""
    faults = [
        fault
        for module, path in modules()
        for fault in faults_of(path.read_text("utf-8"), module, path.name == "__init__.py")
    ]
    assert not faults, "\n".join(faults)


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("isovary.records", "from .meshing import marching_cubes"),
        ("isovary.records", "from isovary.spectrum import eigenpairs"),
        ("isovary.records", "import isovary.view"),
        ("isovary.records", "from isovary import view"),
        ("isovary.records", "from . import marching_cubes"),
        ("isovary.geometry", "def f():\n    from . import spectrum"),
        ("isovary.geometry", "import scipy.sparse"),
        ("isovary.geometry", "class A:\n    from scipy import sparse"),
        ("isovary.spectrum", "from .laplacian import fem"),
        ("isovary.spectrum", "def f():\n    from .laplacian._fem import fem"),
        ("isovary.spectrum", "def f():\n    import vtk"),
        ("isovary.spectrum", "import importlib\nimportlib.import_module('isovary.view')"),
        ("isovary.laplacian._fem", "from ..spectrum import eigenpairs"),
        ("isovary.laplacian._fem", "from .. import shapes"),
        ("isovary.meshing._marching_cubes", "import pyvista"),
        ("isovary.meshing._marching_cubes", "try:\n    import vtk\nexcept ImportError: pass"),
        ("isovary.meshing._marching_cubes", "if not TYPE:\n    from vtkmodules import util"),
        ("isovary.clustering._k_medians", "def f():\n    import pyvista"),
        ("isovary.comparison", "from .view import draw"),
        ("isovary.comparison", "def compare():\n    from .view import draw"),
        ("isovary.comparison", "class C:\n    def plot(self):\n        from .cli import main"),
        ("isovary.noise", "def plot():\n    from .view import draw"),
        ("isovary", "from .view import draw"),
        ("isovary", "from .io import write_results"),
        ("isovary", "import pyvista"),
        ("isovary.drawer", "import numpy"),
    ],
)
def test_a_forbidden_import_is_found(module, source):
    """Oracle: algebra. Each of these sources breaks one rule, and the checker says so."""
    assert len(faults_of(source, module, is_package=module == "isovary")) == 1


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("isovary.records", "from . import geometry\nfrom .errors import MeshError"),
        ("isovary.records", "if TYPE_CHECKING:\n    from scipy.sparse import csr_array"),
        ("isovary.spectrum", "import numpy as np\nfrom isovary.records import Laplacian"),
        ("isovary.spectrum", "def f():\n    from scipy.sparse.linalg import eigsh"),
        ("isovary.laplacian._fem", "from ..records import Surface\nfrom ._quadrature import rule"),
        ("isovary.laplacian._fem", "from .. import geometry"),
        (
            "isovary.meshing._remesh",
            "def f():\n    import pyvista\n    from vtkmodules import util",
        ),
        ("isovary.comparison", "from .noise import floor\nfrom .meshing import marching_cubes"),
        ("isovary.comparison", "class C:\n    def save(self):\n        from .io import write"),
        ("isovary", "from .records import Surface as Surface\nfrom .comparison import compare"),
        ("isovary", "def __getattr__(name):\n    from .io import read_field"),
        ("isovary.view._curves", "import matplotlib\nfrom isovary import compare, __version__"),
        ("isovary.cli", "from .io import read_field\nfrom .view import draw"),
    ],
)
def test_an_allowed_import_passes(module, source):
    """Oracle: algebra. None of these sources breaks a rule."""
    assert faults_of(source, module, is_package=module == "isovary") == []


def test_a_room_knows_its_own_init():
    """Oracle: algebra. ``from . import x`` means the room inside it, the package in a file."""
    assert faults_of("from . import _fem", "isovary.laplacian", is_package=True) == []
    assert faults_of("from .. import view", "isovary.laplacian", is_package=True) != []


def test_importing_isovary_loads_nothing_heavy():
    """Oracle: data. What a fresh interpreter has loaded after ``import isovary``."""
    heavy = ["vtk", "vtkmodules", "pyvista", "matplotlib", "plotly", "rich", "cyclopts"]
    heavy += ["trame", "scipy.interpolate"]
    program = f"import isovary, sys; print(*(name for name in {heavy} if name in sys.modules))"
    path = os.pathsep.join(filter(None, [str(PACKAGE.parent), os.environ.get("PYTHONPATH")]))
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", program],
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == []


def test_public_names_are_sorted_and_documented():
    """Oracle: algebra. Each name of ``isovary.__all__`` exists and says what it is."""
    names = list(getattr(isovary, "__all__", []))
    assert names == sorted(set(names))
    bare = [name for name in names if not inspect.getdoc(getattr(isovary, name))]
    assert not bare, f"without a docstring: {bare}"


def test_package_says_it_is_typed():
    """Oracle: data. Type checkers look for ``py.typed`` beside ``__init__.py``."""
    assert (PACKAGE / "py.typed").is_file()


def test_version_has_one_source():
    """Oracle: data. The version everywhere is the one in pyproject.toml."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    try:
        installed = importlib.metadata.version("isovary")
    except importlib.metadata.PackageNotFoundError:
        pytest.skip("isovary is on the path, but not installed")
    assert installed == project["version"]
    assert getattr(isovary, "__version__", installed) == project["version"]


def test_files_inside_a_room_start_with_an_underscore():
    """Oracle: algebra. ``laplacian/_fem.py`` holds ``fem``, so that a name means one thing."""
    plain = [
        str(path.relative_to(PACKAGE))
        for _, path in modules()
        if path.parent != PACKAGE and not path.name.startswith("_")
    ]
    assert not plain, f"rename with a leading underscore: {plain}"


def raised_codes() -> set[str]:
    """Return the code of every fault that the source raises, read from the calls."""
    codes = set()
    for _, path in modules():
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.Call) and ast.unparse(node.func).endswith("Error"):
                first = node.args[0] if node.args else None
                if isinstance(first, ast.Constant) and re.fullmatch(r"[A-Z]\d\d", str(first.value)):
                    codes.add(str(first.value))
    return codes


def test_every_fault_code_is_in_the_docs():
    """Oracle: data. docs/faults.md has a row for each code that the source raises."""
    page = (ROOT / "docs" / "faults.md").read_text("utf-8")
    missing = raised_codes() - set(re.findall(r"^\| ([A-Z]\d\d) \|", page, re.MULTILINE))
    assert not missing, f"without a row: {sorted(missing)}"


def test_planted_faults_can_be_planted(monkeypatch):
    """Oracle: data. Each fault of tools/planted_faults.py finds its line exactly once."""
    monkeypatch.syspath_prepend(ROOT / "tools")
    path = ROOT / "tools" / "planted_faults.py"
    spec = importlib.util.spec_from_file_location("planted_faults", path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    for fault in module.FAULTS:
        text = (PACKAGE / fault.file).read_text()
        assert text.count(fault.before) == 1, fault
