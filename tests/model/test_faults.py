"""Faults of channels: each is nothing at its null, and its derivatives are those of differences."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from supple.model.law import Fault, Scales, library

FAULTS = {name: law for name, law in library().items() if law.fault is not None}
BY_NAME = pytest.mark.parametrize("name", FAULTS)
SCALES = Scales(stretch=0.05, rate=0.6, force=2.0, stiffness=40.0, time=0.08)
STEP, COUNT = 0.004, 300
TIMES = STEP * np.arange(COUNT)
VALUES = 0.3 + np.exp(-TIMES) * np.sin(20.0 * TIMES + 0.4)


def fault_of(name: str) -> Fault:
    fault = FAULTS[name].fault
    assert fault is not None
    return fault


def shapes_of(name: str) -> list[float]:
    return [shape.trials(SCALES)[0] for shape in FAULTS[name].shapes]


def natural(name: str) -> float:
    return float(FAULTS[name].natural(SCALES))


def test_the_faults_of_the_contract_are_there():
    named = {"sensor_drift", "sensor_highpass", "sensor_lowpass", "sensor_rectified", "mains_hum"}
    named |= {"sensor_saturation"}
    assert set(FAULTS) >= named and library()["sensor_gain"].slot == "gain"


@BY_NAME
def test_null_is_exact(name):
    read = fault_of(name).read(0.0, shapes_of(name), VALUES, STEP)
    np.testing.assert_array_equal(read, VALUES)


@BY_NAME
def test_a_strength_that_matters_shows(name):
    read = fault_of(name).read(natural(name), shapes_of(name), VALUES, STEP)
    assert 1e-3 < np.std(read - VALUES) / np.std(VALUES) < 3.0


@BY_NAME
@pytest.mark.parametrize("share", [0.0, 1.0])
def test_derivatives_are_those_of_differences(name, share):
    fault, shapes, strength = fault_of(name), shapes_of(name), share * natural(name)
    rng = np.random.default_rng(1)
    moved = rng.normal(size=(COUNT, 2 + len(shapes)))
    by = np.zeros(2 + len(shapes))
    by[0] = 1.0
    by_shapes = [np.eye(2 + len(shapes))[2 + k] for k in range(len(shapes))]
    found = fault.along(strength, shapes, VALUES, STEP, by, by_shapes, moved)
    low = 0.0 if strength == 0 and not FAULTS[name].signed else -1.0
    for k in range(2 + len(shapes)):
        h = 1e-6
        move = h * natural(name) if k == 0 else h
        ends = []
        for sign in (low, 1.0):
            s = strength + (sign * move if k == 0 else 0.0)
            turned = [x + (sign * move if k == 2 + i else 0.0) for i, x in enumerate(shapes)]
            values = VALUES + sign * move * (moved[:, k])
            ends.append(fault.read(s, turned, values, STEP))
        wanted = (ends[1] - ends[0]) / (move * (1.0 - low))
        size = np.max(np.abs(wanted))
        tolerance = 1e-4 if low == 0.0 and k == 0 else 2e-6
        np.testing.assert_allclose(found[:, k], wanted, atol=tolerance * size)


def first_order(rates, start):
    """Restarted at every sample, where the straight pieces of the input meet."""
    found = [start]
    for k in range(COUNT - 1):
        y, slope = VALUES[k], (VALUES[k + 1] - VALUES[k]) / STEP
        run = solve_ivp(
            lambda t, u, y=y, slope=slope: rates(y + slope * t, u),
            (0, STEP), [found[-1]], "DOP853", rtol=1e-10, atol=1e-13,
        )  # fmt: skip
        found.append(run.y[0, -1])
    return np.array(found)


@pytest.mark.parametrize("constant", [1e-3, 0.02, 5.0])
def test_a_lowpass_follows_its_equation(constant):
    wanted = first_order(lambda y, u: (y - u) / constant, VALUES[0])
    found = fault_of("sensor_lowpass").read(constant, (), VALUES, STEP)
    np.testing.assert_allclose(found, wanted, atol=1e-8)


@pytest.mark.parametrize("corner", [1e-3, 3.0, 400.0])
def test_a_highpass_follows_its_equation(corner):
    wanted = VALUES - first_order(lambda y, u: corner * (y - u), 0.0)
    found = fault_of("sensor_highpass").read(corner, (), VALUES, STEP)
    np.testing.assert_allclose(found, wanted, atol=1e-8)


def test_a_rectified_channel_has_no_sign_and_hum_is_a_tone():
    np.testing.assert_allclose(
        fault_of("sensor_rectified").read(1.0, (), VALUES - 0.5, STEP), np.abs(VALUES - 0.5)
    )
    np.testing.assert_allclose(
        fault_of("sensor_rectified").read(-1.0, (), VALUES - 0.5, STEP), -np.abs(VALUES - 0.5)
    )
    tone = fault_of("mains_hum").read(0.2, (50.0, np.pi / 2), 0 * VALUES, STEP)
    np.testing.assert_allclose(tone, 0.2 * np.cos(2 * np.pi * 50.0 * TIMES), atol=1e-12)
    drift = fault_of("sensor_drift").read(0.7, (), 0 * VALUES, STEP)
    np.testing.assert_allclose(drift, 0.7 * TIMES)
