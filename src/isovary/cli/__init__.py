"""The command line, a file for each command.

Exit codes: 0 done, 1 the data cannot be compared (the message says why),
2 wrong usage.
"""

from ._app import app, main
from ._compare import compare_files, demo
from ._dimple import dimple_surface
from ._export import export_result
from ._info import info
from ._mesh import mesh_file
from ._thesis import thesis_figures
from ._view import view_result

__all__ = [
    "app",
    "compare_files",
    "demo",
    "dimple_surface",
    "export_result",
    "info",
    "main",
    "mesh_file",
    "thesis_figures",
    "view_result",
]
