"""The picture in the README: the same comparison carried and with independent meshes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from mesh_noise import Row, Run

import isovary as iv
from isovary.geometry import Floats
from isovary.view import _paint as paint
from isovary.view._camera import Camera, choose_camera
from isovary.view._marks import color_bar
from isovary.view._opengl import opengl_problem
from isovary.view._scene import Scene, mesh_lines
from isovary.view._tessellate import at_pieces, tessellate

CARRIED, THESIS = "carried, curved quadratic", "independent, flat linear"
STYLES = {
    CARRIED: ("#009e73", "o", "-"),
    "carried, flat linear": ("#009e73", "^", "--"),
    "independent, curved quadratic": ("#d55e00", "o", "-"),
    THESIS: ("#d55e00", "^", "--"),
    "independent, raw marching cubes, linear": ("#7a3b00", "x", ""),
}


def draw_picture(rows: list[Row], exact: Run, shown: dict[str, Run], path: Path) -> None:
    """Three surfaces in one colour scale, and the error against the number of vertices."""
    norm = iv.change_norm(exact.change)
    limit, peak = float(norm.max()), int(norm.argmax())
    pieces = tessellate(exact.base, 2)
    weights = pieces.areas * at_pieces(exact.base, 2, norm)
    mark = exact.base.points[peak], exact.base.normals[peak]
    camera = choose_camera(pieces.middles, pieces.facing, weights, mark)
    errors = {row.way: row.error for row in rows if row.wanted == 552}
    counts = {row.way: row.vertices for row in rows if row.wanted == 552}

    figure = Figure(figsize=(12.8, 4.5), dpi=150, facecolor="white")
    title = "Same data, equally fine: one carried mesh shows the change, two flat meshes drown it"
    figure.text(0.02, 0.93, title, size=15, weight="bold", color="#1d1d1f")
    said = "water, one O–H bond 0.95 → 1.00 Å; isosurface of the electron density"
    figure.text(0.02, 0.865, said, size=10, color="#555555")
    panels = (
        (exact, "reference", "6 000 vertices, curved, carried"),
        (
            shown[CARRIED],
            f"isovary: error {errors[CARRIED]:.1%}",
            f"{counts[CARRIED]} vertices, curved, carried",
        ),
        (
            shown[THESIS],
            f"independent meshes: error {errors[THESIS]:.0%}",
            f"{counts[THESIS]} vertices, flat, rays onto the other mesh",
        ),
    )
    for column, (run, words, detail) in enumerate(panels):
        left = 0.02 + 0.205 * column
        axes = figure.add_axes((left, 0.235, 0.195, 0.49))
        _draw_surface(axes, figure, run, camera, limit, edges=column > 0)
        figure.text(left, 0.79, words, size=11, weight="bold", color="#1d1d1f")
        figure.text(left, 0.745, detail, size=8.5, color="#555555")
    words = "mean change of the heat kernel signature, % of its mean (above the end: yellow)"
    color_bar(figure, (0.12, 0.155, 0.38, 0.022), paint.NORM_MAP, (0, 100 * limit), words)
    _draw_errors(figure.add_axes((0.71, 0.165, 0.275, 0.63)), rows)
    figure.savefig(path)


def _draw_surface(
    axes: Axes, figure: Figure, run: Run, camera: Camera, limit: float, edges: bool
) -> None:
    axes.set_axis_off()
    width, height = figure.get_size_inches()
    box = axes.get_position()
    window = camera.window(box.width * width / (box.height * height))
    axes.set_xlim(window[0], window[1])
    axes.set_ylim(window[2], window[3])
    split = 8 if run.base.order == 2 or not edges else 4
    pieces = tessellate(run.base, split)
    norm = at_pieces(run.base, split, iv.change_norm(run.change))
    colors: Floats = paint.mapped(paint.NORM_MAP, np.minimum(norm / limit, 1.0))
    size = float(np.ptp(run.base.points, axis=0).max())
    lines = mesh_lines(run.base, camera, 0.005 * size) if edges else None
    if opengl_problem() is None:
        from isovary.view._render_vtk import draw
    else:
        from isovary.view._render_matplotlib import draw
    draw(axes, Scene(pieces, colors, lines), camera)


def _draw_errors(axes: Axes, rows: list[Row]) -> None:
    for way, (color, marker, line) in STYLES.items():
        mine = [row for row in rows if row.way == way]
        places = [row.vertices for row in mine], [row.error for row in mine]
        hollow = {"mfc": "white"} if marker == "^" else {}
        axes.loglog(*places, color=color, marker=marker, ls=line or "none", label=way, **hollow)
    axes.axhline(1.0, color="#888888", lw=1)
    axes.text(2400, 1.12, "as large as the change", size=8, color="#666666", ha="right")
    axes.set_title("error, relative to the change", size=11, loc="left", weight="bold")
    axes.set_xlabel("vertices of the base mesh")
    axes.set_xticks([400, 1000, 2000], ["400", "1 000", "2 000"])
    axes.minorticks_off()
    axes.set_yticks([1e-4, 1e-3, 1e-2, 1e-1, 1], ["0.01 %", "0.1 %", "1 %", "10 %", "100 %"])
    axes.set_ylim(4e-6, 5.0)
    axes.grid(color="#e4e4e4")
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(fontsize=7, frameon=False, loc="lower left", handlelength=3)
