"""The optimal swing: at the ball, within limits, quiet; two solvers agree."""

from dataclasses import replace

import numpy as np
import pytest

from supple.model.rig import read_rig
from supple.optimize.classic import classic, shaped_basis, slow_mode
from supple.optimize.profile import SwingProfile, excess, read_pod, write
from supple.optimize.shaper import zvd
from supple.optimize.solve import INFEASIBLE, SOLVED, solve
from supple.optimize.solve_grid import condensed, followed, jerk_splines, make_grid
from supple.optimize.solve_ipopt import second_opinion
from supple.optimize.solve_newton import settle
from supple.optimize.solve_problem import first_guess
from supple.optimize.solve_scenarios import plant_of, stated
from supple.optimize.swing_check import examine
from supple.optimize.task import read_task
from tests.optimize.swing_tasks import write_task


def task_of(folder, fidelity="thesis", **changed):
    task = read_task(write_task(folder, fidelity, **changed))
    return task, read_rig(task.rig)


@pytest.fixture(scope="module")
def robust(tmp_path_factory):
    task, rig = task_of(tmp_path_factory.mktemp("robust"), scenarios=3)
    return task, rig, solve(task, rig)


def test_jerk_that_is_constant_between_points_is_a_clamped_spline_of_the_angles(robust):
    _, _, swing = robust
    fine = replace(swing.profile, quantum=0.0)
    marks = swing.problem.grid.marks
    course = fine.at(marks)
    for order, table in enumerate(course[:3]):
        told = swing.motion[:, :, order]
        assert np.abs(table[:, :2] - told).max() < 1e-8 * np.abs(told).max()


def test_impact_lies_between_points_and_is_met_when_the_file_is_simulated_anew(robust, tmp_path):
    task, rig, swing = robust
    assert swing.status == SOLVED
    late = (swing.profile.impact_time / swing.profile.time[1]) % 1.0
    files = write(swing.profile, tmp_path, task.limits)
    verdict = examine(read_pod(files[1]), task, rig)
    assert min(late, 1 - late) >= 0.0
    assert verdict.passed, verdict.failures
    assert abs(verdict.errors["speed"]) < 0.01
    assert abs(np.degrees(verdict.errors["chord"])) < 0.005
    assert all(use.ratio <= 1.001 for use in verdict.uses)
    assert verdict.residual.max() == pytest.approx(swing.rings.max(), rel=0.1, abs=2e-5)


def test_the_check_fails_when_the_file_was_changed(robust):
    task, rig, swing = robust
    old = swing.profile
    moved = old.arm_angle + 0.002 * np.sin(np.pi * old.time / old.time[-1]) ** 4
    changed = SwingProfile(
        old.time, moved, old.wrist_angle, old.grip_angle, old.impact_time, old.quantum
    )
    verdict = examine(changed, task, rig)
    assert not verdict.passed
    assert any("at impact is off" in one for one in verdict.failures)
    late = SwingProfile(
        old.time,
        old.arm_angle,
        old.wrist_angle,
        old.grip_angle,
        old.impact_time + 1e-3,
        old.quantum,
    )
    assert not examine(late, task, rig).passed


def test_the_ring_is_small_between_the_scenarios_too_and_below_any_classic(robust):
    task, rig, swing = robust
    best = classic(task, rig, zvd(*slow_mode(rig)))
    assert best.works
    assert swing.rings.max() < 0.03 * best.rings.max()
    assert swing.rings.max() < 1.5 * np.interp(swing.factors, swing.dense, swing.rings).max() + 1e-4


def test_another_solver_finds_the_same_cost(tmp_path):
    task, rig = task_of(tmp_path, points=121)
    problem = stated(task, rig, None, (1.0,), splines=30)
    plant = plant_of(problem, rig)
    found = settle(problem, plant, first_guess(problem))
    other = second_opinion(problem, plant.steps(found.states, found.c), plant.start())
    assert found.settled and other.status == "Solve_Succeeded"
    assert found.cost == pytest.approx(other.cost, rel=1e-6)


@pytest.mark.parametrize("hold", ["grip", "both", "drive"])
def test_the_pose_holds_for_what_the_task_names(tmp_path, hold):
    task, rig = task_of(tmp_path, points=201, hold=hold)
    swing = solve(task, rig)
    verdict = examine(swing.profile, task, rig, np.array([1.0]))
    names = {"grip": ["grip"], "both": ["chord", "grip"], "drive": ["wrist"]}[hold]
    assert swing.status == SOLVED and set(names) < set(verdict.errors)
    assert max(abs(np.degrees(verdict.errors[name])) for name in names) < 0.02


def test_pose_and_speed_can_hold_in_every_scenario(tmp_path):
    task, rig = task_of(tmp_path, scenarios=3, robust="true")
    swing = solve(task, rig)
    verdict = examine(swing.profile, task, rig, np.array([0.9, 1.0, 1.1]))
    assert swing.status == SOLVED
    assert max(np.degrees(np.abs(verdict.spreads["chord"]))) < 0.1
    assert max(np.abs(verdict.spreads["speed"])) < 0.01


@pytest.mark.parametrize(("changed", "words"), [({"speed": 80.0}, "shaft deflection limit")])
def test_what_cannot_be_is_named_with_a_speed_that_can(tmp_path, changed, words):
    task, rig = task_of(tmp_path, points=121, **changed)
    swing = solve(task, rig)
    assert swing.status == INFEASIBLE and swing.fastest is not None
    assert words in swing.sentence and " s." in swing.sentence
    slower = replace(task, impact=replace(task.impact, clubhead_speed=swing.fastest))
    assert solve(slower, rig).status == SOLVED
    faster = replace(task, impact=replace(task.impact, clubhead_speed=1.06 * swing.fastest))
    assert solve(faster, rig).status == INFEASIBLE


def test_states_follow_the_unknowns_as_the_steps_do(robust):
    _, rig, swing = robust
    problem, c = swing.problem, swing.found.c
    plant = plant_of(problem, rig)
    motion = problem.drive.at(c)
    steps = plant.steps(swing.found.states, motion)
    maps = condensed(steps, problem.drive, plant.start())
    assert np.abs(maps.at(c) - followed(steps, motion, plant.start())).max() < 1e-8


def test_a_shaped_basis_is_the_basis_shaped():
    shaper = zvd(2.8, 0.16)
    step, splines = 0.002, 30
    plain = jerk_splines(1000 - int(np.ceil(shaper.duration / step)), splines)
    shaped = shaped_basis(1000, step, shaper, splines)
    assert shaped.sum(axis=0) == pytest.approx(plain.sum(axis=0))
    middles = np.arange(1000) + 0.5
    late = (middles @ shaped - np.arange(len(plain)) @ plain - 0.5 * plain.sum(axis=0)) * step
    mean = float(shaper.amplitudes @ shaper.times)
    assert late == pytest.approx(mean * plain.sum(axis=0), rel=1e-9)


def test_a_grid_has_its_impact_off_the_points():
    grid = make_grid(2.0, 1000, 1.6, 0.0005)
    assert grid.marks[grid.impact] == 1.6 and len(grid.marks) == 1002
    assert grid.lengths[grid.struck].sum() == pytest.approx(0.0005)
    assert np.abs(grid.points - grid.marks[grid.at_points]).max() == 0.0


@pytest.mark.slow
def test_the_planar_swing_is_at_the_ball_when_another_integrator_plays_its_file(tmp_path):
    task, rig = task_of(tmp_path, "planar", points=401, scenarios=3)
    swing = solve(task, rig)
    assert swing.status == SOLVED
    factors = np.array([0.9, 1.0, 1.1])
    verdict = examine(swing.profile, task, rig, factors)
    assert verdict.passed, verdict.failures
    assert abs(verdict.errors["speed"]) < 0.01
    assert verdict.residual.max() < 5e-4
    assert all(use.ratio <= 1.001 for use in excess(swing.profile, task.limits))
