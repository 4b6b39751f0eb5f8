"""Pictures of maps between surfaces: circles on the base and what they become, and the strain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import isovary as iv
from isovary.geometry import Floats
from isovary.view._camera import Camera, choose_camera
from isovary.view._marks import color_bar
from isovary.view._opengl import opengl_problem
from isovary.view._scene import Scene
from isovary.view._tessellate import tessellate

DARK, GREY = "#1d1d1f", "#555555"
SPOT, GROUND = (0.0, 0.27, 0.55), (0.93, 0.91, 0.86)
STRAIN_MAP = colormaps["inferno_r"]


@dataclass(frozen=True, eq=False)
class Shown:
    """A map: the base, where its nodes go (NaN: nowhere), and its strain; with words for it."""

    base: iv.Surface
    partners: Floats
    distortion: iv.Distortion
    words: str
    detail: str = ""


def draw_maps(
    shown: Sequence[Shown],
    title: str,
    said: str,
    path: Path,
    *,
    limit: float,
    height: float,
    spots: tuple[int, float],
    split: int,
    camera: Camera | None = None,
) -> None:
    """Circles on the base and under each map, in the upper row; the strain in the lower one.

    ``limit`` is the end of the strain's scale, ``spots`` the number of circles and their radius,
    ``split`` the pieces along an element's edge.
    """
    base = shown[0].base
    camera = camera or camera_for([base, *(image_of(one)[0] for one in shown)])
    circles = spotted(base, *spots, split)
    figure = Figure(figsize=(12.8, height), dpi=150, facecolor="white")
    down = 1 / height
    figure.text(0.02, 1 - 0.42 * down, title, size=15, weight="bold", color=DARK)
    figure.text(0.02, 1 - 0.70 * down, said, size=10, color=GREY)
    wide, gap = 0.96 / (len(shown) + 1), 0.01
    high = (1 - 1.75 * down) / 2
    upper, lower = 1 - 1.35 * down - high, 0.25 * down
    axes = figure.add_axes((0.02, upper, wide - gap, high))
    words(figure, 0.02, 1 - 1.02 * down, "base", "circles drawn on it", down)
    draw_surface(axes, base, circles, camera, split)
    for column, one in enumerate(shown, start=1):
        left = 0.02 + column * wide
        words(figure, left, 1 - 1.02 * down, one.words, one.detail, down)
        image, known = image_of(one)
        colors = circles.reshape(len(known), -1, 3)[known].reshape(-1, 3)
        axes = figure.add_axes((left, upper, wide - gap, high))
        draw_surface(axes, image, colors, camera, split)
        strain = np.repeat(one.distortion.size[known], split**2)
        axes = figure.add_axes((left, lower, wide - gap, high))
        painted = STRAIN_MAP(np.clip(strain / limit, 0, 1))[:, :3]
        draw_surface(axes, image, painted, camera, split)
    box = (0.035, lower + 0.5 * high, wide - 0.06, 0.13 * down)
    color_bar(
        figure, box, STRAIN_MAP, (0, 100 * limit), "largest change of a length, % (black: more)"
    )
    figure.text(
        0.035, lower + 0.66 * high, "strain of each map", size=11, weight="bold", color=DARK
    )
    figure.savefig(path)


def camera_for(surfaces: Sequence[iv.Surface]) -> Camera:
    """The view that shows most of all surfaces, in a window that holds them."""
    pieces = [tessellate(surface, 2) for surface in surfaces]
    middles, facing, areas = (
        np.concatenate([getattr(some, name) for some in pieces])
        for name in ("middles", "facing", "areas")
    )
    return choose_camera(middles, facing, areas, None)


def words(figure: Figure, left: float, top: float, text: str, detail: str, down: float) -> None:
    figure.text(left, top, text, size=11, weight="bold", color=DARK)
    figure.text(left, top - 0.2 * down, detail, size=8.5, color=GREY)


def spotted(base: iv.Surface, count: int, radius: float, split: int) -> Floats:
    """Colours of the base's pieces: circles around points that lie far from each other."""
    middles = tessellate(base, split).middles
    nodes = base.points[np.unique(base.corners)]
    centres = [int(np.linalg.norm(nodes - nodes.mean(axis=0), axis=1).argmax())]
    away = np.full(len(nodes), np.inf)
    for _ in range(count - 1):
        away = np.minimum(away, np.linalg.norm(nodes - nodes[centres[-1]], axis=1))
        centres.append(int(away.argmax()))
    gaps = np.min([np.linalg.norm(middles - nodes[c], axis=1) for c in centres], axis=0)
    colors: Floats = np.where(gaps[:, None] < radius, SPOT, GROUND)
    return colors


def image_of(one: Shown) -> tuple[iv.Surface, np.ndarray]:
    """The base's triangles that have an image, at their image; and which they are."""
    known = np.isfinite(one.partners[one.base.triangles]).all(axis=(1, 2))
    nodes, local = np.unique(one.base.triangles[known], return_inverse=True)
    return iv.Surface(one.partners[nodes], local.reshape(-1, one.base.triangles.shape[1])), known


def draw_surface(
    axes: Axes, surface: iv.Surface, colors: Floats, camera: Camera, split: int
) -> None:
    axes.set_axis_off()
    width, height = axes.get_figure().get_size_inches()
    box = axes.get_position()
    left, right, bottom, top = camera.window(box.width * width / (box.height * height))
    axes.set_xlim(left, right)
    axes.set_ylim(bottom, top)
    if opengl_problem() is None:
        from isovary.view._render_vtk import draw
    else:
        from isovary.view._render_matplotlib import draw
    draw(axes, Scene(tessellate(surface, split), colors), camera)
