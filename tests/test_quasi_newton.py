"""Limited-memory BFGS."""

from __future__ import annotations

import numpy as np

from isovary.quasi_newton import Memory

HESSIAN = np.array([[3.0, 1.0, 0.0], [1.0, 2.0, 0.5], [0.0, 0.5, 4.0]])


def learned(steps):
    memory = Memory()
    for step in steps:
        memory = memory.after(step, HESSIAN @ step)
    return memory


def test_along_the_last_step_it_is_newtons():
    """Oracle: algebra. The secant condition: the inverse maps the last change to the last step."""
    steps = np.random.default_rng(3).standard_normal((4, 3))
    memory = learned(steps)
    found = memory.direction(HESSIAN @ steps[-1], lambda slope: 0.7 * slope)
    np.testing.assert_allclose(found, -steps[-1], rtol=1e-12)


def test_conjugate_steps_teach_the_whole_hessian():
    """Oracle: algebra. After steps along all eigenvectors the direction is Newton's."""
    memory = learned(np.linalg.eigh(HESSIAN)[1].T)
    gradient = np.array([1.0, -2.0, 0.3])
    found = memory.direction(gradient, lambda slope: 5 * slope)
    np.testing.assert_allclose(found, -np.linalg.solve(HESSIAN, gradient), rtol=1e-12)


def test_a_preconditioner_that_is_exact_stays_so():
    """Oracle: algebra. With the true inverse nothing is left to learn."""
    memory = learned(np.random.default_rng(4).standard_normal((3, 3)))
    gradient = np.array([0.4, 0.1, -1.0])
    found = memory.direction(gradient, lambda slope: np.linalg.solve(HESSIAN, slope))
    np.testing.assert_allclose(found, -np.linalg.solve(HESSIAN, gradient), rtol=1e-12)


def test_every_direction_is_downhill():
    """Oracle: algebra. Steps along which the gradient falls are not kept, nor more than six."""
    rng = np.random.default_rng(5)
    memory = learned(rng.standard_normal((9, 3)))
    assert len(memory.steps) == 6
    after = memory.after(np.ones(3), -np.ones(3))
    assert after is memory
    for gradient in rng.standard_normal((20, 3)):
        assert gradient @ after.direction(gradient, lambda slope: slope) < 0
