"""Comparisons of a dented ball, and folders of them without the pictures."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import lru_cache, partial

import numpy as np
from pictures import ball, compare, dented, field, without_partners

from isovary.clustering import k_medians
from isovary.difference import change_norm
from isovary.groups import groups_above_noise
from isovary.io._results import _change_grid, _perturbed_grid, _summary
from isovary.io._writing import write_summary, write_vtk
from isovary.noise import SIGNIFICANCE


@lru_cache
def dented_ball():
    return compare(field(ball), field(dented), vertices=120, pairs=50, times=20, isometric=False)


def with_signature(signature):
    """The dented ball with another signature of the same eigenpairs."""
    result = dented_ball()
    methods = replace(result.methods, signature=signature)
    times = methods.kind.samples(result.base_pairs, 40)
    base = methods.signature(result.base_pairs, times)
    arrays = dict.fromkeys(("change", "unit_area_change", "noise_floor"), 0.1 * base)
    return replace(
        result,
        methods=methods,
        times=times,
        base_signature=base,
        perturbed_signature=methods.signature(result.perturbed_pairs, times),
        **arrays,
    )


@lru_cache
def half_lost():
    """The dented ball as if the nodes with x > 0.2 had found no partner."""
    result = dented_ball()
    return without_partners(result, result.base.points[:, 0] > 0.2)


@lru_cache
def noisy():
    """The dented ball with so much noise that half of its nodes are below it."""
    result = dented_ball()
    times = np.median(result.change_norm / change_norm(result.noise_floor)) / SIGNIFICANCE
    floor = times * result.noise_floor
    significant = result.change_norm > SIGNIFICANCE * change_norm(floor)
    method = partial(k_medians, rng=result.choices["seed"])
    clusters = groups_above_noise(result.change, 0 * floor, significant, 3, method)
    return replace(result, noise_floor=floor, significant=significant, clusters=clusters)


def folder_of(result, folder):
    """What :func:`isovary.io._results.save` writes, without pictures and report."""
    folder.mkdir(parents=True, exist_ok=True)
    write_vtk(_change_grid(result), folder / "change.vtu")
    write_vtk(_perturbed_grid(result), folder / "perturbed.vtu")
    write_summary(_summary(result), folder)
    return folder


def edit_summary(folder, edit):
    """Change the summary of a folder in place."""
    path = folder / "summary.json"
    summary = json.loads(path.read_text("utf-8"))
    edit(summary)
    path.write_text(json.dumps(summary), "utf-8")
