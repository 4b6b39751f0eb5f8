"""Colours whose differences mean something: of groups, of embedded rows, and of a family."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from .errors import ArgumentError
from .geometry import Floats, Ints

GROUP_COLORS = ("#56b4e9", "#e69f00", "#d55e00", "#009e73", "#cc79a7", "#0072b2", "#f0e442")
"""Of the first groups: Okabe and Ito (2008), seen apart by colour-blind readers."""

NEUTRAL = "#d5d5d5"
"""No significant change, no group."""

UNKNOWN = "#6b6b6b"
"""Nothing known."""

Deficiency = Literal["protan", "deutan", "tritan"]
"""The cones that are missing: those for long, for middle or for short waves."""

_TO_CONES = np.array(
    [
        [0.4122214708, 0.5363325363, 0.0514459929],
        [0.2119034982, 0.6806995451, 0.1073969566],
        [0.0883024619, 0.2817188376, 0.6299787005],
    ]
)
_TO_LAB = np.array(
    [
        [0.2104542553, 0.7936177850, -0.0040720468],
        [1.9779984951, -2.4285922050, 0.4505937099],
        [0.0259040371, 0.7827717662, -0.8086757660],
    ]
)
_DEFICIENT = {
    "protan": np.array(
        [
            [0.152286, 1.052583, -0.204868],
            [0.114503, 0.786281, 0.099216],
            [-0.003882, -0.048116, 1.051998],
        ]
    ),
    "deutan": np.array(
        [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.011820, 0.042940, 0.968881],
        ]
    ),
    "tritan": np.array(
        [
            [1.255528, -0.076749, -0.178779],
            [-0.078411, 0.930809, 0.147602],
            [0.004733, 0.691367, 0.303900],
        ]
    ),
}
_LEGIBLE = (0.45, 0.85)  # lightness: lines are seen on it, and it is seen on white
_STEPS_OF_GRID = 18  # of each of red, green and blue, among which further colours are sought


def srgb_to_oklab(rgb: ArrayLike) -> Floats:
    """Lightness and two opponent colours, in which equal distances look equally different.

    Linear light c = ((s + 0.055) / 1.055)^2.4, or s / 12.92 up to 0.04045; cones = M1 c;
    lab = M2 cbrt(cones). Values outside the gamut are taken with their sign.

    Parameters
    ----------
    rgb : array (..., 3)
        sRGB, 0 to 1.

    Returns
    -------
    array (..., 3)
        L from 0 (black) to 1 (white); a from green to red; b from blue to yellow. A distance
        of 0.02 is just noticeable.

    Raises
    ------
    ArgumentError
        A03 if the last axis has not three entries.

    References
    ----------
    B. Ottosson, *A perceptual color space for image processing* (2020),
    https://bottosson.github.io/posts/oklab/. IEC 61966-2-1 for sRGB.

    Examples
    --------
    White is light and without colour:

    >>> (srgb_to_oklab([1.0, 1.0, 1.0]).round(6) + 0.0).tolist()
    [1.0, 0.0, 0.0]
    """
    return _lab(_linear(_colors(rgb, "rgb")))


def oklab_to_srgb(lab: ArrayLike) -> Floats:
    """The inverse of :func:`srgb_to_oklab`; nothing is clipped.

    Parameters
    ----------
    lab : array (..., 3)
        L, a and b.

    Returns
    -------
    array (..., 3)
        sRGB; below 0 or above 1 where a screen cannot show the colour.

    Raises
    ------
    ArgumentError
        A03 if the last axis has not three entries.

    References
    ----------
    As :func:`srgb_to_oklab`; the matrices are inverted, not those printed with fewer digits.

    Examples
    --------
    Without colour and at L = 0.5 the light is 0.5^3 = 0.125, and 1.055 * 0.125^(1/2.4) - 0.055
    = 0.3886:

    >>> oklab_to_srgb([0.5, 0.0, 0.0]).round(4).tolist()
    [0.3886, 0.3886, 0.3886]
    """
    cones = (_colors(lab, "lab") @ np.linalg.inv(_TO_LAB).T) ** 3
    light = cones @ np.linalg.inv(_TO_CONES).T
    size = np.abs(light)
    curved = 1.055 * size ** (1 / 2.4) - 0.055
    rgb: Floats = np.sign(light) * np.where(size <= 0.0031308, 12.92 * size, curved)
    return rgb


def color_blind(rgb: ArrayLike, deficiency: Deficiency) -> Floats:
    """Colours as a reader without one kind of cones sees them.

    Parameters
    ----------
    rgb : array (..., 3)
        sRGB, 0 to 1.
    deficiency : {"protan", "deutan", "tritan"}
        The cones that are missing.

    Returns
    -------
    array (..., 3)
        sRGB, 0 to 1.

    Raises
    ------
    ArgumentError
        A02 for an unknown deficiency, A03 if the last axis has not three entries.

    References
    ----------
    G. M. Machado, M. M. Oliveira, L. A. F. Fernandes, *A physiologically-based model for
    simulation of color vision deficiency*, IEEE TVCG 15 (2009) 1291-1298, severity 1, on
    linear light.

    Examples
    --------
    White stays white:

    >>> color_blind([1.0, 1.0, 1.0], "deutan").round(5).tolist()
    [1.0, 1.0, 1.0]
    """
    if deficiency not in get_args(Deficiency):
        raise ArgumentError(
            "A02", f"deficiency: expected one of {get_args(Deficiency)}, got {deficiency}"
        )
    light = np.clip(_linear(_colors(rgb, "rgb")) @ _DEFICIENT[deficiency].T, 0.0, 1.0)
    return np.clip(oklab_to_srgb(_lab(light)), 0.0, 1.0)


def embedding_colors(
    points: ArrayLike, *, clipped: float = 0.01, unknown: ArrayLike | str = UNKNOWN
) -> Floats:
    """Colours as far apart as the points of an embedding.

    The first axis goes from green to red, the second from blue to yellow, the third is
    lightness. The middle of the points becomes a grey of lightness 0.65 and ONE factor scales all
    three axes, the largest with which every colour can be shown and lightness stays in 0.45 to
    0.85. So distances in OKLab are in proportion to distances in the embedding, save for the
    share of the points at the ends of each axis that are moved to where the others end.

    Parameters
    ----------
    points : array (n, 3)
        For example from :func:`classical_mds`; NaN where unknown.
    clipped : float
        Share of the known points, at each end of each axis, that is moved to the end of the
        others, so that a few do not make all others alike; 0 moves none.
    unknown : array (3,) or str
        Colour of points with NaN: sRGB or a hexadecimal text.

    Returns
    -------
    array (n, 3)
        sRGB, 0 to 1.

    Raises
    ------
    ArgumentError
        A02 for a share that is not in [0, 0.5), A03 for points that are not (n, 3) or a colour
        that is not one.

    Notes
    -----
    Cost: 50 conversions of all colours.

    Examples
    --------
    The first axis alone: colours differ in red against green, in the middle is the grey of
    L = 0.65:

    >>> colors = embedding_colors([[-1.0, 0, 0], [0, 0, 0], [1, 0, 0]], clipped=0)
    >>> (srgb_to_oklab(colors[1]).round(4) + 0.0).tolist(), bool(colors[2, 0] > colors[0, 0])
    ([0.65, 0.0, 0.0], True)
    """
    values = np.asarray(points, dtype=float)
    if values.ndim != 2 or values.shape[1] != 3:
        raise ArgumentError("A03", f"points: expected shape (n, 3), got {values.shape}")
    if not 0 <= clipped < 0.5:
        raise ArgumentError("A02", f"clipped: expected a share in [0, 0.5), got {clipped}")
    known = np.isfinite(values).all(axis=1)
    grey = _rgb(unknown) if isinstance(unknown, str) else np.asarray(unknown, dtype=float)
    if grey.shape != (3,):
        raise ArgumentError("A03", f"unknown: expected shape (3,), got {grey.shape}")
    result = np.tile(grey, (len(values), 1))
    if known.any():
        result[known] = _shown(_centred(values[known], clipped))
    return result


def _centred(points: Floats, clipped: float) -> Floats:
    """Points around the middle of their axes, the ends clipped unless nothing would be left."""
    low, high = np.quantile(points, [clipped, 1 - clipped], axis=0)
    if (low == high).all():
        low, high = points.min(axis=0), points.max(axis=0)
    centred: Floats = np.clip(points, low, high) - (low + high) / 2
    return centred


def _shown(centred: Floats) -> Floats:
    """Colours of points, scaled by the largest factor at which all can be shown."""
    directions = centred[:, [2, 0, 1]]
    grey = np.array([sum(_LEGIBLE) / 2, 0.0, 0.0])
    size = np.abs(directions).max()
    if size == 0:
        return np.clip(oklab_to_srgb(grey + directions), 0.0, 1.0)
    low, high = 0.0, 0.5 / size
    for _ in range(50):
        factor = (low + high) / 2
        low, high = (factor, high) if _fits(grey + factor * directions) else (low, factor)
    return np.clip(oklab_to_srgb(grey + low * directions), 0.0, 1.0)


def _fits(lab: Floats) -> bool:
    rgb = oklab_to_srgb(lab)
    legible = _LEGIBLE[0] <= lab[:, 0].min() and lab[:, 0].max() <= _LEGIBLE[1]
    return bool(legible and rgb.min() >= 0 and rgb.max() <= 1)


def group_colors(count: int) -> Floats:
    """A colour for each group; the first ones are the same however many there are.

    The first seven are :data:`GROUP_COLORS`. Each further one is, among colours of lightness
    0.35 to 0.93, the one that differs most from the nearest of those before and of the greys
    of pictures, as seen by readers with all cones and with any kind missing.

    Parameters
    ----------
    count : int
        Number of groups.

    Returns
    -------
    array (count, 3)
        sRGB, 0 to 1.

    Raises
    ------
    ArgumentError
        A02 for a negative count.

    Notes
    -----
    Distances in OKLab stay above 0.06 up to 19 groups; more are hard to tell apart.

    References
    ----------
    M. Okabe, K. Ito, *Color universal design* (2008), https://jfly.uni-koeln.de/color/.

    Examples
    --------
    The first is #56b4e9, and 0x56 / 255 = 0.337:

    >>> group_colors(1).round(3).tolist()
    [[0.337, 0.706, 0.914]]
    """
    if count < 0:
        raise ArgumentError("A02", f"count: expected 0 or more, got {count}")
    first = np.array([_rgb(text) for text in GROUP_COLORS])
    if count <= len(first):
        return first[:count]
    return np.vstack([first, _further_colors(count - len(first))])


@lru_cache
def _further_colors(count: int) -> Floats:
    """Colours (count, 3), each the farthest from all before it."""
    steps = np.linspace(0.0, 1.0, _STEPS_OF_GRID)
    grid = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    lightness = srgb_to_oklab(grid)[:, 0]
    grid = grid[(lightness > 0.35) & (lightness < 0.93)]
    taken = np.array([_rgb(text) for text in (*GROUP_COLORS, NEUTRAL, UNKNOWN)])
    views = _views(grid)
    nearest = np.min([_gap(views, view) for view in np.moveaxis(_views(taken), 1, 0)], axis=0)
    chosen = []
    for _ in range(count):
        best = int(nearest.argmax())
        chosen.append(grid[best])
        nearest = np.minimum(nearest, _gap(views, views[:, best]))
    return np.array(chosen)


def _views(rgb: Floats) -> Floats:
    """Colours (m, 3) in OKLab as seen with all cones and with each kind missing (4, m, 3)."""
    seen = [rgb, *(color_blind(rgb, kind) for kind in get_args(Deficiency))]
    return np.stack([srgb_to_oklab(colors) for colors in seen])


def _gap(views: Floats, view: Floats) -> Floats:
    """Smallest distance (m,), over the kinds of readers, of colours (4, m, 3) to one (4, 3)."""
    gaps: Floats = np.linalg.norm(views - view[:, None], axis=2).min(axis=0)
    return gaps


def nested_order(coarse: ArrayLike, fine: ArrayLike, *, weights: ArrayLike | None = None) -> Ints:
    """Which group of one grouping each group of another continues.

    The pair of groups with the largest common weight is matched first, then the largest of the
    rest, and so on. So two groups that hold more than half of each other are always matched.

    Parameters
    ----------
    coarse, fine : array (n,)
        Group of each row from 0; -1 = unknown.
    weights : array (n,), optional
        Positive, such as the area of each node. Default: all alike.

    Returns
    -------
    array (k,)
        For each group of ``fine`` a group of ``coarse``, none twice; -1 for a newcomer.

    Raises
    ------
    ArgumentError
        A02 for weights that are not positive, A03 for arrays that are not (n,).

    Examples
    --------
    Group 0 loses a row to the new group 0 and is called 1 from then on:

    >>> nested_order([0, 0, 0, 1, 1], [1, 1, 0, 2, 2]).tolist()
    [-1, 0, 1]
    """
    old, new, heavy = _labels(coarse, "coarse"), _labels(fine, "fine"), weights
    heavy = np.ones(len(old)) if heavy is None else np.asarray(heavy, dtype=float)
    if old.shape != new.shape or heavy.shape != old.shape:
        raise ArgumentError(
            "A03",
            "coarse, fine, weights: expected equal shapes, got "
            f"{old.shape}, {new.shape} and {heavy.shape}",
        )
    if not (np.isfinite(heavy) & (heavy > 0)).all():
        raise ArgumentError(
            "A02", "weights: expected positive numbers, got others; give areas, for example"
        )
    common = np.zeros((_count(new), _count(old)))
    both = (old >= 0) & (new >= 0)
    np.add.at(common, (new[both], old[both]), heavy[both])
    follows = np.full(len(common), -1, dtype=np.int64)
    while common.size and common.max() > 0:
        here, there = np.unravel_index(common.argmax(), common.shape)
        follows[here] = there
        common[here], common[:, there] = 0.0, 0.0
    return follows


def nested_colors(
    groupings: Sequence[ArrayLike], *, weights: ArrayLike | None = None
) -> list[Floats]:
    """Colours for groupings of the same rows, such as into more and more groups.

    The first gets :func:`group_colors`. From each to the next, a group that continues one (see
    :func:`nested_order`) keeps its colour; a newcomer gets the first colour that neither its own
    nor the grouping before it has.

    Parameters
    ----------
    groupings : sequence of arrays (n,)
        Group of each row from 0; -1 = unknown.
    weights : array (n,), optional
        Positive, such as the area of each node. Default: all alike.

    Returns
    -------
    list of arrays (k, 3)
        sRGB of the groups of each grouping, 0 to 1.

    Raises
    ------
    ArgumentError
        A02 for weights that are not positive, A03 for arrays that are not (n,).

    Examples
    --------
    The second group splits; its larger part keeps its colour, the other gets the third one:

    >>> two, three = nested_colors([[0, 0, 1, 1, 1], [0, 0, 1, 2, 2]])
    >>> bool((three[[0, 2]] == two).all()), bool((three[1] == group_colors(3)[2]).all())
    (True, True)
    """
    places: list[list[int]] = []
    for number, labels in enumerate(groupings):
        if number == 0:
            places.append(list(range(_count(_labels(labels, "groupings")))))
            continue
        follows = nested_order(groupings[number - 1], labels, weights=weights)
        places.append(_continued(places[-1], follows))
    palette = group_colors(1 + max((place for each in places for place in each), default=-1))
    return [palette[np.array(each, dtype=np.int64)] for each in places]


def _continued(before: list[int], follows: Ints) -> list[int]:
    """Place in the palette of each group, from those of the groups that they continue."""
    free = set(range(len(before) + len(follows))) - set(before)
    fresh = iter(sorted(free))
    return [before[old] if old >= 0 else next(fresh) for old in follows]


def _labels(labels: ArrayLike, name: str) -> Ints:
    found = np.asarray(labels)
    if found.ndim != 1 or (found.size and found.dtype.kind not in "iu"):
        raise ArgumentError(
            "A03", f"{name}: expected whole numbers of shape (n,), got {found.dtype} {found.shape}"
        )
    return found.astype(np.int64)


def _count(labels: Ints) -> int:
    return 1 + int(labels.max(initial=-1))


def _rgb(text: str) -> Floats:
    """SRGB of a hexadecimal text such as #56b4e9."""
    try:
        red, green, blue = bytes.fromhex(text.removeprefix("#"))
    except ValueError as error:
        raise ArgumentError("A03", f"colour: expected a text like #6b6b6b, got {text}") from error
    return np.array([red, green, blue]) / 255


def _colors(values: ArrayLike, name: str) -> Floats:
    colors = np.asarray(values, dtype=float)
    if colors.shape[-1:] != (3,):
        raise ArgumentError("A03", f"{name}: expected shape (..., 3), got {colors.shape}")
    return colors


def _linear(rgb: Floats) -> Floats:
    size = np.abs(rgb)
    light: Floats = np.sign(rgb) * np.where(
        size <= 0.04045, size / 12.92, ((size + 0.055) / 1.055) ** 2.4
    )
    return light


def _lab(light: Floats) -> Floats:
    lab: Floats = np.cbrt(light @ _TO_CONES.T) @ _TO_LAB.T
    return lab
