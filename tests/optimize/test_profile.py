"""Profiles: what the robot plays between the points, its limits, and its files."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.interpolate import CubicSpline

from supple.model.drive_file import read_profile
from supple.optimize.profile import (
    AXES,
    QUANTITIES,
    ROBO_V,
    AxisLimits,
    Limits,
    SwingProfile,
    excess,
    read_pod,
    write,
)

LAWS = ("cubic", "pchip", "linear")
OPEN = Limits()


def gentle(
    count: int = 1000, quantum: float = 1e-4, law: Any = "cubic", far: float = 4.0
) -> SwingProfile:
    """Minimum jerk from -3 rad over `far` in 2 s; half as far, a quarter for wrist and grip."""
    s = np.linspace(0.0, 1.0, count)
    rise = 10 * s**3 - 15 * s**4 + 6 * s**5
    return SwingProfile(
        2 * s, -3 + far * rise, -1.6 + far / 2 * rise, far / 4 * rise, 1.6, quantum, law,
        {"top": 0.5},
    )  # fmt: skip


def bumpy(seed: int, law: Any = "cubic", count: int = 12, quantum: float = 0.0) -> SwingProfile:
    arm, wrist, grip = np.random.default_rng(seed).normal(size=(3, count))
    return SwingProfile(np.linspace(0, 1.1, count), arm, wrist, grip, 0.4, quantum, law)


def used(profile, limits=None, **limit):
    """Ratio, time and value by axis and quantity."""
    found = excess(profile, limits or Limits(*(3 * [AxisLimits(**limit)])))
    return {(use.axis, use.quantity): use for use in found}


UNIT = dict(angle=(-1.0, 1.0), velocity=1.0, acceleration=1.0, jerk=1.0)


def test_minimum_jerk_uses_what_its_closed_form_says():
    uses = used(gentle(quantum=0.0), **UNIT)
    for axis, far in zip(AXES, (4.0, 2.0, 1.0)):
        assert uses[axis, "velocity"].ratio == pytest.approx(1.875 * far / 2, rel=1e-6)
        assert uses[axis, "velocity"].time == pytest.approx(1.0, abs=1e-5)
        peak = 10 / math.sqrt(3) * far / 4
        assert uses[axis, "acceleration"].ratio == pytest.approx(peak, rel=1e-4)
        assert uses[axis, "jerk"].ratio == pytest.approx(60 * far / 8, rel=5e-3)
    assert uses["arm", "angle"].value == pytest.approx(-3.0)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from(LAWS))
def test_the_extremes_between_points_are_those_of_dense_sampling(seed, law):
    profile = bumpy(seed, law)
    uses = used(profile, **UNIT)
    inside = profile.at(np.linspace(0, profile.time[-1], 40001)[1:-1])
    for order in range(2 if law == "linear" else 4):
        if law == "pchip" and order > 1:
            break  # its jumps count as spread: larger than any sample
        for column, axis in enumerate(AXES):
            use = uses[axis, QUANTITIES[order]]
            dense = np.max(np.abs(inside[order][:, column]))
            if order < 3:  # the end's own jump of acceleration makes a jerk that no sample has
                assert use.ratio == pytest.approx(dense, rel=2e-3)
            assert use.ratio >= dense * (1 - 1e-9)
            there = profile.at(np.array([use.time]))[order][0, column]
            if order < 2:
                assert there == pytest.approx(use.value, rel=1e-6, abs=1e-9)


def test_a_spline_between_legal_points_is_refused_where_it_overshoots(tmp_path):
    angle = np.repeat([0.0, 1.0], 10)
    profile = SwingProfile(np.linspace(0, 1.9, 20), angle, 0 * angle, 0 * angle, 1.0, 0.0)
    assert np.max(profile.arm_angle) <= 1.0
    limits = Limits(arm=AxisLimits(angle=(-1.0, 1.0)))
    use = used(profile, limits)["arm", "angle"]
    fine = CubicSpline(profile.time, angle, bc_type="clamped")(np.linspace(0.9, 1.2, 30001))
    assert use.ratio == pytest.approx(fine.max(), abs=1e-8)
    assert np.min(np.abs(profile.time - use.time)) > 0.01
    with pytest.raises(ValueError, match=rf"arm angle.* at {use.time:.6g} s, {use.ratio:.6g} tim"):
        write(profile, tmp_path / "new", limits)
    assert not (tmp_path / "new").exists()


def test_a_refused_profile_leaves_the_earlier_files_alone(tmp_path):
    kept = [path.read_bytes() for path in write(gentle(), tmp_path, ROBO_V)]
    with pytest.raises(ValueError, match=r"arm velocity: expected at most 3 rad/s.*1\.25"):
        write(gentle(), tmp_path, Limits(arm=AxisLimits(velocity=3.0)))
    assert [(tmp_path / name).read_bytes() for name in ("profile.csv", "profile.pod")] == kept
    assert len(list(tmp_path.iterdir())) == 2


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_each_limit_of_each_axis_is_watched(quantity, tmp_path):
    profile = gentle()
    for axis in AXES:
        most = used(profile, **UNIT)[axis, quantity].ratio
        for factor, is_refused in ((1.002, False), (0.99, True)):
            bound: Any = (-most * factor, most * factor) if quantity == "angle" else most * factor
            limits = Limits(**{axis: AxisLimits(**{quantity: bound})})
            if is_refused:
                with pytest.raises(ValueError, match=f"{axis} {quantity}"):
                    write(profile, tmp_path, limits)
            else:
                write(profile, tmp_path, limits)


def test_the_middle_of_a_lopsided_range_of_angles_counts_as_zero_use():
    uses = used(gentle(quantum=0.0), Limits(arm=AxisLimits(angle=(-3.0, 5.0))))
    assert uses["arm", "angle"].ratio == pytest.approx(1.0)
    assert uses["arm", "angle"].limit == -3.0
    assert used(gentle(), OPEN)["arm", "angle"].ratio == 0.0


def test_an_acceleration_that_is_there_at_the_first_instant_is_a_jerk():
    t = np.linspace(0, 1, 1000)
    s = (1 - np.cos(np.pi * t)) / 2  # its own jerk is 15.5 at most
    jerk = used(SwingProfile(t, s, 0 * s, 0 * s, 0.5, 0.0), **UNIT)["arm", "jerk"]
    assert jerk.time in (0.0, 1.0)
    assert jerk.ratio == pytest.approx(np.pi**2 / 2 / t[1], rel=1e-3)


def test_a_corner_counts_as_an_acceleration_over_one_step():
    t = np.linspace(0, 1, 101)
    path = SwingProfile(t, np.abs(t - 0.5), 0 * t, 0 * t, 0.5, 0.0, "linear")
    uses = used(path, **UNIT)
    assert uses["arm", "velocity"].ratio == pytest.approx(1.0)
    corner = uses["arm", "acceleration"]
    assert corner.value == pytest.approx(2.0 / 0.01) and corner.time == pytest.approx(0.5)


def test_one_last_digit_of_a_hundredth_of_a_degree_breaks_the_jerk_of_the_arm():
    t = np.linspace(0, 2, 1000)
    one = np.zeros(1000)
    one[500:] = math.radians(0.01)
    step = SwingProfile(t, one, 0 * one, 0 * one, 1.0, 0.01, "linear")
    use = used(step, ROBO_V)["arm", "jerk"]  # third differences 1, -2, 1
    assert use.value == pytest.approx(-2 * math.radians(0.01) / t[1] ** 3, rel=1e-6)
    assert use.ratio > 1.0
    assert used(gentle(quantum=0.01), ROBO_V)["arm", "jerk"].ratio > 1.0
    assert used(gentle(quantum=1e-4), ROBO_V)["arm", "jerk"].ratio < 0.2


def test_jerks_that_hold_between_points_come_back_through_the_clamped_spline():
    jerks = np.random.default_rng(3).normal(size=40)
    states = [np.zeros(3)]
    for k in range(40):  # exact steps of 1 s
        angle, speed, bend = states[-1]
        if k == 39:  # stop
            jerks[k] = -2 * (speed + bend)
        j = jerks[k]
        states.append(np.array([angle + speed + bend / 2 + j / 6, speed + bend + j / 2, bend + j]))
    path, time = np.array(states), np.arange(41.0)
    profile = SwingProfile(time, path[:, 0], 0 * time, 0 * time, 3.0, 0.0)
    course = profile.at(time[:-1] + 0.5)
    assert np.allclose(course.jerks[:, 0], jerks, atol=1e-9)
    assert np.allclose(profile.at(time).velocities[:, 0], path[:, 1], atol=1e-9)


@pytest.mark.parametrize("law", LAWS)
def test_the_robot_passes_its_points_and_rests_outside(law):
    profile = bumpy(4, law, quantum=0.01)
    at_points = profile.at(profile.time).angles
    assert np.allclose(at_points, profile.read_angles, atol=1e-12)
    counts = np.degrees(profile.read_angles) / 0.01
    assert np.allclose(counts, np.round(counts), atol=1e-6)
    assert np.max(np.abs(profile.read_angles - profile.angles)) <= math.radians(0.005) + 1e-12
    outside = profile.at(np.array([-1.0, 9.0]))
    assert np.allclose(outside.angles, profile.read_angles[[0, -1]])
    assert all(np.all(one == 0) for one in outside[1:])


@pytest.mark.parametrize("law", LAWS)
def test_derivatives_are_those_of_finite_differences(law):
    profile = bumpy(5, law)
    times = profile.time[:-1] + 0.03  # inside the steps
    h = 1e-5
    near = [profile.at(times + k * h).angles for k in (-2, -1, 0, 1, 2)]
    course = profile.at(times)
    assert np.allclose(course.velocities, (near[3] - near[1]) / (2 * h), atol=1e-5)
    assert np.allclose(course.accelerations, (near[3] - 2 * near[2] + near[1]) / h**2, atol=1e-2)
    speeds = [profile.at(times + k * h).accelerations for k in (-1, 1)]
    assert np.allclose(course.jerks, (speeds[1] - speeds[0]) / (2 * h), rtol=1e-6, atol=1e-4)


@settings(max_examples=25, deadline=None)
@given(
    st.integers(0, 10**6),
    st.sampled_from([0.0, 1e-4, 0.001, 0.01, 0.0054931640625, 0.3]),
    st.sampled_from(LAWS),
)
def test_the_file_reads_back_to_what_the_robot_plays(tmp_path_factory, seed, quantum, law):
    folder = tmp_path_factory.mktemp("pod")
    profile = bumpy(seed, law, 50, quantum)
    csv, pod = write(profile, folder, OPEN)
    back = read_pod(pod)
    assert np.allclose(back.read_angles, profile.read_angles, atol=1e-13)
    assert (back.impact_time, back.quantum, back.interpolation) == (0.4, quantum, law)
    assert np.allclose(back.time, profile.time, atol=1e-15)
    table = read_profile(csv, ("arm_angle", "wrist_angle", "grip_angle"))
    assert np.array_equal(table["wrist_angle"], profile.read_angles[:, 1])


def test_the_table_has_a_thousand_rows_and_the_header_tells_what_the_robot_needs(tmp_path):
    csv, pod = write(gentle(), tmp_path, ROBO_V)
    lines = csv.read_text().splitlines()
    assert lines[0] == "time,arm_angle,wrist_angle,grip_angle" and len(lines) == 1001
    head = pod.read_text().split("arm wrist grip")[0]
    for word in ("points: 1000", "swing_time: 2.0", "impact_time: 1.6", "phase top: 0.5",
                 "interpolation: cubic", "quantum: 0.0001"):  # fmt: skip
        assert word in head
    pose = [float(word) for word in head.split("impact_pose: ")[1].split("\n")[0].split()]
    assert pose[0] == pytest.approx(math.degrees(-3 + 4 * 0.94208), abs=1e-3)
    assert read_pod(pod).phases == {"top": 0.5}


def test_numbers_of_numpy_are_written_as_numbers(tmp_path):
    s = np.linspace(0.0, 1.0, 30)
    instants = {"top": np.float64(0.25)}
    profile = SwingProfile(
        s, 0 * s, 0 * s, 0 * s, np.float64(0.5), np.float64(0.01), "cubic", instants
    )
    back = read_pod(write(profile, tmp_path, OPEN)[1])
    assert (back.impact_time, back.quantum, back.phases) == (0.5, 0.01, {"top": 0.25})


def test_any_changed_character_is_found_and_other_line_ends_are_not(tmp_path):
    _, pod = write(gentle(60), tmp_path, OPEN)
    content = pod.read_bytes()
    pod.write_bytes(content.replace(b"\n", b"\r\n"))
    read_pod(pod)
    rng = np.random.default_rng(0)
    for at in rng.integers(0, len(content), 60):
        other = b"7" if content[at : at + 1] != b"7" else b"3"
        pod.write_bytes(content[:at] + other + content[at + 1 :])
        with pytest.raises(ValueError, match=r"profile\.pod: .*expected .* found .* Mend: "):
            read_pod(pod)
    for cut in (0, 10, len(content) // 2, len(content) - 3):
        pod.write_bytes(content[:cut])
        with pytest.raises(ValueError, match="Mend"):
            read_pod(pod)


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"time": np.linspace(0.1, 1, 9)}, "equal steps from 0"),
        ({"time": np.linspace(0, 1, 9) ** 2}, "equal steps"),
        ({"arm_angle": np.full(9, np.nan)}, "finite"),
        ({"wrist_angle": np.zeros(8)}, "as many"),
        ({"impact_time": 2.0}, "between 0 and 1"),
        ({"quantum": -1.0}, "0 or more"),
        ({"phases": {"top: of\nswing": 0.2}}, "letters"),
        ({"phases": {"top": 3.0}}, "between 0 and 1"),
        ({"interpolation": "quintic"}, "'pchip'"),
    ],
)
def test_what_is_no_profile_is_refused_in_words(change, word):
    good: dict[str, Any] = dict(
        time=np.linspace(0, 1, 9), arm_angle=np.zeros(9), wrist_angle=np.zeros(9),
        grip_angle=np.zeros(9), impact_time=0.5,
    )  # fmt: skip
    SwingProfile(**good)
    with pytest.raises(ValueError, match=word):
        SwingProfile(**(good | change))


def test_limits_must_be_limits():
    wrong: Any
    for wrong in (
        {"angle": (1.0, -1.0)},
        {"velocity": 0.0},
        {"jerk": -3.0},
        {"angle": (0.0, math.inf)},
    ):
        with pytest.raises(ValueError, match="limits"):
            AxisLimits(**wrong)
