"""Fields, comparisons and checks that the tests of pictures share."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from matplotlib.text import Text

import isovary as iv
from isovary.records import Clusters, Correspondence

_BOX = ((-1.6, -1.6, -1.6), (1.6, 1.6, 1.6))


def field(function, name="density"):
    sampled = iv.ScalarField.from_function(function, bounds=_BOX, shape=(24, 24, 24))
    return replace(sampled, name=name)


def ball(p):
    return 1.0 - np.linalg.norm(p, axis=-1)


def dented(p):
    away = np.linalg.norm(p - np.array([0.0, 0.0, 1.0]), axis=-1)
    return ball(p) - 0.08 * np.exp(-((away / 0.5) ** 2))


def compare(base, perturbed, isovalue=0.0, **options):
    options = {"pairs": 80, "vertices": 200, "times": 30} | options
    return iv.compare(base, perturbed, isovalue, **options)


def texts(figure):
    """The texts that are really drawn (an axis also owns tick labels outside its limits)."""
    drawn = []
    draw = Text.draw

    def record(self, renderer):
        drawn.append(self)
        draw(self, renderer)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Text, "draw", record)
        figure.draw_without_rendering()
    return [text for text in drawn if text.get_text().strip()]


def words(figure):
    return "\n".join(t.get_text() for t in texts(figure))


def check_texts(figure):
    """All texts lie in the figure and apart from each other."""
    boxes = [(t.get_text(), t.get_window_extent()) for t in texts(figure)]
    for text, box in boxes:
        assert figure.bbox.x0 <= box.x0, text
        assert box.x1 <= figure.bbox.x1, text
        assert figure.bbox.y0 <= box.y0, text
        assert box.y1 <= figure.bbox.y1, text
    for (one, a), (two, b) in combinations(boxes, 2):
        wide = min(a.x1, b.x1) - max(a.x0, b.x0)
        high = min(a.y1, b.y1) - max(a.y0, b.y0)
        assert wide <= 1 or high <= 1, (one, two)


def without_partners(result, lost):
    """A comparison as if these nodes (mask (n,)) had found no partner."""
    old = result.correspondence
    partners = Correspondence(
        np.where(lost, -1, old.triangle),
        np.where(lost[:, None], np.nan, old.barycentric),
        np.where(lost, np.nan, old.distance),
        np.where(lost, 0, old.hits),
    )
    rows = {
        name: np.where(lost[:, None], np.nan, getattr(result, name))
        for name in ("change", "unit_area_change", "perturbed_signature", "noise_floor")
    }
    clusters = Clusters(np.where(lost, -1, result.clusters.labels), result.clusters.centers)
    return replace(
        result,
        correspondence=partners,
        significant=result.significant & ~lost,
        clusters=clusters,
        **rows,
    )
