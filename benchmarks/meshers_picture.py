"""The pictures of docs/meshing.md: the meshes side by side, and the signature's error on them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter, NullLocator

import isovary as iv
from isovary.geometry import Floats, triangle_quality
from isovary.view._camera import Camera
from isovary.view._marks import color_bar
from isovary.view._opengl import opengl_problem
from isovary.view._scene import Scene, mesh_lines
from isovary.view._tessellate import tessellate

if TYPE_CHECKING:
    from meshers import Row, Way

INK, SOFT = "#1d1d1f", "#555555"
COLORS = ListedColormap(colormaps["YlOrBr_r"](np.linspace(0.15, 1.0, 256)))
SHOWN = {
    "raw marching cubes": "raw marching cubes",
    "particles, uniform": "particles, uniform",
    "particles, curvature": "particles, curvature-sensitive",
    "marching_cubes, uniform": "marching_cubes, uniform",
    "marching_cubes, curvature": "marching_cubes, curvature-sensitive",
    "marching_cubes, nonuniform": "marching_cubes, nonuniform (curvature-blind)",
    "distmesh, uniform": "distmesh, uniform",
    "distmesh, curvature": "distmesh, curvature-sensitive",
    "distmesh, nonuniform": "distmesh, nonuniform (curvature-blind)",
}


def draw_meshes(ways: Sequence[Way], mesh: Callable[[Way], iv.Surface], path: Path) -> None:
    """Nine meshes of the spheroid, seen from the same place, coloured by triangle quality."""
    figure = Figure(figsize=(12.8, 10.4), dpi=115, facecolor="white")
    title = (
        "Raw marching cubes leaves slivers; the other meshers leave none, however edges are sized"
    )
    figure.text(0.02, 0.96, title, size=15, weight="bold", color=INK)
    words = "The ellipsoid 1 : 1 : 2 with about 1 000 vertices, meshed in nine ways"
    figure.text(0.02, 0.936, words, size=10, color=SOFT)
    chosen = [way for name in SHOWN for way in ways if way.name == name]
    for place, way in enumerate(chosen):
        row, column = divmod(place, 3)
        left, bottom = 0.015 + 0.33 * column, 0.69 - 0.285 * row
        axes = figure.add_axes((left, bottom, 0.31, 0.228))
        surface = mesh(way)
        quality = triangle_quality(surface.points, surface.corners)
        _draw_surface(axes, figure, surface, quality)
        figure.text(left + 0.155, bottom - 0.016, SHOWN[way.name], ha="center", size=11, color=INK)
        words = (
            f"{len(surface.points):,} vertices; quality: mean {quality.mean():.2f}, "
            f"smallest {quality.min():.2g}"
        )
        figure.text(left + 0.155, bottom - 0.036, words, ha="center", size=9, color=SOFT)
    label = "quality of a triangle: 1 equilateral, 0 a sliver"
    color_bar(figure, (0.33, 0.05, 0.34, 0.013), COLORS, (0.0, 1.0), label)
    figure.savefig(path)


def _draw_surface(axes: Axes, figure: Figure, surface: iv.Surface, quality: Floats) -> None:
    axes.set_axis_off()
    camera = _camera(surface.points)
    width, height = figure.get_size_inches()
    box = axes.get_position()
    window = camera.window(box.width * width / (box.height * height), margin=0.02)
    axes.set_xlim(window[0], window[1])
    axes.set_ylim(window[2], window[3])
    colors = np.asarray(COLORS(quality))[:, :3]
    lines = mesh_lines(surface, camera, 0.004 * float(np.ptp(surface.points[:, 2])), split=1)
    if opengl_problem() is None:
        from isovary.view._render_vtk import draw
    else:
        from isovary.view._render_matplotlib import draw
    draw(axes, Scene(tessellate(surface, 1), colors, lines), camera)


def _camera(points: Floats) -> Camera:
    """The long axis, z, lies flat, and one pole is turned towards the viewer."""
    towards = np.array([0.75, 0.35, 0.55]) / np.linalg.norm([0.75, 0.35, 0.55])
    right = np.array([0.0, 0.0, 1.0]) - towards[2] * towards
    right /= np.linalg.norm(right)
    axes = np.array([right, np.cross(towards, right), towards])
    inside = points @ axes.T
    return Camera(axes, inside.min(axis=0), inside.max(axis=0))


def draw_errors(rows: Sequence[Row], path: Path) -> None:
    """Error against nodes, and over that of the default mesher; a column an order."""
    figure = Figure(figsize=(12.8, 8.2), dpi=130, facecolor="white")
    figure.text(0.02, 0.955, headline(rows), size=13, weight="bold", color=INK)
    figure.text(
        0.02,
        0.925,
        "Error of the heat kernel signature on the spheroid 1 : 1 : 2, root mean square over the "
        "surface and 100 times, at equal numbers of nodes",
        size=10,
        color=SOFT,
    )
    axes = figure.subplots(2, 2, sharex=True, sharey="row")
    figure.subplots_adjust(left=0.075, right=0.79, top=0.87, bottom=0.07, wspace=0.08, hspace=0.16)
    titles = {1: "flat triangles, linear elements", 2: "curved triangles, quadratic elements"}
    for column, order in enumerate((1, 2)):
        own = [row for row in rows if row.order == order and not row.fault]
        _lines(axes[0, column], own, relative=False)
        _lines(axes[1, column], own, relative=True)
        axes[0, column].set_title(titles[order], loc="left", size=11)
        axes[1, column].set_xlabel("nodes")
    axes[0, 0].set_ylabel("relative error of the signature")
    axes[1, 0].set_ylabel("the same, over that of marching_cubes, uniform")
    axes[1, 0].set_yticks([0.8, 1, 1.5, 2, 3, 4], ["0.8", "1", "1.5", "2", "3", "4"])
    for axis in axes[1]:
        axis.yaxis.set_minor_locator(NullLocator())
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(
        handles,
        labels,
        frameon=False,
        loc="center left",
        bbox_to_anchor=(0.8, 0.5),
        fontsize=9,
        handlelength=3.5,
    )
    figure.savefig(path)


def headline(rows: Sequence[Row]) -> str:
    """What the meshes are good for, in one sentence, from the geometric means over the sizes."""
    from meshers import by_way, ratio

    found = {order: by_way(rows, rows[0].shape, order) for order in (1, 2)}

    def spread(pairs: list[tuple[str, str]], orders: Sequence[int]) -> str:
        means = [
            ratio(found[order][name], found[order][other], "nodes")
            for name, other in pairs
            for order in orders
        ]
        return f"{min(means):.1f} to {max(means):.1f}"

    names = [name for name in found[1] if name.endswith(", curvature")]
    curved = spread([(name, name.replace("curvature", "uniform")) for name in names], (1, 2))
    raw = spread([("raw, nodes on the surface", "marching_cubes, uniform")], (1, 2))
    return (
        f"Even edges err least: by curvature {curved} times as much with the same mesher, raw "
        f"marching cubes {raw}"
    )


def _lines(axes: Axes, rows: Sequence[Row], relative: bool) -> None:
    default = [row for row in rows if row.way.name == "marching_cubes, uniform"]
    nodes, errors = ([getattr(row, name) for row in default] for name in ("nodes", "rms"))
    slope = np.polyfit(np.log(nodes), np.log(errors), 1)[0]
    for way in dict.fromkeys(row.way for row in rows):
        own = [row for row in rows if row.way is way]
        x = [row.nodes for row in own]
        y = [row.rms for row in own]
        if relative:
            base = np.interp(np.log(x), np.log(nodes), np.log(errors))
            outside = np.log(x) - np.clip(np.log(x), np.log(nodes[0]), np.log(nodes[-1]))
            y = list(np.exp(np.log(y) - base - slope * outside))
        color, marker, line = way.style
        axes.loglog(x, y, color=color, marker=marker, ls=line, lw=1.6, ms=6, label=way.name)
    axes.grid(True, which="major", color="#e6e6e6", lw=0.6)
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_xticks([1000, 3000, 12000], ["1 000", "3 000", "12 000"])
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.xaxis.set_minor_locator(NullLocator())
