"""A comparison made visible: one picture, and one page that can be turned; a mesh's quality.

Pictures are drawn by VTK where OpenGL works and by matplotlib elsewhere; set
``ISOVARY_NO_OPENGL=1`` to choose the latter.
"""

from ._both import both
from ._count_choice import count_choice_figure
from ._dendrogram import dendrogram_figure
from ._details import details
from ._displacement import displacement_figure
from ._mesh_quality import mesh_quality_figure
from ._opengl import can_draw
from ._overview import overview
from ._report import write_report

__all__ = [
    "both",
    "can_draw",
    "count_choice_figure",
    "dendrogram_figure",
    "details",
    "displacement_figure",
    "mesh_quality_figure",
    "overview",
    "write_report",
]
