"""Where does the time go?

The stages of a comparison at the defaults, and the eigensolve against SciPy's
shift-invert Lanczos on the same matrices in the same run, with the accuracy of
both beside it.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import numpy as np

import isovary as iv
from isovary.data import water_pair
from isovary.io._results import save


def density(stretch: float) -> iv.ScalarField:
    """A 64^3 field: three Gaussians, one of which moves."""
    centers = np.array([[0, 0, 0], [1.5, 0, 1.1], [-1.5 * stretch, 0, 1.1 * stretch]])
    widths, heights = (1.1, 0.7, 0.7), (1.0, 0.5, 0.5)

    def value(points: np.ndarray) -> np.ndarray:
        total = np.zeros(points.shape[:-1])
        for center, width, height in zip(centers, widths, heights, strict=True):
            total += height * np.exp(-(((points - center) / width) ** 2).sum(axis=-1))
        return total

    return iv.ScalarField.from_function(value, ((-6, -6, -6), (6, 6, 6)), (64, 64, 64))


def stages(base: iv.ScalarField, perturbed: iv.ScalarField, isovalue: float) -> dict[str, float]:
    start = time.perf_counter()
    result = iv.compare(base, perturbed, isovalue)
    timings = dict(result.timings)
    before = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        save(result, Path(folder) / "out")
    timings["files, picture, report"] = time.perf_counter() - before
    timings["total"] = time.perf_counter() - start
    return timings


def eigensolvers() -> list[str]:
    """Seconds and eigenvalue error of isovary and SciPy, 300 pairs of the curved sphere."""
    from scipy.sparse.linalg import eigsh

    shells = [[d * (d + 1)] * (2 * d + 1) for d in range(18)]
    exact = np.concatenate(shells)[1:300]
    lines = []
    for subdivisions in (3, 4):
        laplacian = iv.fem(iv.icosphere(subdivisions))
        start = time.perf_counter()
        ours = iv.eigenpairs(laplacian, 300).values
        middle = time.perf_counter()
        found = np.sort(eigsh(laplacian.stiffness, 300, laplacian.mass, sigma=-0.01)[0])
        end = time.perf_counter()
        errors = [np.median(np.abs(values[1:] / exact - 1)) for values in (ours, found)]
        ratio = (end - middle) / (middle - start)
        lines.append(
            f"| {laplacian.mass.shape[0]:,} | {middle - start:.1f} s, {errors[0]:.2e} | "
            f"{end - middle:.1f} s, {errors[1]:.2e} | {ratio:.1f} |"
        )
    return lines


def report() -> str:
    """Markdown: two tables."""
    demo = stages(*(iv.read_field(path) for path in water_pair()), 0.05)
    field = stages(density(1.0), density(1.03), 0.1)
    lines = [
        "## Time",
        "",
        "Seconds by stage at the defaults: the demo pair, and fields of 64^3 samples.",
        "",
        "| stage | demo | 64^3 |",
        "| --- | --- | --- |",
        *(f"| {name} | {seconds:.2f} | {field[name]:.2f} |" for name, seconds in demo.items()),
        "",
        "Eigensolve, 300 pairs of the curved sphere: seconds, and median error of the eigenvalues "
        "against l (l + 1). SciPy is `eigsh` with shift-invert and its defaults.",
        "",
        "| nodes | isovary | SciPy | ratio |",
        "| --- | --- | --- | --- |",
        *eigensolvers(),
    ]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    print(report())
