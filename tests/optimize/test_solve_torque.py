"""The motors' torque in a swing: work against energy, limits that hold in the file, refusals."""

from dataclasses import replace

import numpy as np
import pytest

from supple.model import planar
from supple.model.energies import mass_matrix
from supple.model.rig import read_rig
from supple.model.robot import INCLINATION, Robot
from supple.optimize.solve import SOLVED, solve
from supple.optimize.solve_torque import arm_torque, check_torque, momentum
from supple.optimize.swing_check import examine, motor_torques
from supple.optimize.task import read_task
from tests.optimize.swing_tasks import write_task


def task_of(folder, fidelity="thesis", **changed):
    task = read_task(write_task(folder, fidelity, **{"points": 401, **changed}))
    return task, read_rig(task.rig)


@pytest.fixture(scope="module")
def free(tmp_path_factory):
    task, rig = task_of(tmp_path_factory.mktemp("free"))
    swing = solve(task, rig)
    return task, rig, swing, examine(swing.profile, task, rig, np.array([1.0]))


def limited(free, **torque):
    task, rig, _, _ = free
    bounded = replace(task, shaft=replace(task.shaft, **torque))
    swing = solve(bounded, rig)
    return swing, examine(swing.profile, bounded, rig, np.array([1.0]))


def test_the_motors_work_is_the_energy_that_the_club_has_and_loses(free):
    task, _, _, verdict = free
    ball = task.impact
    numbers, x = verdict.nominal.numbers[0], verdict.nominal.states[0]
    times = verdict.nominal.times
    rates = verdict.profile.at(times).velocities[:, :2]
    angles = verdict.profile.at(times).angles[:, :2]
    torques = {name: table[1] for name, table in motor_torques(verdict).items()}
    mean = 0.5 * (torques["wrist"][1:] + torques["wrist"][:-1])
    middle = 0.5 * (rates[1:] + rates[:-1])
    step = np.diff(times)
    work = np.sum(step * (torques["arm"] * middle[:, 0] + mean * middle[:, 1]))
    lost = 2 * planar.dissipation(numbers, x[:, :4].T, x[:, 4:].T, rates.T, True)
    lost = np.sum(step * 0.5 * (lost[1:] + lost[:-1]))
    whole = mass_matrix(Robot("driven_arm", tuple(numbers)).rows(numbers, np))
    moved = np.hstack([x[:, 4:], rates])
    energy = 0.5 * np.einsum("ti,ij,tj->t", moved, whole, moved)
    energy = energy + planar.spring_energy(numbers, x[:, :4].T, angles.T, True)
    reach = planar.points_of(numbers).head
    head = numbers["arm_length"] * rates[:, 0] + reach * x[:, 4] + x[:, 7]
    at = verdict.nominal.hit
    parts = round(ball.duration / times[1])
    taken = ball.force * ball.duration * head[at : at + parts + 1].mean()
    assert parts >= 1 and abs(taken) > 10.0
    assert work + taken == pytest.approx(energy[-1] - energy[0] + lost, abs=0.01 * energy.max())


def test_momentum_is_the_slope_of_the_kinetic_energy():
    random = np.random.default_rng(4)
    numbers = {
        "arm_length": 0.65,
        **{k: 0.4 for k in ("collet_mass", "grip_mass", "clubhead_mass")},
    }
    numbers |= {"collet_centre": 0.1, "club_length": 1.1, "grip_length": 0.3, "grip_inertia": 0.01}
    numbers |= {"sleeve_offset": 0.05, "sleeve_spacing": 0.2, "collet_inertia": 0.02}
    x, angles = 0.1 * random.normal(size=8), random.normal(size=2)
    rates = random.normal(size=2)
    down, side = momentum(numbers, x, angles, rates, flat=False)
    shift = numbers["arm_length"] * (np.cos(angles[0]) * side - np.sin(angles[0]) * down)

    def energy(arm_rate):
        told = np.array([arm_rate, rates[1]])
        return planar.kinetic_energy(numbers, x[:4], x[4:], angles, told, np)

    slope = (energy(rates[0] + 1e-6) - energy(rates[0] - 1e-6)) / 2e-6
    assert slope == pytest.approx(shift, rel=1e-7)


def test_a_robot_that_hangs_still_needs_only_what_carries_its_weight():
    numbers = {"arm_length": 0.65, "collet_mass": 1.0, "grip_mass": 0.3, "clubhead_mass": 0.2}
    numbers |= {"collet_centre": 0.1, "club_length": 1.1, "grip_length": 0.3, INCLINATION: 0.7}
    numbers |= {"sleeve_offset": 0.05, "sleeve_spacing": 0.2}
    numbers |= {"wrist_stiffness": 300.0, "wrist_damping": 15.0}
    at = (np.zeros(8), np.array([np.pi / 2, -np.pi / 2]), np.zeros(2))
    torque = arm_torque(numbers, at, at, 0.01, 0.0, flat=False)
    assert torque == pytest.approx(0.65 * 1.5 * planar.GRAVITY * np.sin(0.7))


@pytest.mark.parametrize(("axis", "share"), [("arm", 0.8), ("arm", 0.5), ("wrist", 0.5)])
def test_a_limit_of_torque_holds_in_the_file_and_is_named(free, axis, share):
    used = {use.axis: abs(use.value) for use in free[3].torques}
    swing, verdict = limited(free, **{f"{axis}_torque": share * used[axis]})
    ratio = {use.axis: use.ratio for use in verdict.torques}[axis]
    assert swing.status == SOLVED and verdict.passed, verdict.failures
    assert 0.97 < ratio <= 1.001
    assert any(one.axis == axis and one.quantity == "torque" for one in swing.binding)
    assert swing.found.cost > free[2].found.cost


def test_a_check_fails_where_a_torque_is_above_its_limit(free):
    task, rig, swing, verdict = free
    most = {use.axis: 0.9 * abs(use.value) for use in verdict.torques}
    bounded = replace(task, shaft=replace(task.shaft, arm_torque=most["arm"]))
    told = examine(swing.profile, bounded, rig, np.array([1.0])).failures
    assert len(told) == 1 and told[0].startswith("arm torque is 1.11")


@pytest.mark.slow
def test_too_little_torque_is_named_with_a_speed_that_it_can_do(free):
    swing, _ = limited(free, wrist_torque=4.0)
    assert swing.status == "infeasible" and "torque limit" in swing.sentence
    assert swing.fastest is not None
    slower = replace(swing.task, impact=replace(swing.task.impact, clubhead_speed=swing.fastest))
    assert solve(slower, free[1]).status == SOLVED


def test_a_limit_of_torque_is_refused_where_a_law_adds_to_the_wrists(tmp_path):
    task, _ = task_of(tmp_path)
    text = task.rig.read_text()
    law = '\n[[laws]]\nlaw = "cubic_stiffness"\nplace = "wrist"\n'
    task.rig.write_text(text + law + "parameters = { cubic_stiffness = 5.0 }\n")
    rig = read_rig(task.rig)
    check_torque(task.shaft, rig)
    with pytest.raises(ValueError, match="found 'cubic_stiffness'"):
        check_torque(replace(task.shaft, arm_torque=10.0), rig)


@pytest.mark.slow
@pytest.mark.parametrize("axis", ["arm", "wrist"])
def test_a_limit_of_torque_holds_in_the_plane_too(tmp_path, axis):
    task, rig = task_of(tmp_path, "planar")
    first = examine(solve(task, rig).profile, task, rig, np.array([1.0]))
    most = {f"{use.axis}_torque": 0.6 * abs(use.value) for use in first.torques if use.axis == axis}
    bounded = replace(task, shaft=replace(task.shaft, **most))
    verdict = examine(solve(bounded, rig).profile, bounded, rig, np.array([1.0]))
    assert verdict.passed, verdict.failures
    assert {use.axis: use.ratio for use in verdict.torques}[axis] > 0.97
