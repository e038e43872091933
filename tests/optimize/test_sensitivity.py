"""Sobol indices: against Ishigami's closed form, a second program, and a second estimator."""

import numpy as np
import pytest
from scipy.stats import sobol_indices, uniform

from supple.model.drives import impact
from supple.model.linear import Port
from supple.model.robot import PRESETS, Robot
from supple.optimize.search_spec import Range
from supple.optimize.sensitivity import Sensitivity, analyze, sensitivity
from supple.optimize.sweep import Axis, SweepTask, score_designs

A, B = 7.0, 0.1
CUBE = tuple(Range(name, -np.pi, np.pi, False, "1") for name in "xyz")


def ishigami(numbers):
    x, y, z = (numbers[name] for name in "xyz")
    return {"f": np.sin(x) + A * np.sin(y) ** 2 + B * z**4 * np.sin(x), "g": 3.0 * y + 50.0}


@pytest.fixture(scope="module")
def found() -> Sensitivity:
    return analyze(ishigami, CUBE, 2**14, seed=1)


def test_the_indices_are_those_of_the_closed_form(found):
    alone = 0.5 * (1 + B * np.pi**4 / 5) ** 2
    second, mixed = A**2 / 8, B**2 * np.pi**8 * (1 / 18 - 1 / 50)
    whole = alone + second + mixed
    expected = {"x": alone / whole, "y": second / whole, "z": 0.0}
    totals = {"x": (alone + mixed) / whole, "y": second / whole, "z": mixed / whole}
    for name in "xyz":
        assert found.indices["f"].first[name] == pytest.approx(expected[name], abs=0.005)
        assert found.indices["f"].total[name] == pytest.approx(totals[name], abs=0.005)
    assert found.indices["g"].first["y"] == pytest.approx(1.0, abs=1e-3)
    assert found.indices["g"].total["x"] == pytest.approx(0.0, abs=1e-12)
    assert found.designs == 2**14 * 5


def test_the_indices_are_those_of_another_program(found):
    """Scipy's, on points of its own: two estimates as far apart as their intervals allow."""
    other = sobol_indices(
        func=lambda x: ishigami(dict(zip("xyz", x)))["f"],
        n=2**14,
        dists=[uniform(-np.pi, 2 * np.pi)] * 3,
        rng=np.random.default_rng(9),
    )
    own = found.indices["f"]
    np.testing.assert_allclose(list(own.first.values()), other.first_order, atol=0.01)
    np.testing.assert_allclose(list(own.total.values()), other.total_order, atol=0.01)


def test_the_first_indices_are_those_of_a_second_estimator(found):
    """Variance of the mean of the function over slices of one parameter."""
    generator = np.random.default_rng(3)
    points = generator.uniform(-np.pi, np.pi, (3, 400_000))
    values = ishigami(dict(zip("xyz", points)))["f"]
    for k, name in enumerate("xyz"):
        slices = np.array_split(values[np.argsort(points[k])], 200)
        share = np.var([one.mean() for one in slices]) / values.var()
        assert found.indices["f"].first[name] == pytest.approx(share, abs=0.01)


def test_the_intervals_hold_the_truth_as_often_as_they_say():
    alone = 0.5 * (1 + B * np.pi**4 / 5) ** 2
    whole = alone + A**2 / 8 + B**2 * np.pi**8 * (1 / 18 - 1 / 50)
    held = 0
    for seed in range(40):
        low, high = analyze(ishigami, CUBE, 256, seed).indices["f"].first_interval["x"]
        held += low <= alone / whole <= high
    assert held >= 34  # of 40 at 95 %; low-discrepancy points only make it more


def test_the_same_seed_gives_the_same_indices():
    assert analyze(ishigami, CUBE, 64, 5) == analyze(ishigami, CUBE, 64, 5)
    assert analyze(ishigami, CUBE, 64, 5) != analyze(ishigami, CUBE, 64, 6)


def test_scores_without_variance_or_value_have_no_indices():
    def some(numbers):
        x = numbers["x"]
        return {
            "still": np.ones_like(x),
            "lost": np.where(x > 0, x, np.nan),
            "seldom": np.where(x > 0.98 * np.pi, np.inf, x),
        }

    found = analyze(some, CUBE, 256, 0)
    assert set(found.indices) == {"seldom"}
    assert found.not_finite["lost"] > 500 and 0 < found.not_finite["seldom"] < 40
    assert found.indices["seldom"].first["x"] == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize(("count", "samples"), [(0, 64), (9, 64), (3, 100), (3, 1)])
def test_too_many_parameters_and_odd_numbers_of_samples_are_refused(count, samples):
    ranges = tuple(Range(f"p{k}", 0.0, 1.0, False, "1") for k in range(count))
    with pytest.raises(ValueError, match="Mend:"):
        analyze(ishigami, ranges, samples)


def test_a_wrists_indices_are_those_of_a_plain_average():
    """All scores at once; against the mean over one parameter on a plain grid."""
    numbers = PRESETS["robo_v_sleeve_50"]
    ranges = (
        Range("wrist_stiffness", 20.0, 2000.0, True, "N m/rad"),
        Range("wrist_damping", 1.0, 50.0, True, "N m s/rad"),
    )
    task = SweepTask(
        Robot("pinned_wrist", tuple(numbers)), numbers, impact("clubhead", -1600.0, 0.0, 0.005),
        np.arange(1000) / 500.0, (0.005, 2.0), Port("clubhead", "acceleration", "collet"),
        ("rms", "peak"), tuple(Axis(one.name, np.array([one.low, one.high])) for one in ranges),
    )  # fmt: skip
    found = sensitivity(task, ranges, 1024)
    lines = [np.exp(np.linspace(np.log(o.low), np.log(o.high), 81)[:-1]) for o in ranges]
    lines = [line * (line[1] / line[0]) ** 0.5 for line in lines]
    grid = np.meshgrid(*lines, indexing="ij")
    scores = score_designs(task, {o.name: g.ravel() for o, g in zip(ranges, grid)})
    for name, values in scores.items():
        square = values.reshape(80, 80)
        for k, one in enumerate(ranges):
            share = square.mean(axis=1 - k).var() / square.var()
            assert found.indices[name].first[one.name] == pytest.approx(share, abs=0.03)
