"""Motions against scipy: expm for the linear robot, solve_ivp with and without laws."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from supple.model.chain import Chain
from supple.model.drives import impact, release, torque, wave
from supple.model.linear import Port, state_space
from supple.model.motion import respond, respond_batch
from supple.model.robot import PRESETS, Robot

ROBOT, ROBO_V = Robot("pinned_wrist"), PRESETS["robo_v"]
LINE = Chain(("a", "b"), (("s1", "ground", "a"), ("s2", "a", "b")))
NUMBERS = {
    "masses.a.mass": 1.0,
    "masses.b.mass": 0.5,
    "links.s1.stiffness": 400.0,
    "links.s1.damping": 1.0,
    "links.s2.stiffness": 300.0,
    "links.s2.damping": 0.5,
}
TIMES = np.arange(180) / 100.0
SEEN = (Port("s2", "deflection"), Port("b", "acceleration"))
DRIVES = {
    "pulse": impact("b", 30.0, 0.1234, 0.0731),
    "pulse inside one sample": impact("b", 300.0, 0.1234, 0.0031),
    "pulse on samples": impact("b", 30.0, 0.1, 0.2),
    "steps": torque("b", (-1.0, 0.333, 0.5, 1.237), (5.0, -3.0, 2.0, -7.0)),
    "square": wave("b", "square", 5.0, 0.777, 0.11, 1.6),
    "sine": wave("b", "sine", 5.0, 0.777, 0.113, 1.633),
    "release": release("b", 0.1),
}
LAWS = {
    "cubic": ({"cubic_stiffness": 4e4}, "cubic_stiffness", lambda s, r: 4e4 * s**3),
    "friction": (
        {"force": {"value": 1.0, "free": True}, "rate_width": 0.05},
        "coulomb_friction",
        lambda s, r: np.tanh(r / 0.05),
    ),
}


def reference(drive, start, law=lambda s, r: 0.0):
    """States of LINE by solve_ivp, begun afresh at every jump."""

    def slope(t, x, level):
        force = level * np.sin(drive.frequency * (t - drive.edges[0])) if drive.frequency else level
        first = 400 * x[0] + x[2] + law(x[0], x[2])
        second = 300 * (x[1] - x[0]) + 0.5 * (x[3] - x[2])
        return [x[2], x[3], second - first, 2 * (force - second)]

    knots = sorted({0.0, TIMES[-1], *(e for e in drive.edges if 0 < e < TIMES[-1])})
    found, x = np.zeros((len(TIMES), 4)), np.append(start, [0.0, 0.0])
    for begin, end in pairwise(knots):
        inside = (begin <= TIMES) & (end >= TIMES)
        at = np.unique(np.append(TIMES[inside], end))
        level = drive.level(np.array([begin]))[0]
        done = solve_ivp(slope, (begin, end), x, "LSODA", at, rtol=1e-11, atol=1e-13, args=(level,))
        found[inside] = done.y.T[: inside.sum()]
        x = done.y[:, -1]
    return found


def gap(found, wanted):
    return np.max(np.abs(found - wanted) / np.max(np.abs(wanted), axis=0))


def states(motion):
    return np.concatenate([motion.positions, motion.velocities], axis=1)


@pytest.mark.parametrize("name", DRIVES)
def test_a_linear_motion_is_exact_wherever_the_drive_jumps(name):
    drive = DRIVES[name]
    motion = respond(LINE, NUMBERS, drive, TIMES, SEEN)
    assert (motion.error, motion.status) == (0.0, "converged")
    x = states(motion)
    assert gap(x, reference(drive, motion.positions[0])) < 1e-9
    stretch, rate = x[:, 1] - x[:, 0], x[:, 3] - x[:, 2]
    force = drive.force(TIMES, 1e-9)
    np.testing.assert_allclose(motion.samples[:, 0], stretch, atol=1e-15)
    bend = 2 * (force - 300 * stretch - 0.5 * rate)
    np.testing.assert_allclose(motion.accelerations[:, 1], bend, atol=1e-9)
    np.testing.assert_allclose(motion.samples[:, 1], bend, atol=1e-9)


@pytest.mark.parametrize(
    ("name", "law"),
    [
        ("pulse inside one sample", "cubic"),
        ("square", "cubic"),
        ("sine", "friction"),
        ("release", "cubic"),
    ],
)
def test_a_motion_with_a_law_of_an_extended_rig(name, law):
    parameters, named, force = LAWS[law]
    drive = DRIVES[name]
    tables = [{"law": named, "place": "s1", "parameters": parameters}]
    motion = respond(LINE, NUMBERS, drive, TIMES, SEEN, tables)
    assert motion.status == "converged"
    x = states(motion)
    wanted = reference(drive, motion.positions[0], force)
    assert gap(x, wanted) < 2e-6
    first = 400 * x[:, 0] + x[:, 2] + force(x[:, 0], x[:, 2])
    second = 300 * (x[:, 1] - x[:, 0]) + 0.5 * (x[:, 3] - x[:, 2])
    np.testing.assert_allclose(motion.accelerations[:, 0], second - first, atol=1e-7)
    without = respond(LINE, NUMBERS, drive, TIMES)
    assert gap(states(without), wanted) > 1e-2


def test_a_release_begins_in_the_balance_of_its_laws():
    table = [{"law": "cubic_stiffness", "place": "s1", "parameters": {"cubic_stiffness": 4e4}}]
    motion = respond(LINE, NUMBERS, release("b", 0.1), TIMES, (), table)
    a, b = motion.positions[0]
    assert b == pytest.approx(0.1)
    assert 400 * a + 4e4 * a**3 == pytest.approx(300 * (b - a))
    np.testing.assert_allclose(motion.accelerations[0, 0], 0.0, atol=1e-9)


def test_a_law_at_its_null_changes_nothing():
    table = [{"law": "coulomb_friction", "place": "s1", "parameters": {"force": 0.0}}]
    with_law = respond(LINE, NUMBERS, DRIVES["pulse"], TIMES, SEEN, table)
    without = respond(LINE, NUMBERS, DRIVES["pulse"], TIMES, SEEN)
    assert gap(states(with_law), states(without)) < 1e-11
    assert gap(with_law.samples, without.samples) < 1e-11


def test_many_designs_against_expm_and_one_by_one():
    count, rate, force, length = 1500, 2048.0, -1600.0, 0.005
    times, drive = np.arange(count) / rate, impact("clubhead", force, 0.0, length)
    sensors = (Port("clubhead", "acceleration", "collet"), Port("shaft", "strain", "collet"))
    wrist = np.linspace(50.0, 500.0, 300)  # more than one tile
    found = respond_batch(ROBOT, ROBO_V | {"wrist_stiffness": wrist}, drive, times, sensors)
    assert found.shape == (300, count, 2)
    design = ROBO_V | {"wrist_stiffness": wrist[270]}
    space = state_space(ROBOT, design, (Port("clubhead", "force"),), sensors)
    whole = np.zeros((9, 9))
    whole[:8, :8], whole[:8, 8:] = space.a, space.b
    look = np.concatenate([space.c, space.d], axis=1)
    samples, x = [], np.append(np.zeros(8), force)
    step, last = expm(whole / rate), int(length * rate)
    for index in range(count):
        samples.append(look @ x)
        if index == last:
            x = expm(whole * (length - last / rate)) @ x
            x[8] = 0.0
            x = expm(whole * ((last + 1) / rate - length)) @ x
        else:
            x = step @ x
    assert gap(found[270], np.array(samples)) < 1e-11
    alone = respond(ROBOT, design, drive, times, sensors)
    assert gap(found[270], alone.samples) < 1e-11


def test_many_releases_begin_each_in_its_own_balance():
    drive, wrist = release("clubhead", 0.15, "collet"), np.array([100.0, 300.0])
    sensors = (Port("clubhead", "position", "collet"), Port("wrist", "angle"))
    table = ROBO_V | {"wrist_stiffness": wrist}
    found = respond_batch(ROBOT, table, drive, TIMES, sensors)
    np.testing.assert_allclose(found[:, 0, 0], 0.15)
    assert found[0, 0, 1] == pytest.approx(3 * found[1, 0, 1])


def test_a_motion_as_columns():
    motion = respond(ROBOT, ROBO_V, release("clubhead", 0.1, "collet"), TIMES, (SEEN_AT_HEAD,))
    names = ["collet_angle", "grip_displacement", "grip_angle", "clubhead_displacement"]
    endings = ("", "_velocity", "_acceleration")
    wanted = ["time", *(name + end for end in endings for name in names)]
    assert list(motion.columns()) == [*wanted, "clubhead:position:absolute"]
    with pytest.raises(ValueError, match="twice"):
        respond(
            Chain(("time",), ()), {"masses.time.mass": 1.0}, release("time", 1.0), TIMES
        ).columns()


SEEN_AT_HEAD = Port("clubhead", "position")

WRONG_LAWS = {
    "no such law": {"law": "coulomb", "place": "s1", "parameters": {}},
    "no such place": {"law": "coulomb_friction", "place": "s3", "parameters": {"force": 1.0}},
    "a place of another kind": {"law": "coulomb_friction", "place": "a", "parameters": {}},
    "no strength": {"law": "coulomb_friction", "place": "s1", "parameters": {}},
    "another's strength": {"law": "coulomb_friction", "place": "s1", "parameters": {"gap": 1.0}},
    "no width": {
        "law": "coulomb_friction",
        "place": "s1",
        "parameters": {"force": 1.0, "rate_width": 0.0},
    },
}


@pytest.mark.parametrize("name", WRONG_LAWS)
def test_a_law_that_does_not_fit_is_refused(name):
    with pytest.raises(ValueError, match=r"\[\[laws\]\] item 0 .*expected .*, found .* Mend: "):
        respond(LINE, NUMBERS, DRIVES["pulse"], TIMES, (), [WRONG_LAWS[name]])


def test_a_law_of_a_sensor_is_passed_over():
    table = [{"law": "sensor_offset", "place": "head", "parameters": {"offset": 1.0}}]
    motion = respond(LINE, NUMBERS, DRIVES["pulse"], TIMES, SEEN, table)
    np.testing.assert_array_equal(
        motion.samples, respond(LINE, NUMBERS, DRIVES["pulse"], TIMES, SEEN).samples
    )


def test_what_cannot_be_simulated_is_refused():
    drive = release("clubhead", 0.1, "collet")
    with pytest.raises(ValueError, match="a stiffness is zero"):
        respond(ROBOT, ROBO_V | {"wrist_stiffness": 0.0}, drive, TIMES)
    with pytest.raises(ValueError, match="found none for 'shaft_stiffness'"):
        numbers = {name: value for name, value in ROBO_V.items() if name != "shaft_stiffness"}
        respond(ROBOT, numbers, drive, TIMES)
    for times in (np.array([0.0]), np.array([0.0, 1.0, 3.0]), np.array([1.0, 2.0])):
        with pytest.raises(ValueError, match="uniform samples from 0"):
            respond(ROBOT, ROBO_V, drive, times)
    with pytest.raises(ValueError, match="arrays of one length"):
        two = {"wrist_stiffness": np.ones(2), "wrist_damping": np.ones(3)}
        respond_batch(ROBOT, ROBO_V | two, drive, TIMES, (SEEN_AT_HEAD,))
    table = [{"law": "cubic_stiffness", "place": "s1", "parameters": {"cubic_stiffness": -1e9}}]
    with pytest.raises(ValueError, match="stays bounded"):
        respond(LINE, NUMBERS, DRIVES["pulse"], TIMES, (), table)
