"""Strengths of hidden effects as the library counts them, and what intervals make of them."""

import pytest

from supple.model.law import library
from supple.studies.hidden_sizes import (
    MEANT,
    compared,
    error_of,
    gains_beyond_noise,
    gains_most,
    holds,
)
from tests.lab.causes import CAUSES


def row(law, place, size, told, other=None, bench="A", symbol="strength"):
    """A case whose one cause was named, with `told` as (value, low, high)."""
    numbers = {symbol: dict(zip(("value", "low", "high"), told, strict=True))}
    cause = {"law": law, "place": place, "probability": 1.0, "parameters": numbers}
    truth = {"law": law, "place": place, "places": [place], "size": size, "other": other}
    return {"bench": bench, "causes": [cause], "truth": [truth]}


def test_an_interval_holds_or_does_not():
    good = row("coulomb_friction", "wrist", 2.0, (2.1, 1.9, 2.3))
    assert compared(good) == (2.0, 2.1, 1.9, 2.3)
    assert holds(good) and error_of(good) == pytest.approx(0.05)
    assert not holds(row("coulomb_friction", "wrist", 2.0, (2.1, 2.05, 2.15)))


@pytest.mark.parametrize(
    ("law", "place", "size", "other", "expected"),
    [
        ("sensor_drift", "head_acc", -4.0, None, -2.0),
        ("sensor_highpass", "head_acc", 0.5, None, 2.0),
        ("hysteresis", "wrist", 30.0, 0.1, 3.0),
        ("sensor_rectified", "head_acc", 0.25, None, 0.2),
        ("clearance", "wrist", 0.01, 200.0, 0.01),
    ],
)
def test_the_bench_means_the_library_s_number(law, place, size, other, expected):
    found = compared(row(law, place, size, (expected, expected, expected), other))
    assert found is not None and found[0] == pytest.approx(expected)


def test_a_channel_s_own_gain_acts_on_what_is_added_to_its_reading():
    """The bench multiplies by it after the fault; the law is of what is read."""
    told = (0.5, 0.49, 0.51)
    for law, factor in (("mains_hum", 1.03), ("sensor_tilt", 1.0)):
        case = row(law, "shaft_gauge", 0.5, told)
        case["truth"][0]["gain"] = 0.03
        found = compared(case)
        assert found is not None and found[0] == pytest.approx(0.5 * factor)


def test_a_phase_takes_the_sign():
    found = compared(row("drive_ripple", "drive", 3e-4, (-2.9e-4, -3.1e-4, -2.7e-4)))
    assert found == pytest.approx((3e-4, 2.9e-4, 2.7e-4, 3.1e-4))
    drift = compared(row("sensor_drift", "head_acc", 4.0, (-2.0, -2.1, -1.9)))
    assert drift is not None and drift[0] > 0 > drift[1]


def test_what_means_another_number_is_not_compared():
    told = (1.0, 0.9, 1.1)
    assert compared(row("cubic_stiffness", "sleeve", 1.0, told)) is None
    assert compared(row("cubic_stiffness", "shaft", 1.0, told, bench="B")) is None
    assert compared(row("cubic_stiffness", "shaft", 1.0, told)) is not None
    assert compared(row("stiffness_drift", "wrist", 1.0, told)) is None
    assert compared(row("sensor_saturation", "head_acc", 1.0, told)) is None
    limited = row("sensor_saturation", "head_acc", 1.0, told, symbol="limit")
    assert compared(limited) is not None


def test_what_was_not_named_is_not_compared():
    missed = row("clearance", "wrist", 1.0, (1.0, 0.9, 1.1)) | {"causes": []}
    assert compared(missed) is None and error_of(missed) is None and not holds(missed)


def test_every_law_that_is_compared_is_in_the_library_and_can_be_hidden():
    assert set(MEANT) <= set(library())
    assert set(MEANT) <= {law for law, _ in CAUSES}


def test_the_gain_is_asked_of_what_lies_beyond_the_noise():
    errors = {"nrmse_before": 0.5, "noise_floor": 0.1}
    assert gains_most({**errors, "nrmse_after": 0.17})
    assert not gains_most({**errors, "nrmse_after": 0.2})


@pytest.mark.parametrize(
    ("true", "after", "most"),
    [(None, 0.2, False), (0.05, 0.2, False), (0.2, 0.25, True), (0.2, 0.27, False),
     (0.5, 0.5, False), (0.6, 0.2, False), (0.6, 0.1, True)],
)  # fmt: skip
def test_no_more_is_asked_than_the_true_law_takes_away(true, after, most):
    row = {"nrmse_before": 0.5, "noise_floor": 0.1, "nrmse_after": after, "true_after": true}
    assert gains_most(row) == most
    assert gains_beyond_noise(row) == (after < 0.18)
