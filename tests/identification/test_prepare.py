"""From a record to the arrays of a fit: window, foreign clocks, padding, shortening."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st

from supple.identification.prepare import (
    Prepared,
    bucket,
    driven_by_force,
    opening,
    prepare,
    prepare_all,
    sampling_matrix,
    shortened,
)
from supple.identification.problem import base_entries, make_problem
from supple.identification.records import Channel, Record, read_record
from supple.identification.window import begins_at_rest
from supple.model.mechanism import mechanism_of
from supple.model.rig import read_rig

RATE, COUNT, HOLD = 100.0, 900, 80
TIMES = np.arange(COUNT) / RATE
OMEGA = 2 * np.pi * 2.0
AFTER = np.maximum(TIMES - HOLD / RATE, 0.0)
DECAY = np.exp(-0.3 * AFTER) * np.cos(OMEGA * AFTER)

RIG = """\
[rig]
kind = "chain"
[masses.cart]
mass = 0.5
[links.spring]
between = ["ground", "cart"]
stiffness = { value = 80.0, free = true }
damping = 0.1
"""

SIDECAR = """\
[record]
file = "bench.csv"
test = "decay"
rig = "rig.toml"
sample_rate = 100.0
[channels.cart]
column = "x"
unit = "m"
role = "response"
quantity = "position"
place = "cart"
"""

PUSH = """\
[channels.push]
column = "f"
unit = "N"
role = "input"
quantity = "force"
place = "cart"
"""

FOREIGN = """\
[channels.camera]
column = "y"
unit = "m"
role = "response"
quantity = "position"
place = "cart"
file = "camera.csv"
time = "t"
clock_offset = 0.0123
"""


def lay_out(
    folder: Path, x: np.ndarray = DECAY, f: np.ndarray | None = None, more: str = ""
) -> Record:
    """Write and read one record of the cart."""
    (folder / "rig.toml").write_text(RIG)
    push = np.zeros(len(x)) if f is None else f
    rows = [f"{a:.12g},{b:.12g}" for a, b in zip(x, push, strict=True)]
    (folder / "bench.csv").write_text("\n".join(["x,f", *rows]) + "\n")
    text = SIDECAR + (PUSH if f is not None else "") + more
    (folder / "bench.toml").write_text(text)
    return read_record(folder / "bench.toml")


def prepared(record: Record) -> Prepared:
    """The record as a fit of its rig sees it."""
    assert record.rig_path is not None
    rig = read_rig(record.rig_path)
    numbers = {name: number.value for name, number in rig.parameters.items()}
    return prepare(record, mechanism_of(rig), numbers)


def test_a_decay_counts_from_its_first_crossing_of_rest(tmp_path):
    found = prepared(lay_out(tmp_path))
    assert found.start == pytest.approx(HOLD + RATE / 8, abs=3)
    assert "let go by hand" in found.reason and found.free and not found.at_rest
    assert found.sensors[0].values[0] == pytest.approx(DECAY[found.start])
    assert found.frequency == pytest.approx(2.0, rel=0.02)
    assert found.opening == pytest.approx(1.5, rel=0.05), "three periods"


def test_a_release_that_the_sidecar_tells_is_believed(tmp_path):
    found = prepared(lay_out(tmp_path, more="[start]\nat = 0.8\n"))
    assert found.start == HOLD and "as the sidecar says" in found.reason


def test_what_has_faded_is_left_out(tmp_path):
    fast = np.exp(-3.0 * TIMES) * np.cos(OMEGA * TIMES) + 1e-3 * np.sin(0.3 * TIMES)
    found = prepared(lay_out(tmp_path, fast))
    left = np.max(np.abs(fast[found.start + found.count :]))
    assert found.start + found.count < COUNT / 2
    assert left < 0.06 * np.max(np.abs(fast[found.start :]))
    slow = prepared(lay_out(tmp_path, np.exp(-0.05 * TIMES) * np.cos(OMEGA * TIMES)))
    assert slow.start + slow.count == COUNT


def test_a_driven_record_is_used_whole_with_its_input_on_the_grid(tmp_path):
    force = np.sin(2 * np.pi * 0.7 * TIMES)
    moved = 0.01 * np.minimum(1.0, TIMES / 3.0) ** 2 * np.sin(2 * np.pi * 0.7 * TIMES)
    found = prepared(lay_out(tmp_path, moved, force))
    assert (found.start, found.count) == (0, COUNT) and not found.free and found.at_rest
    assert driven_by_force(found)
    assert found.inputs.shape == (bucket(COUNT), 1)
    assert found.inputs[:COUNT, 0] == pytest.approx(force, abs=1e-11)
    assert np.all(found.inputs[COUNT:, 0] == found.inputs[COUNT - 1, 0])
    thrown = prepared(lay_out(tmp_path, 0.01 * np.sin(2 * np.pi * 0.7 * TIMES), force))
    assert not thrown.at_rest


@given(
    position=st.lists(st.floats(0.0, 39.0), min_size=1, max_size=30),
    weights=st.lists(st.floats(-1.0, 1.0), min_size=6, max_size=6),
)
def test_sampling_between_grid_points_is_exact_for_polynomials(position, weights):
    at, grid = np.array(position), np.arange(40.0)
    matrix = sampling_matrix(at, 40)
    assert matrix.shape == (len(at), 40)
    wanted, seen = (np.polyval(weights, x / 40.0) for x in (at, grid))
    assert matrix @ seen == pytest.approx(wanted, abs=1e-10)
    assert matrix @ np.ones(40) == pytest.approx(np.ones(len(at)), abs=1e-12)


def test_sampling_at_grid_points_takes_just_those():
    at = np.array([0.0, 1.0, 7.0, 38.0, 39.0])
    matrix = sampling_matrix(at, 40).toarray()
    assert matrix == pytest.approx(np.eye(40)[at.astype(int)], abs=1e-12)


def test_a_sensor_of_another_clock_is_sampled_where_it_looked(tmp_path):
    own = np.arange(0, 260) / 30.0
    rows = [f"{t:.10f},{np.cos(OMEGA * (t + 0.0123)):.12f}" for t in own]
    (tmp_path / "camera.csv").write_text("\n".join(["t,y", *rows]) + "\n")
    record = lay_out(tmp_path, np.cos(OMEGA * TIMES), more=FOREIGN + "[start]\nat = 0.5\n")
    found = prepared(record)
    near, far = found.sensors
    assert near.sampling is None and far.sampling is not None
    assert far.sampling.shape == (len(far.values), bucket(found.count))
    grid = np.zeros(bucket(found.count))
    grid[: found.count] = np.cos(OMEGA * (0.5 + np.arange(found.count) / RATE))
    assert far.sampling @ grid == pytest.approx(far.values, abs=1e-6)
    assert np.cos(OMEGA * (0.5 + far.times)) == pytest.approx(far.values, abs=1e-9)
    short = shortened(found, 200)
    part = short.sensors[1]
    assert part.sampling is not None and len(part.values) < len(far.values)
    assert part.times[-1] <= 200 * short.step
    assert part.sampling @ grid[: bucket(200)] == pytest.approx(part.values, abs=1e-6)


ROBOT = """\
[channels.push]
column = "y"
unit = "N"
role = "input"
quantity = "force"
place = "cart"
file = "robot.csv"
time = "t"
"""


@pytest.mark.parametrize(("rests", "left"), [(False, 601), (True, COUNT)])
def test_a_record_ends_where_its_drive_is_no_longer_told(tmp_path, rests, left):
    own = np.arange(0.0, 6.001, 0.04)
    told = np.sin(3.0 * own) * (np.minimum(1.0, np.maximum(5.5 - own, 0.0)) if rests else 1.0)
    rows = [f"{t:.10f},{y:.12f}" for t, y in zip(own, told, strict=True)]
    (tmp_path / "robot.csv").write_text("\n".join(["t,y", *rows]) + "\n")
    text = SIDECAR.replace('"decay"', '"driven"') + ROBOT
    lay_out(tmp_path, 0.01 * np.sin(3.0 * TIMES))
    (tmp_path / "bench.toml").write_text(text)
    assert prepared(read_record(tmp_path / "bench.toml")).count == left


def test_a_blow_that_nobody_recorded_is_followed_from_where_it_struck(tmp_path):
    """No sample counts before it has rung out, but laws remember from its very beginning on."""

    def found(test: str, more: str = "[start]\nat = 0.797\n") -> Prepared:
        lay_out(tmp_path, more=more)
        text = (tmp_path / "bench.toml").read_text().replace('"decay"', f'"{test}"')
        (tmp_path / "bench.toml").write_text(text)
        return prepared(read_record(tmp_path / "bench.toml"))

    struck = found("impact")
    assert struck.since == 1 / RATE and struck.start == HOLD
    assert struck.sensors[0].times[0] == pytest.approx(0.03), "three samples at least"
    assert struck.sensors[0].values[0] == pytest.approx(DECAY[HOLD + 3])
    assert found("decay").since == 0.0 and found("impact", "").since == 0.0
    early = found("decay", "[start]\nat = -0.5\n")
    assert "let go by hand" in early.reason and early.start > HOLD


CLUB = """\
[rig]
kind = "robot"
model = "fixed_collet"
fidelity = "thesis"
preset = "robo_v"
[parameters]
shaft_stiffness = { value = 140.0, free = true }
"""


@pytest.mark.parametrize(("test", "calm"), [("decay", 0.015), ("impact", 0.06)])
def test_a_club_is_followed_from_where_it_was_let_go_or_struck(tmp_path, test, calm):
    lay_out(tmp_path)
    text = SIDECAR.replace('"decay"', f'"{test}"').replace('"cart"', '"clubhead"')
    text += 'frame = "absolute"\n[start]\nat = 0.8\n'
    (tmp_path / "bench.toml").write_text(text.replace("100.0", "1000.0"))
    (tmp_path / "rig.toml").write_text(CLUB)
    problem = make_problem([read_record(tmp_path / "bench.toml")], read_rig(tmp_path / "rig.toml"))
    (seen,) = problem.records
    assert seen.start == 800 and seen.sensors[0].times[0] == pytest.approx(calm)
    assert f"{1e3 * calm:.0f} ms after" in seen.reason
    starts = [e for e in base_entries(problem) if e.slot == "start"]
    assert {e.name.split(".")[1] for e in starts} == {"start", "start_velocity"}
    for entry in starts:  # struck it stands where it hung, let go it has no speed yet
        rests = ("velocity" in entry.name) == (test == "decay")
        assert entry.prior == pytest.approx((0.1 if rests else 10.0) * entry.scale)


@given(st.integers(1, 2_000_000))
def test_a_bucket_holds_its_records_with_little_air(count):
    size = bucket(count)
    assert size >= count and size >= 512
    assert size <= max(512, 2 * count)
    assert count < 2048 or size <= 1.34 * count


def test_few_buckets_are_ever_compiled():
    sizes = {bucket(count) for count in range(1, 300_000, 97)}
    assert len(sizes) <= 36
    assert all(size % 128 == 0 for size in sizes)


def test_the_first_part_of_a_record(tmp_path):
    whole = prepared(lay_out(tmp_path))
    part = shortened(whole, 300)
    assert part.count == 300 and part.inputs.shape[0] == bucket(300)
    assert np.array_equal(part.sensors[0].values, whole.sensors[0].values[:300])
    assert shortened(whole, whole.count) is whole
    first = opening(whole)
    assert first.count * first.step == pytest.approx(whole.opening, abs=3 * whole.step)


def test_records_of_one_rig_are_prepared_alike(tmp_path):
    record = lay_out(tmp_path, more='[parameters]\n"masses.cart.mass" = 0.4\n')
    rig = read_rig(tmp_path / "rig.toml")
    both = prepare_all([record, record], mechanism_of(rig), {"masses.cart.mass": 0.5} | {
        name: number.value for name, number in rig.parameters.items()
    })  # fmt: skip
    assert [p.numbers for p in both] == [{"masses.cart.mass": 0.4}] * 2


def test_records_with_and_without_a_drive_share_one_plant(tmp_path):
    free = lay_out(tmp_path)
    push = replace(
        free.responses[0], name="push", role="input", quantity="force", unit="N", held=True
    )
    driven = replace(free, channels=(*free.channels, push))
    short = replace(free, channels=tuple(cut(channel, 600) for channel in free.channels))
    numbers = {n: number.value for n, number in read_rig(tmp_path / "rig.toml").parameters.items()}
    alone, pushed, brief = prepare_all(
        [free, driven, short], mechanism_of(read_rig(tmp_path / "rig.toml")), numbers
    )
    assert alone.ports == pushed.ports == brief.ports
    assert (alone.drives, pushed.drives) == (("",), ("push",))
    assert alone.free and not pushed.free
    assert not alone.inputs.any() and pushed.inputs.any()
    assert alone.inputs.shape == pushed.inputs.shape == brief.inputs.shape
    assert brief.count < alone.count


def test_a_moving_ground_moves_on_beyond_its_record(tmp_path):
    free = lay_out(tmp_path)
    values = np.linspace(0.0, 0.3, len(free.responses[0].values))
    moved = replace(free.responses[0], name="ground", role="input", place="ground", values=values)
    record = replace(free, channels=(*free.channels, moved), start={})
    found = prepared(record)
    beyond = found.inputs[found.count - 2 :, 0]
    assert len(beyond) > 4 and np.ptp(np.diff(beyond)) < 1e-12 < np.diff(beyond)[0]


def cut(channel: Channel, count: int) -> Channel:
    """The first `count` samples of a channel."""
    return replace(channel, values=channel.values[:count])


def test_a_record_too_short_after_its_release_is_refused(tmp_path):
    record = lay_out(tmp_path)
    late = replace(record, start={"at": (COUNT - 10) / RATE})
    with pytest.raises(ValueError, match=r"bench\.toml: expected at least 16 .* found 10.* Mend: "):
        prepared(late)
    deaf = replace(record, channels=())
    with pytest.raises(ValueError, match=r"at least one with role = 'response'.*Mend: "):
        prepared(deaf)


def test_a_club_that_has_not_rung_out_is_refused_and_one_that_fades_soon_is_not_cut(tmp_path):
    def problem(at: float, x: np.ndarray = DECAY) -> Prepared:
        lay_out(tmp_path, x)
        text = SIDECAR.replace('"decay"', '"impact"').replace('"cart"', '"clubhead"')
        text += f'frame = "absolute"\n[start]\nat = {at}\n'
        (tmp_path / "bench.toml").write_text(text.replace("100.0", "2000.0"))
        (tmp_path / "rig.toml").write_text(CLUB)
        record = read_record(tmp_path / "bench.toml")
        return make_problem([record], read_rig(tmp_path / "rig.toml")).records[0]

    with pytest.raises(ValueError, match=r"at least 16 samples after the release, found 0\. Mend"):
        problem(0.42)
    soon = np.exp(-10.0 * AFTER) * np.cos(100.0 * AFTER)  # gone before the 60 ms are over
    seen = problem(HOLD / 2000.0, soon)
    assert len(seen.sensors[0].values) >= 60


def test_a_channel_of_few_samples_says_nothing_of_its_noise():
    assert begins_at_rest(
        [("position", np.append(np.zeros(5), [0.2, 0.5]))], [("angle", np.zeros(3))]
    )
    assert begins_at_rest([], [("angle", np.array([0.0, 0.0, 0.0, 0.0, 0.1]))])


@pytest.mark.parametrize("seed", range(5))
def test_noise_is_no_motion_that_a_record_begins_with(seed):
    """A gauge of 2 kHz shows more speed in its noise than a club of 3 Hz has."""
    rng = np.random.default_rng(seed)
    times, slow = np.arange(4096) / 2048.0, np.arange(500) / 250.0
    gauge = 0.1 * np.sin(19.0 * np.maximum(times - 0.2, 0.0)) + rng.normal(0, 2e-3, 4096)
    swung = np.maximum(slow - 0.2, 0.0)
    angle = 0.08 * np.sin(16.0 * swung) * np.minimum(2.0 * swung, 1.0)
    angle = angle + rng.normal(0, 6e-5, 500)
    assert begins_at_rest([("deflection", gauge)], [("angle", angle)])
    assert not begins_at_rest([("deflection", gauge)], [("angle", angle + 0.02 * slow)])
    moves = 0.1 * np.sin(19.0 * times) + rng.normal(0, 2e-3, 4096)
    assert not begins_at_rest([("deflection", moves)], [("angle", angle)])


def test_what_is_pushed_from_its_first_sample_on_begins_at_rest():
    """A carriage that takes 6 s for its way moves by an eighth of its speed after 124 ms."""
    times = np.arange(24841) / 1000.0
    way = 0.12 * (1.0 - np.cos(2 * np.pi / 6.2 * times))
    noise = np.random.default_rng(1).normal(0, 1e-8, len(way))
    force = [("force", 90.0 * np.cos(2 * np.pi / 6.2 * times))]
    assert begins_at_rest([("position", way + noise)], force)
    assert not begins_at_rest([("position", way[400:] + noise[400:])], force)


def test_a_swings_window_that_begins_slowly_does_not_begin_at_rest():
    """What an impact makes small is not still: told motions must begin still, forces need not."""
    times = np.linspace(0.0, 1.0, 400)
    swing = ("acceleration", np.exp(6.0 * (times - 1.0)) ** 2)
    still = ("angle", 2.0 * np.maximum(times - 0.02, 0.0) ** 2)
    moving = ("angle", 0.01 * times + still[1])
    assert begins_at_rest([swing])
    assert begins_at_rest([swing], [still])
    assert not begins_at_rest([swing], [still, moving])
    assert not begins_at_rest([swing], [("angular_velocity", 0.01 + times)])
    for quantity in ("force", "torque", "acceleration"):
        assert begins_at_rest([swing], [(quantity, 1.0 - times)])
    assert not begins_at_rest([("acceleration", np.cos(40.0 * times))], [still])
