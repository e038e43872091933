"""Delays of part of a sample: exact for polynomials, ends held."""

import jax.numpy as jnp
import numpy as np
import pytest

from supple.model.delay import shift


@pytest.mark.parametrize("samples", [0.0, 0.25, -0.4, 1.0, 2.7, -3.2])
def test_shift_is_exact_for_polynomials(samples):
    times = np.arange(40.0)
    powers = (times[:, None] / 40.0) ** np.arange(6)
    found = np.asarray(shift(jnp.asarray(powers), jnp.full(6, samples)))
    inside = slice(7, 33)
    wanted = ((times[:, None] - samples) / 40.0) ** np.arange(6)
    np.testing.assert_allclose(found[inside], wanted[inside], rtol=1e-12, atol=1e-13)
    sixth = np.asarray(shift(jnp.asarray(times[:, None] ** 6), jnp.full(1, samples)))
    gap = np.abs(sixth[inside, 0] - (times - samples)[inside] ** 6).max()
    assert (gap > 1e-3) == (samples % 1 != 0), "of sixth order and not more"


def test_shift_holds_the_first_value_and_moves_columns_apart():
    columns = np.column_stack([np.arange(10.0), np.arange(10.0)])
    found = np.asarray(shift(jnp.asarray(columns), jnp.asarray([0.0, 4.0])))
    np.testing.assert_array_equal(found[:, 0], columns[:, 0])
    np.testing.assert_array_equal(found[:, 1], [0, 0, 0, 0, 0, 1, 2, 3, 4, 5])


@pytest.mark.parametrize("samples", [2.3, -1.7, 40.0, -40.0, 1e6])
def test_one_delay_for_all_columns_is_that_of_each_and_ends_are_held_however_late(samples):
    rows = jnp.asarray(np.random.default_rng(0).normal(size=(30, 3)))
    found = np.asarray(shift(rows, jnp.asarray(samples)))
    np.testing.assert_allclose(found, np.asarray(shift(rows, jnp.full(3, samples))), atol=1e-15)
    if abs(samples) > 30:
        np.testing.assert_allclose(
            found, np.tile(rows[0 if samples > 0 else -1], (30, 1)), atol=1e-15
        )
