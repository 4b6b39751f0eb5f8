"""The report's plots: the surface that can be turned, and the curves."""

from __future__ import annotations

from typing import Any

import numpy as np
import plotly.graph_objects as go
from matplotlib.colors import to_hex
from plotly.subplots import make_subplots

from ..color import group_colors
from ..comparison import Comparison
from ..geometry import Floats, linear_triangles
from ..signature import diffusion_radius
from . import _paint as paint
from ._camera import Camera
from ._curves import BASE_COLOR, NOISE_COLOR, PERTURBED_COLOR, curves_at, diffusion_time
from ._tessellate import outside

_FONT = {"family": 'system-ui, "Segoe UI", Roboto, "DejaVu Sans", Arial, sans-serif', "size": 13}
_ZOOM = 1.45


def surface_figure(result: Comparison, camera: Camera, marked: int | None) -> go.Figure:
    """The base surface and the marked point's ring, in a box that holds both surfaces."""
    x, y, z = result.base.points.astype(np.float32).T
    size = np.uint16 if len(x) <= 65_536 else np.int32
    i, j, k = linear_triangles(result.base.triangles).astype(size).T
    light = {"ambient": 0.75, "diffuse": 0.32, "specular": 0.05, "fresnel": 0.0, "roughness": 0.9}
    figure = go.Figure()
    figure.add_mesh3d(
        x=x,
        y=y,
        z=z,
        i=i,
        j=j,
        k=k,
        hoverinfo="text",
        lighting=light,
        # plotly's normals point inwards: this lamp is at the viewer.
        lightposition=dict(zip("xyz", (-1e5 * camera.axes[2]).tolist(), strict=True)),
    )
    x, y, z = (np.full((1, 3), np.nan) if marked is None else _ring(result, marked)).T
    line = {"color": "black", "width": 6}
    figure.add_scatter3d(x=x, y=y, z=z, mode="lines", line=line, hoverinfo="skip")
    figure.update_layout(
        template="none",
        font=_FONT,
        margin={"l": 0, "r": 0, "t": 0, "b": 0},
        showlegend=False,
        scene={
            "camera": _eye(camera),
            **_box(np.concatenate([result.base.points, result.perturbed.points])),
        },
        hoverlabel={"align": "left", "bgcolor": "white", "font": {"color": "#1b1f24"}},
    )
    return figure


def _ring(result: Comparison, node: int) -> Floats:
    """A circle around a node in its tangent plane, a little off the surface (k, 3)."""
    size = float(np.ptp(result.base.points, axis=0).max())
    normal = outside(result.base) * result.base.normals[node]
    first = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    first /= np.linalg.norm(first)
    turn = np.linspace(0, 2 * np.pi, 49)[:, None]
    circle = np.cos(turn) * first + np.sin(turn) * np.cross(normal, first)
    ring: Floats = result.base.points[node] + size * (0.006 * normal + 0.03 * circle)
    return ring


def _box(points: Floats) -> dict[str, Any]:
    """Axes with equal lengths that fill the window."""
    low, high = points.min(axis=0), points.max(axis=0)
    pad = 0.03 * (high - low).max()
    sides = high - low + 2 * pad
    ratio = _ZOOM * sides / np.prod(sides) ** (1 / 3)
    axis = {"showbackground": False, "gridcolor": "#e3e7eb", "zeroline": False, "showspikes": False}
    box: dict[str, Any] = {"aspectmode": "manual"}
    box["aspectratio"] = dict(zip("xyz", ratio.tolist(), strict=True))
    for name, first, last in zip("xyz", low - pad, high + pad, strict=True):
        box[f"{name}axis"] = {**axis, "title": {"text": name}, "range": [first, last]}
    return box


def _eye(camera: Camera) -> dict[str, Any]:
    _, up, towards = camera.axes
    return {
        "eye": dict(zip("xyz", (1.5 * towards).tolist(), strict=True)),
        "up": dict(zip("xyz", up.tolist(), strict=True)),
        "projection": {"type": "orthographic"},
    }


def heat_figure(result: Comparison) -> go.Figure:
    """The median change of each group, at each column: at which scale it changed."""
    groups = result.clusters.labels
    ranked = sorted(result.group_table, key=lambda group: group.rank)
    shown = [group.number for group in ranked]
    rows = [100 * np.nanmedian(result.change[groups == g], axis=0) for g in shown]
    values = np.array(rows).reshape(len(shown), len(result.columns))
    limit = float(np.abs(values).max(initial=0.0)) or 1.0
    kind = result.methods.kind
    radii = kind.per_time
    figure = go.Figure()
    figure.add_heatmap(
        x=_short(diffusion_radius(result.columns) if radii else result.columns),
        y=[f"group {g}" for g in shown],
        z=_short(values),
        zmin=-limit,
        zmax=limit,
        colorscale=[[k / 16, to_hex(paint.MOVE_MAP(k / 16))] for k in range(17)],
        colorbar={"title": {"text": "change (%)"}, "thickness": 14},
        hovertemplate="%{y}, %{x:.3g}: %{z:.3g} %<extra></extra>",
    )
    figure.update_xaxes(title_text="diffusion radius 2√t (length)" if radii else kind.axis)
    if kind.logarithmic:
        ticks = diffusion_radius(result.columns) if radii else result.columns
        figure.update_xaxes(type="log", tickvals=_ticks(ticks))
    figure.update_yaxes(autorange="reversed")
    margin = {"l": 80, "r": 20, "t": 20, "b": 55}
    return figure.update_layout(template="none", font=_FONT, margin=margin)


def curves_figure(result: Comparison, marked: int | None) -> go.Figure:
    """Signatures above, scaled change below: of the marked point and of the groups' medians."""
    curves, columns = curves_at(result, marked), result.columns
    at = "marked point" if marked is not None else "median of all nodes"
    figure = make_subplots(rows=2, cols=1, shared_xaxes=True, vertical_spacing=0.06)

    def add(row: int, values: Floats, name: str, line: dict[str, Any], legend: bool) -> None:
        hover = "%{x:.3g}: %{y:.4g}" + (" %" if row == 2 else "")
        figure.add_scatter(
            x=_short(columns),
            y=_short(values),
            name=name,
            line=line,
            mode="lines",
            legendgroup=name,
            showlegend=legend,
            hovertemplate=hover,
            row=row,
            col=1,
        )

    _noise_band(figure, columns, 100 * curves.noise)
    if result.methods.kind.per_time:
        _radius_axis(figure, columns)
    groups = paint.node_samples(result).groups
    for group, color in enumerate(group_colors(len(result.clusters.centers))):
        rows = groups == group
        if rows.any():
            line, name = {"color": to_hex(color), "width": 1.6}, f"group {group}, median"
            add(1, np.nanmedian(result.base_signature[rows], axis=0), name, line, True)
            add(2, 100 * np.nanmedian(result.change[rows], axis=0), name, line, False)
    add(1, curves.base, f"{at}: base", {"color": BASE_COLOR, "width": 2.6}, True)
    dashed = {"color": PERTURBED_COLOR, "width": 2, "dash": "dash"}
    add(1, curves.perturbed, f"{at}: perturbed", dashed, True)
    change = {"color": BASE_COLOR, "width": 2.6, "dash": "dot"}
    add(2, 100 * curves.change, f"{at}: base − perturbed", change, True)
    return _styled(figure, result)


def _radius_axis(figure: go.Figure, times: Floats) -> None:
    """The times as lengths above the upper panel."""
    radii = _ticks(diffusion_radius(times))
    nothing = {"x": _short(times[[0, -1]]), "y": [None, None], "hoverinfo": "skip"}
    figure.add_scatter(**nothing, xaxis="x3", yaxis="y", showlegend=False, mode="lines")
    figure.update_layout(
        xaxis3={
            "overlaying": "x",
            "matches": "x",
            "side": "top",
            "anchor": "y",
            "type": "log",
            "tickvals": diffusion_time(np.array(radii)).tolist(),
            "ticktext": [f"{radius:g}" for radius in radii],
            "ticks": "outside",
            "linecolor": "#59636e",
            "showgrid": False,
            "title": {"text": "diffusion radius 2√t (length)"},
        }
    )


def _noise_band(figure: go.Figure, columns: Floats, noise: Floats) -> None:
    known = np.nan_to_num(noise)
    figure.add_scatter(
        x=_short(np.concatenate([columns, columns[::-1]])),
        y=_short(np.concatenate([known, -known[::-1]])),
        name="noise floor",
        fill="toself",
        fillcolor=NOISE_COLOR,
        line={"width": 0},
        mode="lines",
        hoverinfo="skip",
        row=2,
        col=1,
    )


def _styled(figure: go.Figure, result: Comparison) -> go.Figure:
    axis = {"gridcolor": "#e9edf0", "linecolor": "#59636e", "ticks": "outside", "zeroline": False}
    axis["exponentformat"] = "power"
    kind = result.methods.kind
    name = kind.abbreviation
    for row in (1, 2):
        figure.update_xaxes(**axis, row=row, col=1)
        if kind.logarithmic:
            figure.update_xaxes(type="log", tickvals=_ticks(result.columns), row=row, col=1)
    figure.update_yaxes(**axis)
    figure.update_yaxes(title_text=f"{name} ({kind.unit})", row=1)
    typical = np.nanmedian(result.base_signature, axis=0)
    if np.nanmin(result.base_signature) >= 0 and (typical > 0).all():  # 0 on a Dirichlet rim only
        high = result.base_signature[np.isfinite(result.base_signature)].max()
        figure.update_yaxes(type="log", tickvals=_ticks(np.append(typical, high)), row=1)
    figure.update_yaxes(title_text=f"scaled change (% of mean {name})", row=2)
    figure.update_xaxes(title_text=kind.axis, row=2)
    figure.update_layout(
        template="none",
        font=_FONT,
        margin={"l": 80, "r": 20, "t": 55 if kind.per_time else 20, "b": 55},
        legend={"orientation": "h", "y": -0.13, "yanchor": "top"},
        hovermode="closest",
    )
    return figure


def _ticks(values: Floats) -> list[float]:
    """1, 2, 5 times the powers of ten within the values; the powers alone if they are many."""
    low, high = float(values.min()), float(values.max())
    powers = range(int(np.floor(np.log10(low))), int(np.ceil(np.log10(high))))
    factors = (1, 2, 5) if len(powers) <= 4 else (1,)
    ticks = [factor * 10.0**power for power in powers for factor in factors]
    return [float(f"{tick:g}") for tick in ticks if low <= tick <= high]


def _short(values: Floats) -> Floats:
    """Rounded to single precision, to keep the page small."""
    return values.astype(np.float32)
