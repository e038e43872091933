"""What a faulty channel says, where its samples begin only after it has seen something."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from supple.identification.faults import FaultyReading, misread, misread_along
from supple.identification.free import law_entry
from supple.identification.prepare import coarser, prepare, shortened
from supple.identification.records import read_record
from supple.model.law import library
from supple.model.mechanism import mechanism_of
from supple.model.rig import read_rig

STEP, EARLY = 0.001, 300


def fault(name: str, *values: float, open_: bool = True) -> FaultyReading:
    law = library()[name]
    assert law.fault is not None
    entries = tuple(index if open_ else None for index in range(len(values)))
    return FaultyReading(law, law.fault, values, entries)


def readings(count: int) -> np.ndarray:
    at = STEP * np.arange(count)
    return np.exp(-2 * at) * np.sin(30 * at) + 0.3 * (at > 0.29)


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [
        ("sensor_delay", 0.0, np.inf),  # no channel tells what has not happened yet
        ("sensor_offset", -np.inf, np.inf),
        ("sensor_gain", -1.0, 1.0),
        ("sensor_lowpass", 0.0, np.inf),
    ],
)
def test_how_far_a_fault_may_go(name, low, high):
    entry = law_entry(library()[name], "gauge", 0.01, "s", [])
    assert (entry.low, entry.high) == (low, high)


@pytest.mark.parametrize("name, strength", [("sensor_lowpass", 0.02), ("sensor_highpass", 3.0)])
def test_a_filter_has_seen_what_came_before_its_first_sample(name, strength):
    true, one = readings(900), fault(name, strength)
    whole = one.read(true, STEP)
    said = misread([one], true[:EARLY], true[EARLY:], STEP)
    np.testing.assert_allclose(said, whole[EARLY:], rtol=0, atol=1e-14)
    assert np.max(np.abs(said - one.read(true[EARLY:], STEP))) > 0.005, "it starts in a transient"


def test_what_forgets_begins_with_the_channel():
    true, one = readings(900), fault("mains_hum", 0.2, 50.0, 0.7)
    said = misread([one], true[:EARLY], true[EARLY:], STEP)
    np.testing.assert_array_equal(said, one.read(true[EARLY:], STEP))


def test_a_drift_counts_from_where_the_record_begins():
    true, size = readings(900), 1e-6
    late = [replace(fault("sensor_drift", d), since=EARLY * STEP) for d in (0.2, 0.2 + size)]
    whole = fault("sensor_drift", 0.2).read(true, STEP)
    said = [misread([one], true[:EARLY], true[EARLY:], STEP) for one in late]
    np.testing.assert_allclose(said[0], whole[EARLY:], rtol=0, atol=1e-14)
    parts = (true[:EARLY], true[EARLY:]), (np.zeros((EARLY, 1)), np.zeros((600, 1)))
    slope = misread_along(late[:1], *parts, STEP, np.ones(1))[1][:, 0]
    np.testing.assert_allclose(slope, (said[1] - said[0]) / size, atol=1e-8)


def test_a_highpass_has_forgotten_what_was_read_since_the_record_began():
    true, size = readings(900), 1e-6
    whole = fault("sensor_highpass", 3.0).read(true, STEP)
    gathered = float(np.trapezoid(whole[: EARLY + 1])) * STEP
    late = [
        replace(fault("sensor_highpass", corner), gathered=gathered) for corner in (3.0, 3.0 + size)
    ]
    none = true[:0], np.zeros((0, 1))
    said = [misread([one], none[0], true[EARLY:], STEP) for one in late]
    np.testing.assert_allclose(said[0], whole[EARLY:], rtol=0, atol=1e-5)
    parts = (none[0], true[EARLY:]), (none[1], np.zeros((600, 1)))
    slope = misread_along(late[:1], *parts, STEP, np.ones(1))[1][:, 0]
    np.testing.assert_allclose(slope, (said[1] - said[0]) / size, atol=1e-8)


@pytest.mark.parametrize("first", ["sensor_lowpass", "sensor_highpass"])
def test_derivatives_are_those_of_the_readings(first):
    true, by, size = readings(600), np.cos(7 * STEP * np.arange(600)), 1e-6

    def both(strength: float) -> list[FaultyReading]:
        return [fault(first, strength), fault("sensor_rectified", 0.1, open_=False)]

    def said(strength: float, moved: float) -> np.ndarray:
        values = true + moved * by
        return misread(both(strength), values[:EARLY], values[EARLY:], STEP)

    strength = 0.015 if first == "sensor_lowpass" else 4.0
    faults = both(strength)
    columns = np.stack([np.zeros(600), by], axis=1)
    parts = (true[:EARLY], true[EARLY:]), (columns[:EARLY], columns[EARLY:])
    values, slopes = misread_along(faults, *parts, STEP, np.ones(2))
    np.testing.assert_array_equal(values, said(strength, 0.0))
    for column, change in enumerate(((size, 0.0), (0.0, size))):
        up, down = said(strength + change[0], change[1]), said(strength - change[0], -change[1])
        expected = (up - down) / (2 * size)
        np.testing.assert_allclose(slopes[:, column], expected, atol=1e-6 * np.ptp(expected))


def test_a_struck_robot_is_followed_from_before_its_first_sample(tmp_path):
    command = [sys.executable, "-m", "tests.lab", "draw", "--bench", "A", "--seed", "87000"]
    root = Path(__file__).parents[2]
    subprocess.run([*command, "--out", str(tmp_path)], cwd=root, check=True, capture_output=True)
    record = read_record(tmp_path / "records" / "train_03_impact.toml")
    rig = read_rig(tmp_path / "records" / "rig.toml")
    numbers = {name: number.value for name, number in rig.parameters.items()}
    whole, record_step = prepare(record, mechanism_of(rig), numbers), 1.0 / record.sample_rate
    for prepared in (whole, coarser(whole), shortened(whole, whole.count // 2)):
        grid = prepared.step * np.arange(len(prepared.inputs))
        for sensor in prepared.sensors:
            assert sensor.sampling is not None and sensor.before is not None
            first = sensor.channel.start_time + sensor.since
            assert sensor.since > 0.0
            assert first == pytest.approx(whole.start * record_step + sensor.times[0])
            shown = sensor.channel.start_time + np.arange(len(sensor.channel.values)) * (
                1.0 / sensor.channel.sample_rate
            )
            ago = shown < whole.start * record_step + (sensor.before @ grid)[0] + 1e-9
            gathered = np.trapezoid(sensor.channel.values[ago], shown[ago])
            assert sensor.gathered == pytest.approx(gathered, abs=1e-12)
            times = np.concatenate([sensor.before @ grid, sensor.sampling @ grid])
            assert -1e-12 <= times[0] < sensor.step
            np.testing.assert_allclose(np.diff(times), sensor.step, rtol=1e-9)
            np.testing.assert_allclose(times[-len(sensor.times) :], sensor.times, atol=1e-12)
