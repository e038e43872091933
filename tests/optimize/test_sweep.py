"""A sweep: against stepping by matrix exponentials, the model's scores, and closed forms."""

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given, settings, strategies as st

from supple.model import score
from supple.model.chain import Chain
from supple.model.drives import impact, release, torque, wave
from supple.model.linear import Mechanism, Port, modes, state_space
from supple.model.motion import respond, respond_batch
from supple.model.ringdown import after_impulse
from supple.model.robot import PRESETS, Robot
from supple.optimize import sweep as sweeping
from supple.optimize.sweep import Axis, SweepTask, blank_sheet, sweep

NUMBERS = PRESETS["robo_v_sleeve_50"]
ROBOT = Robot("pinned_wrist", tuple(NUMBERS))
SENSOR = Port("clubhead", "acceleration", "collet")
GRIP = Port("grip", "position", "collet")
BLOW = impact("clubhead", -1600.0, 0.0, 0.005)
TIMES = np.arange(2000) / 1000.0
WINDOW = (0.005, 2.0)
AXES = (
    Axis("wrist_stiffness", 50.0 + 150.0 * np.arange(5), "N m/rad"),
    Axis("wrist_damping", np.array([2.0, 6.0, 20.0, 80.0]), "N m s/rad"),
    Axis("sleeve_damping", np.array([100.0, 1470.0, 12e3]), "N s/m"),
)
SAMPLED = ("rms", "log_decrement", "log_decrement_local", "peak", "settling")

CART = Chain(("cart",), (("spring", "ground", "cart"),))
CART_NUMBERS = {
    "masses.cart.mass": 0.5,
    "links.spring.stiffness": 200.0,
    "links.spring.damping": 0.3,
}
CRITICAL = 2 * np.sqrt(200.0 * 0.5)


def task(
    drive=BLOW, scores=SAMPLED, axes=AXES, mechanism: Mechanism = ROBOT, numbers=NUMBERS, **others
):
    told = {"times": TIMES, "window": WINDOW, "sensor": SENSOR} | others
    return SweepTask(mechanism, numbers, drive, scores=scores, axes=axes, **told)


def carts(damping, scores=SAMPLED):
    axes = (Axis("links.spring.damping", np.asarray(damping, float), "N s/m"),)
    return task(
        release("cart", 0.1), scores, axes, CART, CART_NUMBERS,
        sensor=Port("cart", "position"), times=np.arange(1000) / 500.0, window=(0.0, 2.0),
    )  # fmt: skip


def stepped(asked: SweepTask, at: int) -> np.ndarray:
    """Samples of one design under a force with jumps, by matrix exponentials between events."""
    numbers = {name: float(v[0]) for name, v in asked.numbers_of(np.array([at])).items()}
    sensors = (asked.sensor, GRIP)
    space = state_space(asked.mechanism, {**asked.numbers, **numbers}, asked.drive.ports, sensors)
    a, b, c, d = (np.asarray(one) for one in (space.a, space.b, space.c, space.d))
    size = len(a)
    whole = np.zeros((size + 1, size + 1))
    whole[:size, :size], whole[:size, size] = a, b[:, 0]
    known: dict[float, np.ndarray] = {}
    x, now, found = np.zeros(size + 1), 0.0, []
    jumps = list(zip(asked.drive.edges, asked.drive.levels))
    for time in asked.times:
        stops = [jump for jump in jumps if jump[0] <= time + 1e-12]
        jumps = jumps[len(stops) :]
        for stop, level in [*stops, (time, None)]:
            span = round(stop - now, 13)
            if span > 0:
                if span not in known:
                    known[span] = scipy.linalg.expm(whole * span)
                x, now = known[span] @ x, stop
            x[size] = x[size] if level is None else level
        found.append(c @ x[:size] + d[:, 0] * x[size])
    return np.array(found)


@pytest.mark.parametrize(
    "drive",
    [BLOW, impact("clubhead", -1600.0, 0.0103, 0.00052), torque("wrist", (0.0, 0.5), (3.0, -1.0))],
    ids=["on samples", "between samples", "torque"],
)
def test_every_score_is_that_of_an_independent_integration(drive):
    asked = task(drive, (*SAMPLED, "grip_displacement_peak"))
    found = sweep(asked)
    inside = (TIMES >= WINDOW[0]) & (TIMES <= WINDOW[1])
    for at in np.random.default_rng(5).choice(asked.count, 3, replace=False):
        samples = stepped(asked, int(at))[inside]
        got = {name: values.ravel()[at] for name, values in found.scores.items()}
        seen = samples[:, 0]
        assert got["rms"] == pytest.approx(np.sqrt(np.mean(seen**2)), rel=1e-8)
        assert got["peak"] == pytest.approx(np.abs(seen).max(), rel=1e-8)
        grip = np.abs(samples[:, 1]).max()
        assert got["grip_displacement_peak"] == pytest.approx(grip, rel=1e-8)
        for name in ("log_decrement", "log_decrement_local", "settling"):
            expected = float(score.SCORES[name](seen, TIMES[inside]))
            assert got[name] == pytest.approx(expected, rel=1e-6, nan_ok=True)


@pytest.mark.parametrize(
    "drive",
    [
        BLOW,
        release("clubhead", 0.15, "collet"),
        torque("wrist", (0.0, 0.3, 0.31, 1.0), (3.0, -3.0, 1.0, 0.0)),
        wave("wrist", "square", 1.0, 0.1, 0.0, 2.0),
        wave("wrist", "sine", 1.0, 0.5, 0.0, 2.0),
    ],
    ids=["impact", "release", "torque", "many jumps", "sine"],
)
def test_scores_are_those_of_the_model(drive):
    names = ("rms", "peak") if drive.frequency or len(drive.edges) > 16 else SAMPLED
    asked = task(drive, names)
    found = sweep(asked)
    designs = np.arange(asked.count)
    table = dict(NUMBERS) | asked.numbers_of(designs)
    samples = respond_batch(ROBOT, table, drive, TIMES, (SENSOR,))[:, :, 0]
    for name in names:
        expected = np.asarray(score.SCORES[name](samples, TIMES, WINDOW))
        assert found.scores[name].ravel() == pytest.approx(expected, rel=1e-7, nan_ok=True), name


def test_the_modal_decrement_is_that_of_the_model():
    found = sweep(task(scores=("log_decrement_modal",)))
    asked = found.task
    for at in range(0, asked.count, 7):
        own = {name: float(v[0]) for name, v in asked.numbers_of(np.array([at])).items()}
        free = after_impulse(ROBOT, NUMBERS | own, Port("clubhead", "force"), 8.0, SENSOR)
        expected = float(score.modal_decrement(free))
        assert found.scores["log_decrement_modal"].ravel()[at] == pytest.approx(expected, rel=1e-8)


def test_the_dominant_mode_is_one_of_the_models():
    found = sweep(task(scores=("rms",)))
    at = found.task.count - 1
    own = {name: float(v[0]) for name, v in found.task.numbers_of(np.array([at])).items()}
    known = modes(ROBOT, NUMBERS | own)
    gap = np.abs(known.damped_frequencies - found.dominant_frequency.ravel()[at])
    near = int(np.argmin(gap))
    assert gap[near] < 1e-8
    ratio = found.dominant_damping_ratio.ravel()[at]
    assert ratio == pytest.approx(known.damping_ratios[near], rel=1e-8)


def test_designs_lie_on_the_grid_with_the_last_axis_fastest():
    asked = task()
    grid = np.meshgrid(*(axis.values for axis in AXES), indexing="ij")
    found = asked.numbers_of(np.arange(asked.count))
    for axis, values in zip(AXES, grid):
        np.testing.assert_array_equal(found[axis.name], values.ravel())


@settings(max_examples=15, deadline=None)
@given(
    stiffness=st.floats(20.0, 5e3),
    damping=st.floats(0.5, 200.0),
    inertia=st.floats(0.002, 0.076),
    sleeve=st.floats(100.0, 12e3),
)
def test_any_design_is_that_of_a_single_simulation(stiffness, damping, inertia, sleeve):
    own = {
        "wrist_stiffness": stiffness,
        "wrist_damping": damping,
        "collet_inertia": inertia,
        "sleeve_damping": sleeve,
    }
    axes = tuple(Axis(name, np.array([value])) for name, value in own.items())
    found = sweep(task(axes=axes, scores=("rms", "peak")))
    motion = respond(ROBOT, NUMBERS | own, BLOW, TIMES, (SENSOR,)).samples[:, 0]
    for name in ("rms", "peak"):
        expected = float(score.SCORES[name](motion, TIMES, WINDOW))
        assert found.scores[name].ravel()[0] == pytest.approx(expected, rel=1e-8)


def cart_motion(damping: float, times: np.ndarray) -> np.ndarray:
    """Closed form of a cart let go at 0.1 m."""
    natural = np.sqrt(200.0 / 0.5)
    ratio = damping / CRITICAL
    if ratio == 1.0:
        return 0.1 * (1 + natural * times) * np.exp(-natural * times)
    root = natural * np.sqrt(complex(ratio**2 - 1.0))
    decay = ratio * natural
    return 0.1 * np.real(
        np.exp(-decay * times) * (np.cosh(root * times) + decay / root * np.sinh(root * times))
    )


def test_equal_poles_overdamped_and_repeated_designs_follow_the_closed_form():
    shares = [0.0, 0.5, 1 - 1e-4, 1 - 1e-8, 1.0, 1.0, 1 + 1e-8, 1.0 + 1e-4, 2.0, 2.0]
    found = sweep(carts(CRITICAL * np.array(shares), ("rms", "peak")))
    times = found.task.times
    for k, share in enumerate(shares):
        near = 1.0 if abs(share - 1.0) < 1e-6 else share  # there the closed form loses digits
        expected = np.sqrt(np.mean(cart_motion(near * CRITICAL, times) ** 2))
        rel = 1e-7 if near != share else 1e-9
        assert found.scores["rms"][k] == pytest.approx(expected, rel=rel)
    assert found.scores["rms"][4] == found.scores["rms"][5]
    assert found.scores["peak"] == pytest.approx(0.1)


def test_where_damping_passes_the_critical_the_region_begins():
    damping = CRITICAL * np.linspace(0.5, 1.45, 19)  # none is critical
    found = sweep(carts(damping, ("rms", "log_decrement_modal")))
    np.testing.assert_array_equal(found.overdamped, damping > CRITICAL)
    border = int(np.argmax(damping > CRITICAL))
    np.testing.assert_array_equal(np.flatnonzero(found.mode_changes), [border - 1, border])
    ratio = damping[:border] / CRITICAL
    expected = 2 * np.pi * ratio / np.sqrt(1 - ratio**2)
    assert found.scores["log_decrement_modal"][:border] == pytest.approx(expected, rel=1e-9)
    assert np.all(np.isinf(found.scores["log_decrement_modal"][border:]))


def test_a_change_of_the_dominant_mode_is_marked_on_both_sides_along_every_axis():
    chain = Chain(("a", "b"), (("low", "ground", "a"), ("high", "a", "b")))
    numbers = {
        "masses.a.mass": 5.0, "masses.b.mass": 0.2,
        "links.low.stiffness": 500.0, "links.low.damping": 0.5,
        "links.high.stiffness": 3000.0, "links.high.damping": 0.1,
    }  # fmt: skip
    axes = (
        Axis("links.low.stiffness", np.array([450.0, 500.0])),
        Axis("links.high.damping", np.geomspace(0.01, 20.0, 30)),
    )
    found = sweep(
        task(
            impact("b", 10.0, 0.0, 0.005),
            ("rms",),
            axes,
            chain,
            numbers,
            sensor=Port("b", "position"),
        )
    )
    leaps = np.abs(np.diff(np.log(found.dominant_frequency), axis=1)) > np.log(2.0)
    assert leaps.sum() == 2  # the modes are a factor of ten apart: one change in each row
    expected = np.zeros(found.task.shape, bool)
    expected[:, 1:] |= leaps
    expected[:, :-1] |= leaps
    across = np.abs(np.diff(np.log(found.dominant_frequency), axis=0)) > np.log(2.0)
    expected |= np.broadcast_to(across, expected.shape)
    np.testing.assert_array_equal(found.mode_changes, expected)


def test_a_broken_sweep_goes_on_where_it_stopped_and_ends_the_same(monkeypatch):
    monkeypatch.setattr(sweeping, "TILE", 16)
    asked = task()
    whole, sheet = sweep(asked), blank_sheet(asked)

    class Killed(Exception):
        pass

    def stop(done, tiles):
        if done == 2:
            raise Killed

    with pytest.raises(Killed):
        sweep(asked, sheet, stop)
    assert list(sheet.done) == [1, 1, 0, 0]
    assert np.isfinite(sheet.fields["rms"]).sum() == 32
    rest = sweep(asked, sheet)
    assert rest.resumed == 2
    for name in SAMPLED:
        np.testing.assert_array_equal(rest.scores[name], whole.scores[name])
    np.testing.assert_array_equal(rest.mode_changes, whole.mode_changes)


def test_long_records_make_small_tiles():
    long = task(times=np.arange(1_000_000) / 1e5)
    assert long.tile * 8 * len(long.times) <= sweeping.TILE_BYTES
    assert task().tile == 60


def test_the_extreme_is_the_design_of_the_lowest_or_highest_score():
    found = sweep(task(scores=("rms", "settling")))
    design, value = found.extreme("rms", lowest=True) or ({}, 0.0)
    assert value == found.scores["rms"].min()
    at = np.unravel_index(np.argmin(found.scores["rms"]), found.task.shape)
    assert design == {axis.name: axis.values[i] for axis, i in zip(AXES, at)}


def test_what_cannot_be_swept_is_refused():
    with pytest.raises(ValueError, match="expected some of rms"):
        sweep(task(scores=("noise",)))
    with pytest.raises(ValueError, match="two samples or more"):
        sweep(task(window=(3.0, 4.0)))
    chain = Chain(("cart", "loose"), (("spring", "ground", "cart"),))
    numbers = CART_NUMBERS | {"masses.loose.mass": 1.0, "links.spring.stiffness": 0.0}
    axes, sensor = (Axis("masses.cart.mass", np.ones(2)),), Port("cart", "position")
    with pytest.raises(ValueError, match="balance"):
        sweep(task(release("cart", 0.1), ("rms",), axes, chain, numbers, sensor=sensor))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("inertia", "mean", "smallest"), [(0.02809, 0.6111, 4.112), (0.0102, 0.6087, 4.057)]
)
def test_the_maps_of_75_by_75_wrists(inertia, mean, smallest):
    """Lines 1491-1513 with the sleeve of Table 4; t = 0 at the end of the impulse."""
    numbers = NUMBERS | {
        "sleeve_stiffness": 130e3,
        "sleeve_damping": 12e3,
        "collet_inertia": inertia,
    }
    axes = (
        Axis("wrist_stiffness", 50.0 + 75.0 * np.arange(75)),
        Axis("wrist_damping", 2.0 + 2.0 * np.arange(75)),
    )
    short = 1e-7
    blow = impact("clubhead", 0.255 / short, 1e-3 - short, short)
    times = np.arange(2002) / 1000.0
    scores = ("rms", "log_decrement_local", "peak")
    found = sweep(
        task(blow, scores, axes, numbers=numbers, times=times, window=(0.001, 2.001))
    ).scores
    local = found["log_decrement_local"]
    assert np.mean(local) == pytest.approx(mean, abs=2e-4)
    assert np.min(found["rms"]) == pytest.approx(smallest, rel=2e-3)  # of samples of 1 ms
    assert np.unravel_index(np.argmin(found["rms"]), (75, 75)) == (1, 2)  # (125, 6)
    assert np.max(local) == local[0, 2]  # (50, 6)
