"""An oscillator left alone, damped little, critically and much, against the matrix exponential."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import expm

from supple.model.ringing import rung

CASES = [(400.0, 0.6), (400.0, 20.0), (400.0, 20.0 + 1e-7), (400.0, 90.0), (0.0, 3.0), (25.0, 0.0)]


@pytest.mark.parametrize(("square", "decay"), CASES)
@pytest.mark.parametrize("step", [1e-4, 0.03, 1.0])
def test_it_moves_as_its_matrix_says(square, decay, step):
    matrix = np.array([[0.0, 1.0], [-square, -2 * decay]])
    wanted = expm(matrix * step) @ [0.3, -2.0]
    found = np.array(rung(0.3, -2.0, square, decay, step))
    np.testing.assert_allclose(found, wanted, rtol=1e-8, atol=1e-8 * np.abs(wanted).max())


def test_what_is_damped_beyond_telling_creeps_and_does_not_overflow():
    """At 2 decay t = 4000 the hyperbolic cosine alone is no number."""
    e, rate = rung(1.0, 0.0, 1000.0, 2000.0, 1.0)
    slow = 2000.0 - np.sqrt(2000.0**2 - 1000.0)
    assert float(e) == pytest.approx(np.exp(-slow) * (0.5 + 1000.0 / np.sqrt(2000.0**2 - 1000.0)))
    assert float(rate) == pytest.approx(-slow * float(e), rel=1e-3)


@pytest.mark.parametrize(("square", "decay"), CASES[:4])
def test_slopes_are_those_of_differences(square, decay):
    at = [jnp.asarray(v) for v in (0.3, -2.0, square, decay, 0.03)]
    for index in range(5):
        found = np.array(jax.jacfwd(rung, argnums=index)(*at))
        move = 1e-5 * max(abs(float(at[index])), 1.0)
        ends = [
            np.array(rung(*(x + sign * move * (i == index) for i, x in enumerate(at))))
            for sign in (1, -1)
        ]
        wanted = (ends[0] - ends[1]) / (2 * move)
        np.testing.assert_allclose(found, wanted, rtol=1e-4, atol=1e-5 * np.abs(wanted).max())
