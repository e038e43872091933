"""Scores of free decays without most of their samples: against the samples, and where unsure."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from supple.model import score
from supple.model.chain import Chain
from supple.model.drives import impact, release
from supple.model.linear import Port
from supple.model.robot import PRESETS, Robot
from supple.optimize.sweep_decay import SCORES, decay_scores, sums
from supple.optimize.sweep_tile import Grid, samples, tile_of

NUMBERS = PRESETS["robo_v_sleeve_50"]
ROBOT = Robot("pinned_wrist", tuple(NUMBERS))
SENSOR = Port("clubhead", "acceleration", "collet")
CART = Chain(("cart",), (("spring", "ground", "cart"),))
PAIR = Chain(("a", "b"), (("low", "ground", "a"), ("high", "a", "b")))


def robots(varied, numbers=NUMBERS, rate=1000.0, seconds=2.0):
    grid = Grid(np.arange(int(seconds * rate)) / rate, int(0.005 * rate) + 1, int(seconds * rate))
    fixed = {name: value for name, value in numbers.items() if name not in varied}
    blow = impact("clubhead", -1600.0, 0.0, 0.005)
    return tile_of(ROBOT, varied, fixed, blow, grid, (SENSOR,)), grid


def compared(tile, grid) -> np.ndarray:
    """Which designs are certain; their scores are checked against all samples."""
    found, certain = decay_scores(tile, grid, SCORES)
    seen, when = samples(tile, grid, 0), grid.times[grid.low : grid.high]
    for name in SCORES:
        expected = np.asarray(score.SCORES[name](seen, when))[certain]
        assert found[name][certain] == pytest.approx(expected, rel=2e-10, nan_ok=True), name
    return certain


@settings(max_examples=12, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from(["robo_v_rigid", "robo_v_sleeve_0", "robo_v_sleeve_50"]),
    st.sampled_from([(400.0, 2.0), (1000.0, 0.7), (2048.0, 2.0)]),
)
def test_scores_are_those_of_all_samples(seed, preset, sampling):
    rng = np.random.default_rng(seed)
    varied = {
        "wrist_stiffness": 10.0 ** rng.uniform(1, 4, 64),
        "wrist_damping": 10.0 ** rng.uniform(-1, 2.2, 64),
        "collet_inertia": rng.uniform(0.002, 0.076, 64),
    }
    tile, grid = robots(varied, PRESETS[preset], *sampling)
    certain = compared(tile, grid)
    assert certain.mean() > 0.5


def test_nearly_all_of_the_thesis_grid_is_certain():
    stiffness, damping = np.meshgrid(50.0 + 75 * np.arange(0, 75, 5), 2.0 + 2 * np.arange(0, 75, 5))
    varied = {"wrist_stiffness": stiffness.ravel(), "wrist_damping": damping.ravel()}
    assert compared(*robots(varied, rate=2048.0)).mean() > 0.98


def carts(shares):
    """Carts let go, by the share of their critical damping."""
    varied = {"links.spring.damping": 20.0 * np.asarray(shares, float)}
    grid = Grid(np.arange(1000) / 500.0, 0, 1000)
    fixed = {"masses.cart.mass": 0.5, "links.spring.stiffness": 200.0}
    drive, sensor = release("cart", 0.1), Port("cart", "position")
    return tile_of(CART, varied, fixed, drive, grid, (sensor,)), grid


def test_a_maximum_at_the_floor_is_left_to_its_samples():
    """Where a period's maximum is within a hair of 1 % of the first one's, no bound can tell."""

    def share_of(damping: float) -> float:
        tile, grid = carts([damping])
        tops = samples(tile, grid, 0)[0, : 5 * 167].reshape(5, 167).max(axis=1)
        return float(tops[3] / tops[0])

    low, high = 0.15, 0.35
    assert share_of(low) > score.FADED > share_of(high)
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if share_of(middle) > score.FADED else (low, middle)
    around = low * np.array([1 - 0.05, 1 - 1e-6, 1 + 1e-6, 1 + 0.05])
    certain = compared(*carts(around))
    assert certain[0] and certain[3] and not certain[2]  # above it a point alone may tell


def test_undamped_and_overdamped_carts_are_not_mistaken():
    tile, grid = carts([0.0, 1e-6, 0.02, 0.9, 1.5, 4.0])
    certain = compared(tile, grid)
    assert not certain[0]  # the sum over its pair does not exist
    assert certain[2:4].all()


def test_a_fast_mode_that_rings_on_is_sampled_where_it_may_be_larger():
    """At 60 Hz it turns by four radians between two points."""
    varied = {"links.high.damping": np.geomspace(1e-3, 20.0, 40)}
    fixed = {
        "masses.a.mass": 5.0, "masses.b.mass": 0.02, "links.low.stiffness": 2000.0,
        "links.low.damping": 5.0, "links.high.stiffness": 2800.0,
    }  # fmt: skip
    grid = Grid(np.arange(2000) / 1000.0, 10, 2000)
    drive, sensor = impact("b", 100.0, 0.0, 0.002), Port("b", "position")
    tile = tile_of(PAIR, varied, fixed, drive, grid, (sensor,))
    certain = compared(tile, grid)
    assert certain[-5:].all() and not certain[:5].any()


def test_sums_are_those_of_the_samples():
    varied = {"wrist_damping": np.linspace(2.0, 60.0, 30)}
    tile, grid = robots(varied)
    found, seen = sums(tile, grid), samples(tile, grid, 0)
    assert found.rms == pytest.approx(np.sqrt(np.mean(seen**2, axis=1)), rel=1e-11)
    spectrum = np.abs(np.fft.rfft(seen, axis=1))[:, 1:]
    np.testing.assert_array_equal(found.largest, 1 + np.argmax(spectrum, axis=1))
