"""A swing's task: what must hold at impact, limits, cost, scenarios, and how the file is read."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from ..model.door import fault, nearest, one_of, read_toml, rule, shown, validated
from ..model.robot import PARAMETERS
from .limits_file import AxisTable, axis_limits
from .profile import Limits

Hold = Literal["chord", "grip", "both", "drive"]

SHAFT_FREQUENCY = "shaft_frequency"
"""The parameter of a scenario that scales the clamped shaft's frequency [-]."""

POSTERIOR = "posterior"
"""The parameter of scenarios that are drawn from posterior samples [-]."""

FEWEST_POINTS, MOST_POINTS = 50, 20_000
"""Points of an axis between which a swing is made [-]."""

MOST_SCENARIOS = 25
"""Scenarios that a task may name [-]; the worst are added between them."""


@dataclass(frozen=True)
class Impact:
    """What must hold at impact.

    Attributes:
        time: instant [s]; None where it is free.
        arm_angle: of the arm [rad].
        wrist_angle: against the arm, of what `hold` names [rad].
        clubhead_speed: of its mass centre, shortening of the shaft included [m/s].
        hold: what is at ``arm_angle + wrist_angle``: chord (wrist pivot to clubhead), grip, both,
            or drive (the motors only).
        force: of the ball on the clubhead [N]; 0 for none.
        duration: of that force [s].
    """

    time: float | None
    arm_angle: float
    wrist_angle: float
    clubhead_speed: float
    hold: Hold = "chord"
    force: float = 0.0
    duration: float = 0.0005


@dataclass(frozen=True)
class ShaftLimits:
    """How far the shaft may bend, and how hard the motors may pull.

    Attributes:
        deflection_before: bend at the head before impact [m].
        deflection_after: and after it [m].
        arm_torque: of the arm's motor on what it carries [N m].
        wrist_torque: of the wrist's motor [N m].
    """

    deflection_before: float = math.inf
    deflection_after: float = math.inf
    arm_torque: float = math.inf
    wrist_torque: float = math.inf


@dataclass(frozen=True)
class Cost:
    """Weights of what is kept small; see `supple.optimize.solve_program` for their units.

    Attributes:
        jerk: of the motors' jerk, as a share of its limit [-].
        vibration: of the clubhead's motion against a rigid club's, and of what rings on [-].
        golfer: of the distance from the golfer's own motion, most near impact [-].
    """

    jerk: float = 1.0
    vibration: float = 1.0
    golfer: float = 1.0


@dataclass(frozen=True)
class Robust:
    """For which robots the swing must do.

    Attributes:
        parameter: ``shaft_frequency`` (the stiffness scales by its square), a parameter of the
            rig, or ``posterior``; empty for the nominal robot alone.
        factors: lowest and highest factor [-].
        scenarios: how many between them, both ends included [-].
        impact: whether pose and speed hold in every scenario.
        file: samples, for ``posterior``.
        draws: of these, what each says of the robot's numbers [SI]; ordered, so that neighbors are
            alike. They are filled in by whoever reads the file.
    """

    parameter: str = ""
    factors: tuple[float, float] = (1.0, 1.0)
    scenarios: int = 1
    impact: bool = False
    file: Path | None = None
    draws: tuple[Mapping[str, float], ...] = ()


@dataclass(frozen=True)
class SwingTask:
    """One swing to be found.

    Attributes:
        path: the file.
        rig: the robot's file.
        golfer: the golfer's motion, if any.
        duration: shortest and longest [s]; the same where it is fixed.
        points: of each axis [-].
        start: arm and wrist angle at rest [rad].
        impact: what must hold then.
        at_rest: whether the motors stand still at the end.
        limits: of the motors.
        shaft: of the shaft and the motors' torque.
        cost: weights.
        quantum: last digit of the file [degrees].
        interpolation: how the controller joins the points.
        robust: for which robots.
        sha256: of the file's bytes.
    """

    path: Path
    rig: Path
    golfer: Path | None
    duration: tuple[float, float]
    points: int
    start: tuple[float, float]
    impact: Impact
    at_rest: bool
    limits: Limits
    shaft: ShaftLimits
    cost: Cost
    quantum: float
    interpolation: Literal["cubic", "pchip", "linear"]
    robust: Robust
    sha256: str = ""


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


class _Duration(_Table):
    min: float = Field(gt=0.0)
    max: float = Field(gt=0.0)

    @model_validator(mode="before")
    @classmethod
    def _bare_number(cls, value: Any) -> Any:
        if isinstance(value, Mapping):
            return value
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise rule("a number of seconds or { min, max }", "write duration = 2.0")
        return {"min": value, "max": value}


class _Swing(_Table):
    rig: str
    golfer: str | None = None
    duration: _Duration
    points: int = Field(default=1000, ge=FEWEST_POINTS, le=MOST_POINTS)


class _Pose(_Table):
    arm_angle: float
    wrist_angle: float


class _Impact(_Table):
    time: float | None = Field(default=None, gt=0.0)
    free: bool = False
    arm_angle: float = 0.0
    wrist_angle: float = 0.0
    clubhead_speed: float = Field(gt=0.0)
    hold: Hold = "chord"
    force: float = 0.0
    duration: float = Field(default=0.0005, gt=0.0)


class _End(_Table):
    at_rest: bool = True


class _Axis(AxisTable):
    jerk: float = Field(gt=0.0)
    torque: float = Field(default=math.inf, gt=0.0, allow_inf_nan=True)


class _Shaft(_Table):
    deflection_before: float = Field(default=math.inf, gt=0.0, allow_inf_nan=True)
    deflection_after: float = Field(default=math.inf, gt=0.0, allow_inf_nan=True)


class _Limits(_Table):
    arm: _Axis
    wrist: _Axis
    shaft: _Shaft = _Shaft()


class _Cost(_Table):
    jerk: float = Field(default=1.0, gt=0.0)
    vibration: float = Field(default=1.0, ge=0.0)
    golfer: float = Field(default=1.0, ge=0.0)


class _Output(_Table):
    quantum: float = Field(default=1e-4, ge=0.0)
    interpolation: Literal["cubic", "pchip", "linear"] = "cubic"


class _Robust(_Table):
    parameter: str = SHAFT_FREQUENCY
    impact: bool = False
    factors: list[float] = Field(default_factory=lambda: [0.9, 1.1])
    scenarios: int = Field(default=3, ge=1, le=MOST_SCENARIOS)
    file: str | None = None


class _File(_Table):
    swing: _Swing
    start: _Pose
    impact: _Impact
    end: _End = _End()
    limits: _Limits
    cost: _Cost = _Cost()
    file: _Output = _Output()
    robust: _Robust | None = None


def read_task(path: Path | str) -> SwingTask:
    """Reads a task and checks that its numbers belong together.

    Args:
        path: a TOML file with ``[swing]``, ``[start]``, ``[impact]`` and ``[limits]``.

    Returns:
        The task, in SI units but for the quantum [degrees]; the files that it names exist, and
        are not read here.

    Raises:
        ValueError: one line with file, place, expected, found and mend.
    """
    path = Path(path)
    document, sha256 = read_toml(path)
    if "swing" not in document:
        found = f"the tables {one_of(document)}" if document else "an empty file"
        mend = "name the file that has [swing]"
        raise fault(path, "[swing]", "a task with a table [swing]", found, mend)
    file = validated(_File, document, path)
    times = file.swing.duration
    if times.max < times.min:
        found = f"{times.min:g} and {times.max:g}"
        raise fault(path, "[swing] duration", "'min' below 'max'", found, "exchange them")
    limits = Limits(
        axis_limits(file.limits.arm, "arm", path), axis_limits(file.limits.wrist, "wrist", path)
    )
    hit, shaft = file.impact, file.limits.shaft
    task = SwingTask(
        path, _beside(path, file.swing.rig, "rig"),
        None if file.swing.golfer is None else _beside(path, file.swing.golfer, "golfer"),
        (times.min, times.max), file.swing.points,
        (file.start.arm_angle, file.start.wrist_angle),
        Impact(
            hit.time, hit.arm_angle, hit.wrist_angle, hit.clubhead_speed, hit.hold, hit.force,
            hit.duration,
        ),
        file.end.at_rest, limits,
        ShaftLimits(
            shaft.deflection_before, shaft.deflection_after,
            file.limits.arm.torque, file.limits.wrist.torque,
        ),
        Cost(file.cost.jerk, file.cost.vibration, file.cost.golfer),
        file.file.quantum, file.file.interpolation, _robust(file.robust, path), sha256,
    )  # fmt: skip
    _check_impact(task, hit.free)
    _check_angles(task)
    return task


def _beside(path: Path, name: str, key: str) -> Path:
    found = path.parent / name
    if not found.is_file():
        what = "a directory" if found.is_dir() else f"no file '{name}'"
        mend = f"put it beside {path.name}, or correct the name"
        raise fault(path, f"[swing] {key}", "an existing file", what, mend)
    return found


def _robust(table: _Robust | None, path: Path) -> Robust:
    if table is None:
        return Robust()
    known = (SHAFT_FREQUENCY, POSTERIOR, *PARAMETERS)
    if table.parameter not in known:
        mend = f"write '{nearest(table.parameter, known) or SHAFT_FREQUENCY}'"
        found = f"'{table.parameter}'"
        raise fault(path, "[robust] parameter", one_of(known, 40), found, mend)
    if table.parameter == POSTERIOR:
        if table.file is None:
            mend = "add file = 'posterior.nc'"
            raise fault(path, "[robust] file", "the samples of a posterior", "nothing", mend)
        file = path.parent / table.file
        if not file.is_file():
            mend = "run `supple identify --posterior`, or correct the name"
            raise fault(path, "[robust] file", "an existing file", f"'{table.file}'", mend)
        return Robust(POSTERIOR, (1.0, 1.0), table.scenarios, table.impact, file)
    pair = table.factors
    if len(pair) != 2 or not 0.0 < pair[0] <= 1.0 <= pair[1]:
        mend = "write factors = [0.9, 1.1]"
        expected = "[lowest, highest] with 0 < lowest <= 1 <= highest"
        raise fault(path, "[robust] factors", expected, shown(pair), mend)
    return Robust(table.parameter, (pair[0], pair[1]), table.scenarios, table.impact)


def _check_impact(task: SwingTask, free: bool) -> None:
    at, (_, longest) = task.impact, task.duration
    if at.time is None and not free:
        mend = "add time = 1.6, or free = true"
        raise fault(task.path, "[impact] time", "an instant, or free = true", "nothing", mend)
    if at.time is not None and free:
        mend = "remove one of them"
        raise fault(task.path, "[impact]", "either 'time' or free = true", "both", mend)
    if at.time is not None and not at.time + at.duration < longest:
        expected = f"an instant before the end of the swing, {longest:g} s"
        mend = "hit earlier, or let the swing last longer"
        raise fault(task.path, "[impact] time", expected, f"{at.time:g} s", mend)


def _check_angles(task: SwingTask) -> None:
    """An angle beyond its limit at the start or at impact can never be reached: say so here."""
    for place, pose in (("start", task.start), ("impact", (task.impact.arm_angle, None))):
        for axis, angle in zip(("arm", "wrist"), pose, strict=True):
            low, high = getattr(task.limits, axis).angle
            if angle is not None and not low <= angle <= high:
                expected = f"an angle within [limits] {axis} angle, {low:g} to {high:g} rad"
                mend = "change it, or the limit"
                raise fault(task.path, f"[{place}] {axis}_angle", expected, f"{angle:g}", mend)
