"""Allowances: summing out is fitting with a prior; drives, levers and ringing are what they say."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from supple.identification.allowance import Allowance, joined, marginal_of, summed_out, used
from supple.identification.drive_error import MOST_ERRORS, drive_allowances, told_noise
from supple.identification.faults import told_motion
from supple.identification.fit import solve, with_known_starts
from supple.identification.free import Entry
from supple.identification.lever import LEVER, lever_allowances
from supple.identification.noise import Noise
from supple.identification.problem import Model, base_entries, make_problem, rough_noise
from supple.identification.records import read_record
from supple.identification.ringing import find_ringing, ringing_allowances
from supple.model.law import library
from supple.model.laws.sensor_lowpass import lag, weights
from supple.model.rig import read_rig
from tests.lab.sealed import draw_sealed


@settings(deadline=None, max_examples=25)
@given(st.integers(0, 10_000), st.integers(1, 6), st.floats(-2, 2))
def test_summing_out_is_fitting_with_a_prior(seed, count, size):
    rng = np.random.default_rng(seed)
    columns, priors = rng.normal(size=(40, count)), 10.0 ** rng.uniform(-2, size + 2, count)
    white = rng.normal(size=40)
    allowance = Allowance(("drive",) * count, (columns,), priors)
    marginal = marginal_of(allowance, columns)
    wide = np.vstack([columns * priors, np.eye(count)])
    best = np.linalg.lstsq(wide, np.append(white, np.zeros(count)), rcond=None)[0]
    cost = np.sum((np.append(white, np.zeros(count)) - wide @ best) ** 2)
    assert np.sum(marginal.apply(white) ** 2) == pytest.approx(cost, rel=1e-8)
    assert marginal.estimate(white) == pytest.approx(best, rel=1e-6, abs=1e-7)
    pair = rng.normal(size=(40, 2))
    together = marginal.apply(pair)
    assert together[:, 0] == pytest.approx(marginal.apply(pair[:, 0]))


def test_a_sum_is_found_once_for_one_allowance_under_one_noise_and_anew_for_another():
    rng = np.random.default_rng(3)
    blocks = rng.normal(size=(30, 2)), rng.normal(size=(20, 2))
    allowance = Allowance(("drive",) * 2, blocks, np.array([0.5, 2.0]))
    even, coloured = Noise((), 0.1), Noise((0.6,), 0.1)
    first = summed_out(allowance, (even, coloured))
    assert summed_out(allowance, (Noise((), 0.1), Noise((0.6,), 0.1))) is first
    white = np.concatenate([even.whiten(blocks[0]), coloured.whiten(blocks[1])])
    gap = rng.normal(size=50)
    assert first.apply(gap) == pytest.approx(marginal_of(allowance, white).apply(gap), rel=1e-12)
    other = summed_out(allowance, (coloured, even))
    assert np.max(np.abs(other.apply(gap) - first.apply(gap))) > 1e-3
    assert summed_out(replace(allowance, priors=np.ones(2)), (even, coloured)) is not first


def test_allowances_of_one_record_are_joined_and_told_apart():
    one = Allowance(("drive",), (np.ones((3, 1)), np.ones((2, 1))), np.array([1.0]))
    two = Allowance(("lever", "lever"), (np.zeros((3, 2)), np.ones((2, 2))), np.array([2.0, 3.0]))
    both = joined([one, two])
    assert both is not None and both.kinds == ("drive", "lever", "lever")
    assert [block.shape for block in both.columns] == [(3, 3), (2, 3)]
    assert list(both.priors) == [1.0, 2.0, 3.0]
    assert joined([]) is None


@pytest.fixture(scope="module")
def driven(tmp_path_factory):
    """Two driven records of a lumped club, without anything hidden, and their model."""
    folder = tmp_path_factory.mktemp("driven")
    draw_sealed(
        folder, "A", 5, effects=0, model="driven_wrist", noise="white", train=2, held_out=0,
        samples=1024,
    )  # fmt: skip
    records = [read_record(path) for path in sorted((folder / "records").glob("train*.toml"))]
    problem = make_problem(records, read_rig(folder / "records" / "rig.toml"))
    model = Model(problem, base_entries(problem), (), rough_noise(problem))
    return model, np.array([entry.value / entry.scale for entry in model.entries])


def held_by_a_spring(model, x, stiffness):
    """The model with a spring [N/m] at the clubhead in force, and its unknowns."""
    law = library()["linear_stiffness"]
    name = "clubhead/linear_stiffness"
    entry = Entry(name, "strengths", ("clubhead", law.name, ""), None, stiffness, scale=1.0)
    causes = (("clubhead", law),)
    return replace(model, entries=(*model.entries, entry), causes=causes), np.append(x, stiffness)


@pytest.mark.parametrize(("which", "stiffness"), [(60, 0.0), (200, 0.0), (60, 40.0), (200, 40.0)])
def test_the_error_of_one_told_sample_moves_the_sensors_as_that_sample_does(
    driven, which, stiffness
):
    """So it does where a law is in force that shifts the resonance."""
    model, x = driven
    if stiffness:
        bare = model.predict(x)
        model, x = held_by_a_spring(model, x, stiffness)
        assert any(np.ptp(told - bare[key]) > 0 for key, told in model.predict(x).items())
    prepared = next(p for p in model.problem.records if p.record.test == "driven")
    part = drive_allowances(model, x)[prepared.name][0]
    channel = prepared.record.channel(prepared.drives[0])
    times = channel.start_time + np.arange(len(channel.values)) / channel.sample_rate
    begin = prepared.start / prepared.record.sample_rate
    end = begin + (len(prepared.inputs) - 1) * prepared.step
    near = np.flatnonzero((times > begin - 8 / 250) & (times < end + 8 / 250))
    which = int(near[0]) + which % (len(near) - 30) + 15
    size, values = 1e-3, channel.values.copy()
    values[which] += size
    other = replace(channel, values=values)
    record = replace(
        prepared.record,
        channels=tuple(other if c is channel else c for c in prepared.record.channels),
    )
    moved = make_problem([record], model.problem.rig)
    still = make_problem([prepared.record], model.problem.rig)
    for index, sensor in enumerate(prepared.sensors):
        key = prepared.name, sensor.channel.name
        seen = [replace(model, problem=one).predict(x)[key] for one in (moved, still)]
        change = (seen[0] - seen[1]) / size
        column = part.columns[index][:, which - int(near[0])]
        assert column[: len(change)] == pytest.approx(change, abs=1e-6 * np.abs(change).max()), key


def test_starts_are_bound_by_the_model_as_it_is_now(driven):
    """Bound once, before a law was in force, they stood 13 standard deviations off the truth."""
    model, x = driven
    far = x * np.where([e.slot == "numbers" for e in model.entries], 1.3, 1.0)
    once, begun = with_known_starts(model, x)
    anew, again = with_known_starts(with_known_starts(model, far)[0], x)
    names = {p.name for p in model.problem.records if not p.free}
    which = [i for i, e in enumerate(once.entries) if e.slot == "start" and e.record in names]
    bound = [i for i in which if once.entries[i].prior < model.entries[i].prior]
    assert bound
    for i in bound:
        assert anew.entries[i].prior == pytest.approx(once.entries[i].prior, rel=1e-3)
        gap = anew.entries[i].center - once.entries[i].center
        assert abs(gap) < 1e-2 * once.entries[i].prior
        assert begun[i] * once.entries[i].scale == pytest.approx(once.entries[i].center)
    others = [i for i in range(len(x)) if i not in which]
    assert [once.entries[i] for i in others] == [model.entries[i] for i in others]
    np.testing.assert_array_equal(again[others], x[others])


def test_a_feedback_too_fast_for_single_samples_gets_a_smooth_error(driven):
    model, x = driven
    prepared = next(p for p in model.problem.records if p.record.test == "driven")
    channel = prepared.record.channel(prepared.drives[0])
    rate, grid = 4000.0, np.arange(prepared.count) * prepared.step
    fast = replace(
        channel,
        values=np.interp(np.arange(2000) / rate, grid, prepared.inputs[: prepared.count, 0]),
        sample_rate=rate,
        start_time=0.0,
        noise=1e-4,
    )
    others = tuple(fast if c.name == channel.name else c for c in prepared.record.channels)
    record = replace(prepared.record, channels=others)
    problem = make_problem([record], model.problem.rig)
    part = drive_allowances(replace(model, problem=problem), x)[record.name][0]
    assert len(part.kinds) == MOST_ERRORS
    apart = (problem.records[0].count - 1) * prepared.step / (MOST_ERRORS - 4)
    # of all bumps the same average: so many samples of such noise are one number
    assert part.priors[0] == pytest.approx(1e-4 * np.sqrt(1 / (rate * apart) / 0.5), rel=1e-9)


def test_a_clock_moves_the_sensors_as_a_late_input_does(driven):
    model, x = driven
    prepared = next(p for p in model.problem.records if p.record.test == "driven")
    parts = drive_allowances(model, x)[prepared.name]
    clock = next(part for part in parts if part.kinds == ("delay",))
    assert clock.priors[0] == pytest.approx(2e-4)
    late, grid = 1e-4, np.arange(len(prepared.inputs)) * prepared.step
    inputs = np.interp(grid - late, grid, prepared.inputs[:, 0])[:, None]
    records = [replace(prepared, inputs=inputs), prepared]
    models = [replace(model, problem=replace(model.problem, records=(r,))) for r in records]
    for index, sensor in enumerate(prepared.sensors):
        if sensor.port.quantity == "acceleration":
            continue  # straight lines between samples kink the shifted angle
        key = prepared.name, sensor.channel.name
        change = (models[0].predict(x)[key] - models[1].predict(x)[key]) / late
        column = clock.columns[index][:, 0]
        assert column == pytest.approx(change, abs=0.03 * np.abs(change).max()), key


def test_the_noise_of_a_feedback_is_at_least_its_rounding(driven):
    model, _ = driven
    channel = next(c for p in model.problem.records for c in p.record.inputs)
    step = np.radians(0.01)
    assert step / np.sqrt(12) * 0.99 < told_noise(channel) < step
    rng = np.random.default_rng(1)
    times = np.arange(500) / 250.0
    noisy = replace(channel, values=np.sin(9 * times) + 1e-3 * rng.standard_normal(500))
    assert told_noise(noisy) == pytest.approx(1e-3, rel=0.15)
    assert told_noise(replace(channel, noise=0.5)) == 0.5


def test_a_lever_feels_the_turn(driven):
    model, x = driven
    found = lever_allowances(model, x)
    prepared = next(p for p in model.problem.records if p.name in found)
    at = next(i for i, s in enumerate(prepared.sensors) if s.port.place == "clubhead")
    part = found[prepared.name]
    assert np.all(part.priors == LEVER)
    # a sensor further out feels more of the collet's turn: the lever's own column
    column = part.columns[at][:, 0]
    encoder = next(s for s in prepared.sensors if s.port.place == "collet")
    turned = model.predict(x)[prepared.name, encoder.channel.name]
    order = {"position": 0, "velocity": 1, "acceleration": 2}[prepared.sensors[at].port.quantity]
    rate = encoder.channel.sample_rate
    slow = np.interp(encoder.times, prepared.sensors[at].times, column)
    for _ in range(order):
        turned = np.gradient(turned, 1 / rate)
    inner = slice(10, -10)
    assert np.corrcoef(slow[inner], turned[inner])[0, 1] > 0.98


def test_a_tone_that_rings_on_is_heard_and_summed_out(driven):
    model, _ = driven
    prepared = model.problem.records[-1]
    free = replace(prepared, free=True)
    model = replace(model, problem=replace(model.problem, records=(free,)))
    rng = np.random.default_rng(3)
    gaps = {}
    for sensor in free.sensors:
        key = free.name, sensor.channel.name
        std = model.noises[key].marginal_std
        gaps[key] = std * rng.standard_normal(len(sensor.values))
    assert find_ringing(model, gaps) is None
    for sensor in free.sensors:
        key = free.name, sensor.channel.name
        if sensor.channel.sample_rate < 1000:
            continue
        since = sensor.times - sensor.times[0]
        tone = np.exp(-0.05 * 2 * np.pi * 55 * since) * np.cos(2 * np.pi * 55 * since + 0.4)
        gaps[key] = gaps[key] + 4 * model.noises[key].marginal_std * tone
    heard = find_ringing(model, gaps)
    assert heard is not None
    assert heard.frequency == pytest.approx(55.0, abs=1.0)
    assert heard.ratio == pytest.approx(0.05, rel=0.35)
    part = ringing_allowances(model, heard)[free.name]
    columns = [
        model.noises[free.name, s.channel.name].whiten(block)
        for s, block in zip(free.sensors, part.columns, strict=True)
    ]
    white = [
        model.noises[free.name, s.channel.name].whiten(gaps[free.name, s.channel.name])
        for s in free.sensors
    ]
    stacked = np.concatenate(white)
    left = marginal_of(part, np.concatenate(columns)).apply(stacked)
    assert np.sum(left**2) < np.sum(stacked**2) - 0.9 * heard.gain


def test_a_start_that_is_not_fitted_yet_is_no_ringing(driven):
    model, _ = driven
    free = replace(model.problem.records[-1], free=True)
    model = replace(model, problem=replace(model.problem, records=(free,)))
    gaps = {}
    for sensor in free.sensors:
        since = sensor.times - sensor.times[0]
        faded = np.exp(-0.7 * 2 * np.pi * 55 * since) * np.cos(2 * np.pi * 55 * since + 0.4)
        key = free.name, sensor.channel.name
        gaps[key] = 10 * model.noises[key].marginal_std * faded
    assert find_ringing(model, gaps) is None


def test_a_model_with_an_allowance_has_the_slope_of_its_residual(driven):
    model, x = driven
    parts = drive_allowances(model, x)
    open_ = {name: joined(some) for name, some in parts.items()}
    wide = replace(model, allowances={n: a for n, a in open_.items() if a is not None})
    slope = wide.jacobian(x)
    for index in (0, len(x) - 1):
        step = np.zeros(len(x))
        step[index] = 1e-5
        change = (wide.residual(x + step) - wide.residual(x - step)) / 2e-5
        assert slope[:, index] == pytest.approx(change, abs=1e-4 * np.abs(change).max())
    assert np.sum(wide.residual(x) ** 2) < np.sum(model.residual(x) ** 2)
    fit = solve(wide, x, 0)
    assert set(fit.estimates) == set(wide.allowances)


def test_what_goes_beyond_its_tolerance_is_a_finding():
    rng = np.random.default_rng(0)
    kinds = ("drive",) * 200 + ("delay", "lever", "ringing")
    allowance = Allowance(kinds, (np.zeros((3, 203)),), np.ones(203))
    calm = used("r", allowance, np.append(rng.standard_normal(200), [1.0, 2.0, 90.0]))
    assert [one.kind for one in calm] == ["drive", "delay", "lever", "ringing"]
    assert not any(one.beyond for one in calm)
    loud = used("r", allowance, np.append(3 * rng.standard_normal(200), [5.0, -4.5, 0.0]))
    assert [one.beyond for one in loud] == [True, True, True, False]
    one = used("r", allowance, np.append(np.zeros(199), [9.0, 0.0, 0.0, 0.0]))[0]
    assert one.largest == 9.0 and not one.beyond, "one knot of many may be far off"


def test_a_lagging_drive_is_felt_by_every_channel(driven):
    model, x = driven
    law, lag_time = library()["servo_lag"], 0.02
    entry = Entry("drive/servo_lag", "fault", ("drive", law.name, ""), None, 0.0, scale=lag_time)
    late = replace(model, entries=(*model.entries, entry), causes=(("drive", law),))
    told = [p for p in model.problem.records if told_motion(p)]
    assert told
    rest = [i for i, e in enumerate(model.entries) if e.slot == "start"]
    still = x.copy()
    still[rest] = 0.0
    for prepared in told:
        inputs = prepared.inputs.copy()
        inputs[:, 0] = lag(weights(prepared.step / lag_time)[0], inputs[:, 0], inputs[0, 0])
        moved = replace(prepared, inputs=inputs)
        problem = replace(model.problem, records=(moved,))
        seen = replace(model, problem=problem).predict(still)
        found = late.predict(np.append(still, 1.0))
        before = model.predict(still)
        for sensor in prepared.sensors:
            key = prepared.name, sensor.channel.name
            change = np.max(np.abs(seen[key] - before[key]))
            # readings between slow samples are joined by straight lines
            share = 0.02 if sensor.step < 0.001 else 0.1
            assert found[key] == pytest.approx(seen[key], abs=share * change), key
    point, step = np.append(still, 1.0), np.zeros(len(x) + 1)
    step[-1] = 1e-4
    slope = (late.residual(point + step) - late.residual(point - step)) / 2e-4
    column = late.jacobian(point)[:, -1]
    assert column == pytest.approx(slope, abs=1e-5 * np.abs(slope).max())
