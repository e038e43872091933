"""The optimal swing of the linear robot as a user of dymos would write it: two phases and SLSQP."""

from __future__ import annotations

import contextlib
import importlib
import importlib.util
import io
import os
import tempfile
import time
import warnings
from collections.abc import Iterator
from typing import Any

import numpy as np

from ...model.linear import Port, state_space
from ...model.rig import Rig
from ...optimize.solve_grid import Maps, Motors, followed
from ...optimize.solve_linear import robot_of
from ...optimize.solve_problem import Problem, first_guess
from ...optimize.solve_program import (
    RING,
    bend_rows,
    impact_of,
    jerk_cost,
    reading,
    ring_factor,
    swing_rows,
    vibration_cost,
    wanted,
)
from ...optimize.solve_scenarios import plant_of, stated
from .swing_rockit import Solved, within

SEGMENTS, ORDER = (12, 4), 3
"""Segments of Radau's collocation before the ball and after it [-], and their order."""

MOST_ITERATIONS = 300
"""Steps of SLSQP, the one optimizer that comes with it from the package index [-]."""

SIZES = {
    "motors": np.array([1.0, 10.0, 200.0, 1.0, 20.0, 500.0]),
    "club": np.array([1.0, 0.01, 0.1, 0.1, 20.0, 0.1, 1.0, 1.0]),
}
"""By which states are scaled [SI]."""

FIRMNESS = 1e-6
"""What SLSQP is told to stop at [-]."""


def has_dymos() -> bool:
    """Whether dymos, an extra that only this needs, is installed."""
    return importlib.util.find_spec("dymos") is not None


def by_dymos(problem: Problem, rig: Rig) -> Solved:
    """Solve a linear swing of one robot without a ball, by collocation in two phases.

    Args:
        problem: of fidelity ``thesis`` with one scenario, no ball, and limits of the shaft.
        rig: the robot.

    Returns:
        Time, cost and status.
    """
    with warnings.catch_warnings(), _elsewhere():
        warnings.simplefilter("ignore")
        dymos: Any = importlib.import_module("dymos")
        openmdao: Any = importlib.import_module("openmdao.api")
        began = time.perf_counter()
        model = openmdao.Problem(reports=False)
        model.driver = openmdao.ScipyOptimizeDriver(
            optimizer="SLSQP", maxiter=MOST_ITERATIONS, tol=FIRMNESS, disp=False
        )
        model.driver.declare_coloring(show_summary=False)
        course = dymos.Trajectory()
        model.model.add_subsystem("course", course)
        hit, end = float(problem.task.impact.time or 0.0), problem.task.duration[0]
        spans = ((0.0, hit), (hit, end - hit))
        phases = []
        for name, span, count in zip(("before", "after"), spans, SEGMENTS, strict=True):
            phases.append(_phase(dymos, openmdao, problem, rig, span, count))
            course.add_phase(name, phases[-1])
        _join(course, problem, *phases)
        model.setup()
        _begin(phases, problem, spans)
        quiet = io.StringIO()
        with contextlib.redirect_stdout(quiet), contextlib.redirect_stderr(quiet):
            failed = dymos.run_problem(model, run_driver=True, simulate=False, make_plots=False)
        spent = time.perf_counter() - began
        own = float(np.ravel(model.get_val("course.after.timeseries.total"))[-1])
        good = bool(getattr(failed, "success", not failed))
        cost, missed = _played(problem, rig, model)
    words = "solved" if good else "SLSQP gave up"
    told = f"{words}, cost {own:.4g} at its own nodes, {missed:.2g} m/s off when played exactly"
    return Solved(spent, cost, told)


@contextlib.contextmanager
def _elsewhere() -> Iterator[None]:
    """A folder for the files that it writes."""
    here = os.getcwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            yield
        finally:
            os.chdir(here)


def _equations(openmdao: Any, problem: Problem, rig: Rig) -> type:
    """The class of the robot's equations, for the nodes of a phase."""
    numbers, task = problem.scenarios[0], problem.task
    ports = (Port("arm", "angular_acceleration"), Port("wrist", "angular_acceleration"))
    space = state_space(robot_of(rig), numbers, ports)
    a, b = np.asarray(space.a)[:8], np.asarray(space.b)[:8]
    jerks = np.array([task.limits.arm.jerk, task.limits.wrist.jerk])
    speed, length = task.impact.clubhead_speed, task.duration[0]
    weight = task.cost.vibration / (RING * 0.5 * numbers["clubhead_mass"] * speed**2)
    factor = np.sqrt(weight) * ring_factor(numbers)

    class Robot(openmdao.ExplicitComponent):  # type: ignore[misc]
        """The robot's rates, what it costs, and what is limited."""

        def initialize(self) -> None:
            self.options.declare("num_nodes", types=int)

        def setup(self) -> None:
            count = self.options["num_nodes"]
            for name, size in (("motors", 6), ("club", 8)):
                self.add_input(name, shape=(count, size))
            for name, size in (("motors_rate", 6), ("club_rate", 8), ("seen", 3)):
                self.add_output(name, shape=(count, size))
            for name in ("cost", "jerk_0", "jerk_1"):
                self.add_input(name, shape=(count,))
            for name in ("cost_rate", "bend", "total"):
                self.add_output(name, shape=(count,))
            self.declare_coloring(wrt="*", method="cs", show_summary=False)

        def compute(self, inputs: Any, outputs: Any) -> None:
            z, x = inputs["motors"], inputs["club"]
            u = np.stack([inputs["jerk_0"], inputs["jerk_1"]], axis=1)
            rows = [z[:, 1], z[:, 2], u[:, 0] * jerks[0], z[:, 4], z[:, 5], u[:, 1] * jerks[1]]
            outputs["motors_rate"] = np.stack(rows, axis=1)
            drive = np.stack([z[:, 0], z[:, 1], z[:, 3], z[:, 4]], axis=1)
            bends = np.stack([z[:, 2], z[:, 5]], axis=1)
            outputs["club_rate"] = x @ a[:, :8].T + drive @ a[:, 8:].T + bends @ b.T
            moved = swing_rows(numbers, x[:, 4:].T, np.stack([z[:, 1], z[:, 4]]))
            jerk = task.cost.jerk * (u * u).sum(axis=1)
            outputs["cost_rate"] = (jerk + task.cost.vibration * (moved / speed) ** 2) / length
            outputs["bend"] = bend_rows(numbers, x[:, :4].T, True)
            away = x.T.copy()
            away[0] = away[0] - z[:, 0] - z[:, 3]
            outputs["total"] = inputs["cost"] + ((factor @ away) ** 2).sum(axis=0)
            turned = np.stack([z[:, 0], z[:, 3]]), np.stack([z[:, 1], z[:, 4]])
            seen = impact_of(numbers, x.T, *turned, True)
            outputs["seen"] = np.stack([seen[name] for name in wanted(task)], axis=1)

    return Robot


def _phase(
    dymos: Any, openmdao: Any, problem: Problem, rig: Rig, span: tuple[float, float], count: int
) -> Any:
    """One phase with its states, jerks and limits."""
    task = problem.task
    phase = dymos.Phase(
        ode_class=_equations(openmdao, problem, rig),
        transcription=dymos.Radau(num_segments=count, order=ORDER, compressed=True),
    )
    begin, length = span
    phase.set_time_options(
        fix_initial=True, fix_duration=True, initial_val=begin, duration_val=length
    )
    first = begin == 0.0
    for name, size in SIZES.items():
        phase.add_state(
            name, rate_source=f"{name}_rate", targets=[name], shape=size.shape, fix_initial=first,
            ref=size,
        )  # fmt: skip
    phase.add_state("cost", rate_source="cost_rate", targets=["cost"], fix_initial=first, ref=1e-2)
    rows = within(problem)
    for axis, own in enumerate(rows):
        phase.add_control(
            f"jerk_{axis}", targets=[f"jerk_{axis}"], lower=own[3][0], upper=own[3][1], ref=0.1,
            continuity=False, rate_continuity=False,
        )  # fmt: skip
        for order, (low, high) in enumerate(own[:3]):
            phase.add_path_constraint(
                "motors", lower=low, upper=high, ref=high, indices=[3 * axis + order],
                constraint_name=f"motors_{axis}_{order}",
            )  # fmt: skip
    most = task.shaft.deflection_before if first else task.shaft.deflection_after
    phase.add_path_constraint("bend", lower=-most, upper=most, ref=most)
    phase.add_timeseries_output("total")
    return phase


def _join(course: Any, problem: Problem, before: Any, after: Any) -> None:
    """At the ball between the phases, at rest behind them, and what it costs."""
    goals = np.array(list(wanted(problem.task).values()))
    before.add_boundary_constraint("seen", loc="final", equals=goals, shape=(3,))
    still = np.array([1, 2, 4, 5])
    after.add_boundary_constraint("motors", loc="final", equals=0.0, indices=still)
    course.link_phases(["before", "after"], vars=["motors", "club", "cost"])
    after.add_objective("total", loc="final", ref=1e-2)


def _played(problem: Problem, rig: Rig, model: Any) -> tuple[float, float]:
    """Cost [-] and error of the speed at impact [m/s] of its jerks when the exact robot plays them.

    Between its nodes a jerk is the polynomial through those of a segment.
    """
    task, fine = problem.task, stated(problem.task, rig, None, (1.0,), None)
    grid = fine.grid
    middles = 0.5 * (grid.points[1:] + grid.points[:-1])
    columns = []
    for axis in (0, 1):
        jerk = np.zeros(len(middles))
        for name in ("before", "after"):
            times, values = (
                np.ravel(model.get_val(f"course.{name}.timeseries.{one}")).reshape(-1, ORDER + 1)
                for one in ("time", f"jerk_{axis}")
            )
            for t, v in zip(times, values, strict=True):
                inside = (middles >= t[0]) & (middles <= t[-1])
                bend = np.polyfit((t - t[0]) / (t[-1] - t[0]), v, ORDER)
                jerk[inside] = np.polyval(bend, (middles[inside] - t[0]) / (t[-1] - t[0]))
        columns.append(jerk)
    c = np.concatenate(columns)
    plant, motion = plant_of(fine, rig), fine.drive.at(c)
    states = followed(plant.steps(np.zeros(0), motion), motion, plant.start())
    maps, none = Maps(np.zeros((*states.shape, 0)), states), np.zeros((*motion.shape, 0))
    aim = vibration_cost(task, fine.scenarios, grid, maps, Motors(none, motion), fine.ring)[1]
    jerks = jerk_cost(task, grid) @ c
    seen = reading(task, fine.scenarios[0], states[0, grid.impact], motion[grid.impact], True)
    speed = seen.values[seen.names.index("speed")]
    return float(aim @ aim + jerks @ jerks), float(abs(speed))


def _begin(phases: Any, problem: Problem, spans: Any) -> None:
    """The beginning that the other solvers have: motors by least jerk, a club that follows."""
    c, marks = first_guess(problem), problem.grid.marks
    motion = problem.drive.at(c)
    for phase, (begin, length) in zip(phases, spans, strict=True):
        times = np.linspace(begin, begin + length, 201)
        rows = [np.interp(times, marks, motion[:, a, o]) for a in (0, 1) for o in range(4)]
        motors = np.stack([rows[i] for i in (0, 1, 2, 4, 5, 6)], axis=1)
        club = np.zeros((len(times), 8))
        club[:, 0], club[:, 4] = motors[:, 0] + motors[:, 3], motors[:, 1] + motors[:, 4]
        limits = problem.task.limits
        jerks = np.stack([rows[3] / limits.arm.jerk, rows[7] / limits.wrist.jerk], axis=1)
        phase.set_state_val("motors", motors, times)
        phase.set_state_val("club", club, times)
        phase.set_state_val("cost", np.zeros(len(times)), times)
        for axis in (0, 1):
            phase.set_control_val(f"jerk_{axis}", np.clip(jerks[:, axis], -0.8, 0.8), times)
