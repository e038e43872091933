"""Faults of a channel, put onto records by other means than the model's, are found there."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lsim

from supple.identification.diagnose import diagnose
from supple.identification.finding import Diagnosis
from supple.identification.records import Record
from tests.identification.benches import RATE, Bench, make_bench

Reading = Callable[[np.ndarray, np.ndarray], np.ndarray]


def misread(record: Record, reading: Reading) -> Record:
    """The record with its response as a faulty channel would have told it."""
    times = np.arange(len(record.times)) / RATE
    channels = tuple(
        replace(c, values=reading(times, np.asarray(c.values))) if c.role == "response" else c
        for c in record.channels
    )
    return replace(record, channels=channels)


def diagnosed(bench: Bench, reading: Reading) -> Diagnosis:
    train = [misread(record, reading) for record in bench.records]
    return diagnose(train, bench.rig, [misread(record, reading) for record in bench.held])


def named(found: Diagnosis) -> list[str]:
    return [trial.candidate.name for trial in found.accepted]


def strength(found: Diagnosis, name: str) -> tuple[float, float]:
    index = found.final.index(name)
    return found.final.value(index), found.final.std(index)


@pytest.fixture(scope="module")
def decays(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    return make_bench(tmp_path_factory.mktemp("decays"))


@pytest.fixture(scope="module")
def driven(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    return make_bench(tmp_path_factory.mktemp("driven"), driven=True)


@pytest.mark.slow
def test_a_channel_that_lost_its_sign_is_named_or_called_unknown(driven):
    found = diagnosed(driven, lambda t, y: np.abs(y))
    assert (found.status, named(found)) in (
        ("named", ["see_cart/sensor_rectified"]),
        ("unknown", []),  # the fit of what has no sign lies far from the truth
    )


def test_a_channel_that_drifts(decays):
    found = diagnosed(decays, lambda t, y: y + 2e-4 * t)
    assert (found.status, named(found)) == ("named", ["see_cart/sensor_drift"])
    assert strength(found, "see_cart/sensor_drift")[0] == pytest.approx(2e-4, rel=0.05)


def test_a_channel_that_forgets_what_is_slow(driven):
    corner = 1.5

    def coupled(t, y):
        return lsim(([1.0, 0.0], [1.0, corner]), y, t)[1]

    found = diagnosed(driven, coupled)
    assert found.status in ("named", "ambiguous")
    assert "see_cart/sensor_highpass" in named(found)
    assert strength(found, "see_cart/sensor_highpass")[0] == pytest.approx(corner, rel=0.1)


@pytest.mark.slow
def test_a_channel_that_rounds_off(driven):
    def slow(t, y):
        return lsim(([1.0], [0.02, 1.0]), y, t)[1]

    found = diagnosed(driven, slow)
    assert found.status in ("named", "ambiguous")
    told = {*named(found), *(trial.candidate.name for trial in found.rivals)}
    assert told <= {"see_cart/sensor_lowpass", "see_cart/sensor_delay"}, "alike when little"
    assert "see_cart/sensor_lowpass" in told


@pytest.mark.slow
def test_a_gain_that_is_off_shows_in_a_driven_record(driven):
    found = diagnosed(driven, lambda t, y: 1.07 * y)
    # without a known force of another place, a gain is a mass: the rig holds the mass
    assert found.status in ("named", "ambiguous")
    assert "see_cart/sensor_gain" in named(found)
    assert strength(found, "see_cart/sensor_gain")[0] == pytest.approx(0.07, abs=0.01)
