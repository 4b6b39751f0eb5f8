"""Is any copy of a repeated eigenvalue lost?

Symmetric shapes repeat their eigenvalues, and a Krylov solver can miss a copy
without a word. A thousand eigensolves, 10 to 300 pairs each, of shapes with 162
to 2 906 nodes, against LAPACK's dense solution of the same matrices: a solve is
complete if every value agrees with LAPACK's at its index to 1e-6, relative, or
to 1e-6 of the mean spacing 4 pi / area for the smallest. isovary's iterative
solver is tested on the small shapes, too, where it would take LAPACK's; below 600
nodes with blocks of 8 columns, so that it has room to iterate. SciPy is `eigsh`
with `sigma=-0.01` and a start vector of a fixed seed for each solve.
Two rows try many starts: of a case that SciPy is known to fail, and of isovary
with blocks of 4 columns instead of 32, fewer than a sphere's eigenvalue has copies.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING
from unittest.mock import patch

import numpy as np

import isovary as iv
from isovary.geometry import Floats, Ints
from isovary.spectrum import _lanczos
from isovary.spectrum._accuracy import UNIT
from isovary.spectrum._threads import one_blas_thread

if TYPE_CHECKING:
    from scipy.sparse import csr_array

PAGE = Path(__file__).parents[1] / "docs" / "completeness.md"
SOLVES, PLANTED, STARTS = 1000, 100, 40
PLANTED_IN, MOST_PLANTED = 1000, 60  # nodes at least, as isovary itself has it; pairs at most
SMALL, BLOCK, NARROW = 600, 8, 4  # below so many nodes blocks of 8: 32 leave no room to iterate
FEWEST, MOST = 10, 300
TOLERANCE = 1e-6
SEED = 20130808

Solver = Callable[["Problem", int, int], Floats]
"""Takes a problem, a number of pairs and a seed, gives sorted eigenvalues."""


@dataclass(frozen=True, eq=False)
class Problem:
    """The matrices of a shape at unit area, and its smallest eigenvalues by LAPACK."""

    name: str
    laplacian: iv.Laplacian
    stiffness: csr_array
    mass: csr_array
    exact: Floats

    @property
    def size(self) -> int:
        return len(self.mass.diagonal())

    @property
    def most(self) -> int:
        """Most pairs that an iterative solver can be asked for."""
        return min(MOST, (self.size - 80) // 4)


def cube_sphere(cuts: int) -> iv.Surface:
    """A cube, its faces cut into squares and these into triangles, pushed onto the sphere."""
    steps = np.tan(np.linspace(-np.pi / 4, np.pi / 4, cuts + 1))
    u, v = (grid.ravel() for grid in np.meshgrid(steps, steps, indexing="ij"))
    squares = grid_triangles(cuts + 1, cuts + 1, closed=False)
    points: list[Floats] = []
    triangles: list[Ints] = []
    for axis in range(3):
        for side in (1.0, -1.0):
            face = np.stack([np.full_like(u, side), u, side * v], axis=1)
            triangles.append(squares + len(u) * len(points))
            points.append(np.roll(face, axis, axis=1))
    places, number = np.unique(np.concatenate(points).round(12), axis=0, return_inverse=True)
    places /= np.linalg.norm(places, axis=1, keepdims=True)
    return iv.Surface(places, number.ravel()[np.concatenate(triangles)])


def torus(ratio: float, around: int, across: int) -> iv.Surface:
    """A regular grid on a torus whose tube has radius 1 and whose axis has radius ``ratio``."""
    u, v = np.meshgrid(
        np.arange(around) * (2 * np.pi / around),
        np.arange(across) * (2 * np.pi / across),
        indexing="ij",
    )
    radius = ratio + np.cos(v)
    points = np.stack([radius * np.cos(u), radius * np.sin(u), np.sin(v)], axis=-1)
    return iv.Surface(points.reshape(-1, 3), grid_triangles(around, across, closed=True))


def grid_triangles(rows: int, columns: int, *, closed: bool) -> Ints:
    """Two triangles for each square of a grid of points; ``closed`` joins its ends."""
    number = np.arange(rows * columns).reshape(rows, columns)
    if closed:
        number = np.pad(number, ((0, 1), (0, 1)), mode="wrap")
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    both = [np.stack(corners, axis=-1).reshape(-1, 3) for corners in ((a, b, c), (a, c, d))]
    return np.concatenate(both)


def raw_sphere(samples: int) -> iv.Surface:
    """Marching cubes of a ball sampled on a grid that has the cube's symmetries."""
    ball = iv.ScalarField.from_function(
        lambda p: 1 - (p**2).sum(axis=-1), ((-1.3,) * 3, (1.3,) * 3), (samples,) * 3
    )
    return iv.contour(ball, 0.0)


def surfaces() -> dict[str, Callable[[], iv.Surface]]:
    shapes: dict[str, Callable[[], iv.Surface]] = {}
    for level in (2, 3, 4):
        shapes[f"icosphere {level}, flat linear"] = partial(iv.icosphere, level, order=1)
        shapes[f"icosphere {level - 1}, curved quadratic"] = partial(iv.icosphere, level - 1)
    for cuts in (6, 10, 15, 22):
        shapes[f"cube on the sphere, {cuts} cuts"] = partial(cube_sphere, cuts)
    for ratio, around, across in (
        (1.5, 24, 8),
        (2.0, 24, 24),
        (2.0, 48, 24),
        (3.0, 60, 20),
        (5.0, 100, 20),
        (3.0, 75, 38),
    ):
        name = f"torus {ratio:g} : 1, {around} x {across}"
        shapes[name] = partial(torus, ratio, around, across)
    for samples in (10, 13, 20, 27, 32):
        shapes[f"raw marching cubes, {samples}^3"] = partial(raw_sphere, samples)
    return shapes


def problem(name: str, surface: iv.Surface) -> Problem:
    """The matrices and one dense reference."""
    from scipy.linalg import eigvalsh

    laplacian = iv.fem(surface)
    stiffness, mass = laplacian.stiffness, laplacian.mass / laplacian.area
    exact = eigvalsh(stiffness.toarray(), mass.toarray())
    return Problem(name, laplacian, stiffness, mass, exact)


def isovary_values(task: Problem, count: int, seed: int, block: int | None = None) -> Floats:
    """By Lanczos, from the solver's own start if the seed is 0; by LAPACK where there is no room.

    Raises
    ------
    SpectrumError
    """
    if count > task.most:
        return iv.eigenpairs(task.laplacian, count).values * task.laplacian.area
    width = block or (BLOCK if task.size < SMALL else _lanczos._BLOCK)
    started = patch.object(_lanczos, "_SEED", seed or _lanczos._SEED)
    with patch.object(_lanczos, "_BLOCK", width), started, one_blas_thread():
        return _lanczos.lanczos(task.stiffness, task.mass, count, 1e-8)[0]


def scipy_values(task: Problem, count: int, seed: int) -> Floats:
    from scipy.sparse.linalg import eigsh

    start = np.random.default_rng(seed).uniform(-1, 1, task.size)
    matrices = {"A": task.stiffness, "M": task.mass}
    with one_blas_thread():
        return np.sort(eigsh(k=count, sigma=-0.01, v0=start, **matrices)[0])


def outcome(solver: Solver, task: Problem, count: int, seed: int) -> str:
    """``complete``, ``missed`` without a word, or the code of the error."""
    from scipy.sparse.linalg import ArpackError

    try:
        values = solver(task, count, seed)
    except iv.SpectrumError as error:
        return error.code
    except ArpackError:
        return "refused"
    return "complete" if is_complete(values, task.exact, count) else "missed"


def is_complete(values: Floats, exact: Floats, count: int) -> bool:
    """At least ``count`` values, and each the exact one of its index."""
    if len(values) < count:
        return False
    exact = exact[: len(values)]
    return bool((np.abs(values - exact) <= TOLERANCE * np.maximum(exact, UNIT)).all())


@contextmanager
def losing(lost: int) -> Iterator[None]:
    """Within it, isovary's Lanczos loses one of the pairs that it found."""
    honest = _lanczos._ritz

    def forgetful(
        operator: _lanczos._Operator, projected: Floats, remainder: Floats, count: int
    ) -> _lanczos._Ritz:
        pairs = honest(operator, projected, remainder, count + 1)
        kept = np.delete(np.arange(count + 1), lost)
        return _lanczos._Ritz(
            pairs.values[kept], pairs.ritz[kept], pairs.modes[:, kept], pairs.missed[:, kept]
        )

    with patch.object(_lanczos, "_ritz", forgetful):
        yield


def planted_losses(tasks: list[Problem], number: int) -> Counter[str]:
    """Outcomes of solves that lose one random pair, on the shapes in turn."""
    rng = np.random.default_rng(SEED)
    outcomes: Counter[str] = Counter()
    for turn in range(number):
        task = tasks[turn % len(tasks)]
        count = int(rng.integers(FEWEST, MOST_PLANTED + 1))
        with losing(int(rng.integers(count))):
            outcomes[outcome(isovary_values, task, count, 0)] += 1
    return outcomes


def row(name: str, size: str, pairs: str, outcomes: list[tuple[str, str]]) -> str:
    """A line of the table; each outcome is isovary's and SciPy's."""
    ours, theirs = (Counter(column) for column in zip(*outcomes, strict=True))
    cells = [name, size, pairs, len(outcomes)]
    cells += [ours["missed"], refused(ours), theirs["missed"], refused(theirs)]
    return "| " + " | ".join(map(str, cells)) + " |"


def refused(outcomes: Counter[str]) -> int:
    return outcomes.total() - outcomes["complete"] - outcomes["missed"]


def solve_both(task: Problem, count: int, seeds: tuple[int, int]) -> tuple[str, str]:
    """Outcome of isovary and of SciPy, each with its own seed."""
    return (
        outcome(isovary_values, task, count, seeds[0]),
        outcome(scipy_values, task, count, seeds[1]),
    )


def narrow(task: Problem, count: int, seed: int) -> str:
    """Outcome of isovary with few columns in a block."""
    return outcome(partial(isovary_values, block=NARROW), task, count, seed)


def random_counts(task: Problem, solves: int) -> list[tuple[str, str]]:
    """Outcomes for numbers of pairs chosen at random."""
    counts = np.random.default_rng(SEED + task.size).integers(FEWEST, task.most + 1, solves)
    return [solve_both(task, count, (0, i)) for i, count in enumerate(counts.tolist())]


def known_failure(task: Problem) -> str:
    """Row of many starts with 20 pairs."""
    found = [solve_both(task, 20, (start + 1, start)) for start in range(STARTS)]
    return row(f"{task.name}, {STARTS} starts", f"{task.size:,}", "20", found)


def narrow_blocks(task: Problem) -> str:
    """Row of many starts with narrow blocks, 10 to 59 pairs."""
    starts = [(FEWEST + start % 50, start) for start in range(5 * STARTS)]
    found = [
        (narrow(task, count, start + 1), outcome(scipy_values, task, count, start))
        for count, start in starts
    ]
    name = f"{task.name}, {len(starts)} starts, isovary with {NARROW} columns"
    return row(name, f"{task.size:,}", "10 to 59", found)


def report(solves: int = SOLVES, planted: int = PLANTED) -> str:
    """Markdown: the table, and what became of the planted losses."""
    tasks = [problem(name, make()) for name, make in surfaces().items()]
    lines, every = [], []
    for i, task in enumerate(tasks):
        share = solves * (i + 1) // len(tasks) - solves * i // len(tasks)
        found = random_counts(task, share)
        every += found
        if found:
            lines.append(row(task.name, f"{task.size:,}", f"{FEWEST} to {task.most}", found))
    lost = planted_losses([task for task in tasks if task.size > PLANTED_IN], planted)
    lines = [
        "# Completeness of the spectrum",
        "",
        (__doc__ or "").split("\n\n", 1)[1].replace("\n", " ").strip(),
        "",
        "| shape | nodes | pairs | solves | isovary: missed silently | isovary: refused | "
        "SciPy: missed silently | SciPy: refused |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
        *lines,
        row("**all of these**", "", "", every),
        known_failure(tasks[0]),
        narrow_blocks(next(task for task in tasks if task.size == 642)),
        "",
        f"{lost.total()} times one pair, a random one, was taken from what isovary's solver had "
        f"found: {lost['complete']} times it was found again, {refused(lost)} times the solve "
        f"ended in an error ({words(lost)}), {lost['missed']} times it was missed silently.",
    ]
    return "\n".join(lines) + "\n"


def words(outcomes: Counter[str]) -> str:
    codes = sorted(set(outcomes) - {"complete", "missed"})
    return ", ".join(f"{code}: {outcomes[code]}" for code in codes) or "none"


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("--solves", type=int, default=SOLVES)
    PAGE.write_text(report(parser.parse_args().solves), encoding="utf-8")
    print(f"wrote {PAGE}")


if __name__ == "__main__":
    main()
