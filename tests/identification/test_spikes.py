"""Samples that stand out alone: found where they are, and nothing that a mechanism does is one."""

from dataclasses import replace

import numpy as np
import pytest

from supple.identification.diagnose import diagnose
from supple.identification.spikes import spikes_of, without_spikes
from tests.identification.benches import make_bench

COUNT, RATE = 4096, 2048.0
TIMES = np.arange(COUNT) / RATE


def noisy(seed: int = 0, std: float = 1.0, signal: float = 30.0) -> np.ndarray:
    """A decay of 6 Hz with white noise."""
    decay = signal * np.exp(-1.5 * TIMES) * np.cos(2 * np.pi * 6 * TIMES)
    return decay + std * np.random.default_rng(seed).standard_normal(COUNT)


def test_spikes_are_found_where_they_are():
    values, rng = noisy(), np.random.default_rng(1)
    at = np.sort(rng.choice(np.arange(10, COUNT - 10, 7), 40, replace=False))
    values[at] += rng.choice([-1, 1], 40) * rng.uniform(10, 14, 40)
    found = np.flatnonzero(spikes_of(values))
    assert len(np.setdiff1d(found, at)) == 0
    assert len(np.intersect1d(found, at)) >= 32


@pytest.mark.parametrize("seed", range(20))
def test_noise_alone_has_none(seed):
    rng = np.random.default_rng(seed)
    growing = noisy(seed, 0.0) + (1 + np.abs(noisy(seed, 0.0)) / 10) * rng.standard_normal(COUNT)
    slow = np.convolve(rng.standard_normal(COUNT + 50), 0.9 ** np.arange(51), mode="valid")
    rounded = np.round(noisy(seed) / 2.4) * 2.4
    for values in (noisy(seed), growing, slow, rounded, np.round(noisy(seed, 0.0), 1)):
        assert not spikes_of(values).any()


def test_steps_blows_and_stops_are_no_spikes():
    step = noisy(2)
    step[2000:] += 40.0
    blow = noisy(3)
    blow[1500:1510] += 500.0 * np.sin(np.pi * np.arange(10) / 10)
    short = noisy(4)
    short[1500:1503] += [200.0, 400.0, 200.0]
    stops = noisy(5) + 15.0 * np.sign(np.sin(2 * np.pi * 6 * TIMES))
    for values in (step, blow, short, stops):
        assert not spikes_of(values).any()
    assert not spikes_of(np.zeros(COUNT)).any()
    assert not spikes_of(noisy()[:100]).any(), "too short to know what is usual"


def test_a_record_says_what_was_taken_for_something_else(tmp_path):
    bench = make_bench(tmp_path, held=())
    record = bench.records[0]
    assert without_spikes(record) is record
    first = record.channels[0]
    values = first.values.copy()
    values[300] += 100 * np.std(np.diff(values, 3))
    spiky = replace(record, channels=(replace(first, values=values), *record.channels[1:]))
    mended = without_spikes(spiky)
    assert np.flatnonzero(mended.channels[0].values != values).tolist() == [300]
    noise = np.std(np.diff(first.values, 3))
    assert abs(mended.channels[0].values[300] - first.values[300]) < noise
    assert not mended.channels[0].values.flags.writeable
    [words] = mended.warnings
    assert "1 sample stands out alone" in words and first.name in words


def test_a_blow_of_one_sample_is_kept_where_the_start_is_told(tmp_path):
    """What a channel that forgets has read hangs on it: a blow is a change of speed."""
    record = make_bench(tmp_path, held=()).records[0]
    first = record.channels[0]
    values = first.values.copy()
    values[[150, 300]] += 100 * np.std(np.diff(values, 3))
    told = {**record.start, "at": 149.5 / first.sample_rate + first.start_time}
    channels = (replace(first, values=values), *record.channels[1:])
    mended = without_spikes(replace(record, channels=channels, start=told))
    assert np.flatnonzero(mended.channels[0].values != values).tolist() == [300]


@pytest.mark.slow
def test_spikes_do_not_hide_a_verdict(tmp_path):
    """One sample in a hundred, ten times the noise: the same law, the same strength."""
    bench = make_bench(tmp_path, [("cubic_stiffness", -3000.0)])
    rng, records = np.random.default_rng(4), []
    for record in bench.records:
        channel = record.channels[0]
        noise = np.std(np.diff(channel.values, 3)) / np.sqrt(20)
        hit = rng.random(len(channel.values)) < 0.01
        kicks = hit * rng.choice([-1.0, 1.0], len(hit)) * rng.uniform(8, 12, len(hit)) * noise
        spiky = replace(channel, values=channel.values + kicks)
        records.append(replace(record, channels=(spiky, *record.channels[1:])))
    found = diagnose(records, bench.rig)
    assert found.status == "named"
    assert [one.candidate.name for one in found.accepted] == ["spring/cubic_stiffness"]
    floors = [noise.marginal_std for noise in found.final.problem.floor.values()]
    clean = diagnose(bench.records, bench.rig).final.problem.floor.values()
    assert np.median(floors) < 1.25 * np.median([noise.marginal_std for noise in clean])
