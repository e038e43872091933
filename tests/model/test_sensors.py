"""Sensors: nothing is misread without an effect, and each effect against its own formula."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from supple.model.chain import Chain
from supple.model.drives import Drive, impact
from supple.model.linear import Port
from supple.model.motion import respond
from supple.model.planar_motion import respond_planar
from supple.model.prescribed import through
from supple.model.robot import INCLINATION, PRESETS, Robot
from supple.model.sensor_file import read_sensors
from supple.model.sensors import (
    accelerometer,
    encoder,
    loaded,
    plain_sensor,
    read,
    readings,
    seen_ports,
    strain_gauge,
    with_laws,
)

HEAD = Port("clubhead", "acceleration", "collet")
STEP = 1 / 2048
TIMES = STEP * np.arange(2048)
VALUES = 300 * np.exp(-TIMES) * np.sin(25 * TIMES)
ROBOT = Robot("pinned_wrist")
NUMBERS = PRESETS["robo_v"]
BLOW = impact("clubhead", -400.0, 0.0, 0.005)


def says(sensor, values=VALUES):
    return read(sensor, values, TIMES)


def test_a_plain_sensor_tells_what_is_there():
    for sensor in (plain_sensor(HEAD), accelerometer(HEAD), encoder(HEAD, rate=2048.0)):
        assert sensor.name == "clubhead:acceleration:collet"
        np.testing.assert_allclose(says(sensor), VALUES, rtol=1e-12, atol=1e-12)
    for quantity in ("strain", "deflection"):
        np.testing.assert_array_equal(says(strain_gauge(Port("shaft", quantity))), VALUES)


def test_gain_offset_saturation_and_delay_are_what_they_say():
    np.testing.assert_allclose(says(accelerometer(HEAD, gain=0.02)), 1.02 * VALUES)
    np.testing.assert_allclose(says(accelerometer(HEAD, offset=-3.0)), VALUES - 3.0)
    np.testing.assert_allclose(
        says(accelerometer(HEAD, saturation=120.0)), np.clip(VALUES, -120, 120)
    )
    late = 0.0123
    wanted = 300 * np.exp(late - TIMES) * np.sin(25 * (TIMES - late))
    found = says(accelerometer(HEAD, delay=late))
    np.testing.assert_allclose(found[64:], wanted[64:], atol=1e-9 * 300)


@pytest.mark.parametrize("which, corner", [("lowpass", 40.0), ("highpass", 2.0)])
def test_filters_have_their_corner_where_they_say(which, corner):
    """At the corner a first-order filter passes 1 / sqrt(2), and turns the phase by 45 degrees."""
    turn, long = 2 * np.pi * corner, 4.0
    times = STEP * np.arange(int(long / STEP))
    found = read(accelerometer(HEAD, **{which: corner}), np.sin(turn * times), times)
    last = times > long - 1.0
    pair = np.stack([np.sin(turn * times), np.cos(turn * times)], axis=1)[last]
    fitted = np.linalg.lstsq(pair, found[last], rcond=None)[0]
    sign = -1 if which == "lowpass" else 1
    np.testing.assert_allclose(fitted, [0.5, 0.5 * sign], atol=2e-3)


def test_effects_act_in_the_order_of_the_electronics():
    """What the filter hides does not saturate, and the amplifier's zero comes after the filters."""
    sensor = accelerometer(HEAD, gain=0.1, lowpass=5.0, offset=2.0, saturation=100.0)
    alone = says(accelerometer(HEAD, lowpass=5.0))
    np.testing.assert_allclose(says(sensor), np.clip(1.1 * alone + 2.0, -100, 100), rtol=1e-12)


def test_a_gauge_of_another_calibration_tells_another_bend():
    bend = Port("shaft", "deflection")
    np.testing.assert_allclose(says(strain_gauge(bend, calibration=0.025)), VALUES * 0.024 / 0.025)
    strained = says(strain_gauge(Port("shaft", "strain"), calibration=0.025), 0.024 * VALUES)
    np.testing.assert_allclose(strained, 0.025 * VALUES)
    drifting = strain_gauge(bend, offset=0.5, drift=2.0)
    np.testing.assert_allclose(says(drifting), VALUES + 0.5 + 2.0 * TIMES)


def test_an_encoder_reads_at_250_hertz_in_whole_steps_and_holds():
    found = says(encoder(Port("wrist", "angle"), quantum=0.5))
    steps = found / 0.5
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-12)
    told = np.floor(TIMES * 250 + 1e-9) / 250
    exact = 300 * np.exp(-told) * np.sin(25 * told)
    assert np.max(np.abs(found - exact)) <= 0.25 + 1e-6
    assert len(np.unique(told)) == 250
    changes = np.flatnonzero(np.diff(found))
    assert np.all(np.diff(told)[changes] > 0), "it changes only when it reads"


def seen(robot, numbers, drive, times, sensors, planar=False):
    bench, loads, _ = with_laws(sensors, (), robot)
    numbers = loaded(numbers, loads)
    move = respond_planar if planar else respond
    motion = move(robot, numbers, drive, times, seen_ports(bench))
    return readings(bench, robot, numbers, drive, motion), motion


def test_a_sensor_weighs_on_what_it_sits_on():
    heavy, _ = seen(ROBOT, NUMBERS, BLOW, TIMES, [accelerometer(HEAD, "head", mass=0.02)])
    wanted, _ = seen(
        ROBOT, NUMBERS | {"clubhead_mass": NUMBERS["clubhead_mass"] + 0.02}, BLOW, TIMES,
        [plain_sensor(HEAD)],
    )  # fmt: skip
    np.testing.assert_array_equal(heavy["head"], wanted[plain_sensor(HEAD).name])
    light, _ = seen(ROBOT, NUMBERS, BLOW, TIMES, [plain_sensor(HEAD)])
    assert np.max(np.abs(heavy["head"] - light[plain_sensor(HEAD).name])) > 1.0


CLOCK = np.arange(2001) / 2000


def lifted(times):
    return 0.6 * np.pi * (times - np.sin(2 * np.pi * times) / (2 * np.pi)) - 1.0


@pytest.fixture(scope="module")
def tilted():
    """A planar swing with an accelerometer that leans out by 0.1, and its own motion."""
    robot = Robot("passive_wrist", (*NUMBERS, INCLINATION))
    numbers = NUMBERS | {INCLINATION: 0.8}
    drive = Drive(joints=(through("arm", CLOCK.tolist(), lifted(CLOCK).tolist(), 1.0),))
    absolute = Port("clubhead", "acceleration", "absolute")
    sensors = [
        accelerometer(absolute, "straight"), accelerometer(absolute, "leaning", tilt=0.1),
        accelerometer(HEAD, "relative"), accelerometer(HEAD, "relative_leaning", tilt=0.1),
    ]  # fmt: skip
    found, motion = seen(robot, numbers, drive, CLOCK, sensors, planar=True)
    return numbers, found, motion


def test_a_leaning_accelerometer_feels_the_motion_along_the_club_and_its_weight(tilted):
    """Against second differences of where the clubhead is in the plane."""
    p, found, motion = tilted
    q = motion.positions.T
    reach = p["sleeve_offset"] + p["sleeve_spacing"] / 2
    lever = p["club_length"] - p["grip_length"] / 2
    bend = q[3] - q[1] - lever * q[2]
    shorter = 0.6 * bend**2 / lever + q[2] * bend + lever * q[2] ** 2 / 2
    out = reach + lever - shorter
    depth = p["arm_length"] * np.cos(lifted(CLOCK)) + out * np.cos(q[0]) - q[3] * np.sin(q[0])
    side = p["arm_length"] * np.sin(lifted(CLOCK)) + out * np.sin(q[0]) + q[3] * np.cos(q[0])
    h = CLOCK[1]
    down, across = (np.diff(x, 2) / h**2 for x in (depth, side))
    weight = 9.80665 * np.sin(p[INCLINATION])
    axis = (q[0] + q[2] + 1.5 * bend / lever)[1:-1]
    outwards = (down - weight) * np.cos(axis) + across * np.sin(axis)
    lying = across * np.cos(axis) - down * np.sin(axis)
    size = np.max(np.abs(lying))
    inner = slice(40, -40)  # differences do not see the first jerk
    np.testing.assert_allclose(found["straight"][1:-1][inner], lying[inner], atol=2e-3 * size)
    wanted = np.cos(0.1) * lying + np.sin(0.1) * outwards
    np.testing.assert_allclose(found["leaning"][1:-1][inner], wanted[inner], atol=2e-3 * size)
    assert np.max(np.abs(outwards)) > size, "the pull towards the pivot is what it feels"


def test_a_lean_shows_alike_in_both_frames(tilted):
    _, found, _ = tilted
    np.testing.assert_allclose(
        found["leaning"] - found["straight"],
        found["relative_leaning"] - found["relative"],
        atol=1e-9,
    )


def test_in_a_small_motion_what_a_lean_adds_is_of_second_order():
    robot, drive = Robot("fixed_collet"), impact("clubhead", -2.0, 0.0, 0.005)
    port = Port("clubhead", "acceleration", "absolute")
    sensors = [plain_sensor(port), accelerometer(port, "leaning", tilt=0.3)]
    found, _ = seen(robot, NUMBERS, drive, TIMES, sensors)
    straight = found[plain_sensor(port).name]
    outwards = (found["leaning"] - np.cos(0.3) * straight) / np.sin(0.3)
    assert np.max(np.abs(outwards)) < 0.05 * np.max(np.abs(straight))
    twice, _ = seen(robot, NUMBERS, impact("clubhead", -4.0, 0.0, 0.005), TIMES, sensors)
    wider = twice["leaning"] - np.cos(0.3) * twice[plain_sensor(port).name]
    np.testing.assert_allclose(wider, 4 * np.sin(0.3) * outwards, rtol=1e-4, atol=1e-6)


def law(name, place, **numbers):
    return {"law": name, "place": place, "parameters": numbers}


def test_laws_of_a_rig_act_on_the_sensor_of_their_name_and_others_are_left():
    tables = [
        law("sensor_gain", "head", gain_error=0.5),
        law("coulomb_friction", "wrist", torque=1.0),
        law("sensor_saturation", "head", share=1.0, limit=90.0),
        law("sensor_mass", "clubhead", mass=0.01),
        law("sensor_offset", "elsewhere", offset=1.0),
    ]
    head = plain_sensor(HEAD, "head")
    (found,), loads, used = with_laws([head], tables, ROBOT)
    assert used == (0, 2, 3) and loads == {"clubhead_mass": 0.01}
    np.testing.assert_allclose(says(found), np.clip(1.5 * VALUES, -90, 90))
    carts = Chain(("cart",), (("spring", "ground", "cart"),))
    _, loads, _ = with_laws([], [law("sensor_mass", "cart", mass=0.3)], carts)
    assert loads == {"masses.cart.mass": 0.3}


BAD = {
    "a lean of an encoder": (
        [law("sensor_tilt", "joint", tilt=0.1)], ROBOT, "expected an accelerometer",
    ),
    "a lean on a straight line": ([law("sensor_tilt", "head", tilt=0.1)], None, "expected a robot"),
    "a mass that nothing carries": (
        [law("sensor_mass", "joint", mass=0.1)], ROBOT, "expected a place that carries it",
    ),
    "a limit that is missing": (
        [law("sensor_saturation", "head", share=1.0)], ROBOT, "expected 'limit'",
    ),
    "a negative mass": ([law("sensor_mass", "head", mass=-0.1)], ROBOT, "at least 0"),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_what_cannot_be_is_refused(name):
    tables, robot, words = BAD[name]
    mechanism = robot or Chain(("clubhead",), (("spring", "ground", "clubhead"),))
    bench = [plain_sensor(HEAD, "head"), plain_sensor(Port("wrist", "angle"), "joint")]
    with pytest.raises(ValueError, match=words) as error:
        with_laws(bench, tables, mechanism)
    assert "Mend: " in str(error.value)


@pytest.mark.parametrize(
    "make",
    [
        lambda: accelerometer(HEAD, mass=-1.0),
        lambda: accelerometer(HEAD, lowpass=0.0),
        lambda: accelerometer(HEAD, highpass=np.nan),
        lambda: strain_gauge(HEAD, calibration=0.0),
        lambda: encoder(HEAD, rate=-250.0),
        lambda: encoder(HEAD, quantum=-1.0),
        lambda: encoder(HEAD, quantum=np.inf),
    ],
)
def test_numbers_that_cannot_be_are_refused(make):
    with pytest.raises(ValueError, match=r"expected .* found .* Mend: "):
        make()


def test_two_sensors_of_one_name_are_refused():
    sensors = [plain_sensor(HEAD, "head")] * 2
    motion = respond(ROBOT, NUMBERS, BLOW, TIMES, (HEAD,))
    with pytest.raises(ValueError, match="found it twice"):
        readings(sensors, ROBOT, NUMBERS, BLOW, motion)


FILE = """\
[sensors.head]
kind = "accelerometer"
place = "clubhead"
frame = "collet"
mass = 0.006
saturation = 400.0
[sensors.gauge]
kind = "strain_gauge"
[sensors.joint]
kind = "encoder"
place = "wrist"
quantum = 1e-3
"""


def test_a_file_of_sensors(tmp_path: Path):
    (tmp_path / "sensors.toml").write_text(FILE)
    (head, gauge, joint), sha256 = read_sensors(tmp_path / "sensors.toml")
    assert head == accelerometer(HEAD, "head", mass=0.006, saturation=400.0)
    assert gauge == strain_gauge(Port("shaft", "strain"), "gauge")
    assert joint == encoder(Port("wrist", "angle"), "joint", quantum=1e-3)
    assert joint.rate == 250.0 and len(sha256) == 64
    assert replace(head, name="x") != head


@pytest.mark.parametrize(
    "text, words",
    [
        ("[rig]\nkind = 'chain'\n", r"\[sensors\]"),
        ("[sensors.a]\nkind = 'gyroscope'\n", "kind"),
        ("[sensors.a]\nkind = 'encoder'\nplace = 'wrist'\nmass = 1.0\n", "'mass'"),
        ("[sensors.a]\nkind = 'accelerometer'\n", "place"),
        (
            "[sensors.a]\nkind = 'encoder'\nplace = 'wrist'\nquantity = 'force'\n",
            "found 'force'",
        ),
        ("[sensors.a]\nkind = 'accelerometer'\nplace = 'grip'\nlowpass = 0.0\n", "lowpass"),
        ("[sensors.time]\nkind = 'accelerometer'\nplace = 'grip'\n", "no other column"),
    ],
)
def test_a_faulty_file_of_sensors_is_refused_in_one_line(text, words, tmp_path: Path):
    (tmp_path / "sensors.toml").write_text(text)
    with pytest.raises(ValueError, match=words) as error:
        read_sensors(tmp_path / "sensors.toml")
    said = str(error.value)
    assert "sensors.toml" in said and "Mend: " in said and "\n" not in said
