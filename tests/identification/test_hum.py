"""A tone of the grid is found although every record begins at its own phase."""

import json
from dataclasses import replace

import numpy as np
import pytest

from supple.identification.diagnose import diagnose
from supple.identification.records import Record
from supple.identification.verdict import diagnosis_json
from supple.model.law import library
from tests.identification.benches import REACH, make_bench

AMPLITUDE = 0.03 * REACH


def with_hum(record: Record, phase: float) -> Record:
    channels = []
    for channel in record.channels:
        times = channel.start_time + np.arange(len(channel.values)) / channel.sample_rate
        tone = AMPLITUDE * np.sin(2 * np.pi * 50.0 * times + phase)
        channels.append(replace(channel, values=channel.values + tone))
    return replace(record, channels=tuple(channels))


def test_a_hum_of_unknown_phases_is_named_and_foretold(tmp_path):
    bench = make_bench(tmp_path, reaches=(1.0, 0.5, 0.35), finer=4, snr_db=30.0)
    train = [with_hum(r, p) for r, p in zip(bench.records, (0.3, 2.0, -1.5), strict=True)]
    held = [with_hum(r, 2.8) for r in bench.held]
    found = diagnose(train, bench.rig, held)
    assert found.status == "named"
    assert [trial.candidate.name for trial in found.accepted] == ["see_cart/mains_hum"]
    told = diagnosis_json(found, {})
    json.dumps(told, allow_nan=False)  # as it is written
    shown = told["causes"][0]["parameters"]
    assert shown["amplitude"]["value"] == pytest.approx(AMPLITUDE, rel=0.03)
    assert shown["frequency"]["value"] == pytest.approx(50.0, abs=0.01)
    assert "phase" not in shown  # every record has its own
    assert found.held_before is not None and found.held_after is not None
    assert found.held_before.nrmse > 1.5 * found.held_after.nrmse
    assert found.held_after.nrmse < 1.1 * found.held_after.noise_floor


@pytest.mark.parametrize("phase", [-3.0, 0.4, 2.2])
def test_a_phase_is_read_off_what_is_left(phase):
    (own,) = [shape for shape in library()["mains_hum"].shapes if shape.guess is not None]
    assert own.guess is not None
    times = np.arange(400) / 1000.0
    left = 3.0 - 8.0 * times + 0.1 * np.sin(2 * np.pi * 50.0 * times + phase)
    assert own.guess(left, 1e-3, (50.0,)) == pytest.approx(phase, abs=0.02)
