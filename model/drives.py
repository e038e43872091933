"""What moves a mechanism: release, impact, torque and prescribed joints, with all their jumps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import jax.numpy as jnp
import numpy as np

from .chain import Chain
from .door import fault, nearest, one_of, shown
from .drive_file import DriveSpec, read_profile
from .energies import stiffness_matrix
from .linear import Array, Mechanism, Port
from .prescribed import Prescribed, shaped, through
from .robot import MODELS, Robot

MOST_EDGES = 10_000
"""Most jumps that one drive may have [-]; beyond that a period is in the wrong unit."""

STILL = 0.01
"""A profile that is held at an end must rest there, to this share of its fastest motion [-]."""

ON_SAMPLE = 1e-9
"""A jump this close to a sample, as a share of the sampling interval, falls on it [-]."""


@dataclass(frozen=True)
class Hold:
    """A displacement from which a mechanism is let go: held at one place, in balance elsewhere.

    Attributes:
        place: where the hand holds, by a force or torque alone.
        frame: in which the displacement is meant: ``absolute`` or ``collet``.
        displacement: of that place; of a link its stretch [m or rad].
    """

    place: str
    frame: str
    displacement: float


@dataclass(frozen=True)
class Drive:
    """A force that is constant, or a sine, between the instants at which it jumps, and joints.

    The jumps are kept as instants and never rounded to samples, so that an impact gives its
    whole impulse at any sampling rate.

    Attributes:
        port: where the force or torque acts; None where nothing drives the motion.
        edges: instants of the jumps, ascending, none before the first sample [s].
        levels: force from each edge on; zero before the first [N or N m].
        frequency: 0 for a constant force; otherwise the force is
            ``level sin(frequency (t - edges[0]))`` [rad/s].
        hold: what a release lets go of; None for a start at rest.
        joints: angles that motors hold; told to the mechanism by their accelerations.
    """

    port: Port | None = None
    edges: tuple[float, ...] = ()
    levels: tuple[float, ...] = ()
    frequency: float = 0.0
    hold: Hold | None = None
    joints: tuple[Prescribed, ...] = ()

    @property
    def ports(self) -> tuple[Port, ...]:
        """Where inputs act on the mechanism: that of the force, then the prescribed joints [-]."""
        joints = tuple(Port(each.joint, "angular_acceleration") for each in self.joints)
        return joints if self.port is None else (self.port, *joints)

    def level(self, times: np.ndarray, tolerance: float = 0.0) -> np.ndarray:
        """Level at each time [s], the new one at a jump or up to `tolerance` [s] before it.

        Returns:
            Shape of `times` [N or N m].
        """
        known = np.concatenate([[0.0], self.levels])
        return known[np.searchsorted(self.edges, np.asarray(times) + tolerance, side="right")]

    def force(self, times: np.ndarray, tolerance: float = 0.0) -> np.ndarray:
        """Force at each time [s], the new one at a jump; see `level`.

        Returns:
            Shape of `times` [N or N m].
        """
        level = self.level(times, tolerance)
        if not self.frequency:
            return level
        return level * np.sin(self.frequency * (np.asarray(times) - self.edges[0]))

    def sampled(self, times: np.ndarray) -> np.ndarray:
        """The inputs at uniform samples, shape (t, ports) [N, N m or rad/s^2]: the new at a jump.

        Jumps between samples are not in it; `supple.model.motion` cuts the motion there instead.

        Args:
            times: samples [s].
        """
        tolerance = ON_SAMPLE * float(times[1] - times[0])
        columns = [] if self.port is None else [self.force(times, tolerance)]
        columns += [joint.at(times, times + tolerance)[:, 2] for joint in self.joints]
        return np.stack(columns, axis=1) if columns else np.zeros((len(times), 0))


def release(place: str, displacement: float, frame: str = "absolute") -> Drive:
    """Let go from rest, out of the balance in which `place` is held at `displacement` [m or rad].

    Args:
        place: where the hand holds.
        displacement: of that place [m or rad].
        frame: ``absolute``, or ``collet`` for a displacement relative to the collet.

    Returns:
        The drive; nothing acts from the first sample on.
    """
    return Drive(hold=Hold(place, frame, displacement))


def impact(place: str, force: float, start: float, duration: float) -> Drive:
    """A rectangular pulse on a mechanism at rest.

    Args:
        place: where it acts.
        force: its height [N, or N m where the place turns].
        start: when it begins [s].
        duration: how long it lasts [s].

    Returns:
        The drive; its impulse is ``force * duration`` wherever its edges fall.
    """
    port = Port(place, "force", held=True)
    return Drive(port, (start, start + duration), (force, 0.0))


def torque(place: str, times: tuple[float, ...], values: tuple[float, ...]) -> Drive:
    """A piecewise constant torque or force on a mechanism at rest; zero before its first time.

    Args:
        place: where it acts.
        times: when it changes, ascending [s]; the last one up to 0 rules at the first sample.
        values: what it is from each of these times on [N m, or N where the place moves].

    Returns:
        The drive.
    """
    first = max(int(np.searchsorted(times, 0.0, side="right")) - 1, 0)
    edges = tuple(max(float(time), 0.0) for time in times[first:])
    return Drive(Port(place, "torque", held=True), edges, tuple(values[first:]))


def wave(
    place: str, shape: str, amplitude: float, period: float, start: float, end: float
) -> Drive:
    """A square or sine wave on a mechanism at rest, zero before `start` and from `end` on.

    Args:
        place: where it acts.
        shape: ``square``, which begins with ``+amplitude`` for half a period, or ``sine``.
        amplitude: its height [N m, or N where the place moves].
        period: length of one wave [s].
        start: when it begins [s].
        end: when it ends [s].

    Returns:
        The drive.
    """
    port = Port(place, "torque", held=shape == "square")
    if shape == "sine":
        return Drive(port, (start, end), (amplitude, 0.0), 2 * np.pi / period)
    count = int(np.ceil((end - start) / (0.5 * period) - ON_SAMPLE))
    edges = tuple(start + 0.5 * period * k for k in range(count))
    levels = tuple(amplitude if k % 2 == 0 else -amplitude for k in range(count))
    return Drive(port, (*edges, end), (*levels, 0.0))


def drive_of(spec: DriveSpec, mechanism: Mechanism) -> Drive:
    """From a drive's file to the drive of a mechanism.

    Args:
        spec: as read from the file, in SI units.
        mechanism: what is driven; tells which places there are.

    Returns:
        The drive, with every jump inside the simulated time.

    Raises:
        ValueError: one line with file, place, expected, found and mend: for a joint that the
            mechanism cannot drive, a place that it does not have, a jump that comes too late, or
            a profile that cannot be read.
    """
    if spec.kind in ("wrist", "swing"):
        _check_joint(spec, mechanism)
        _check_begin(spec)
        return _swing_of(spec, mechanism) if spec.kind == "swing" else _wrist_of(spec)
    places = drive_places(mechanism)
    if spec.place not in places:
        mend = f"write place = '{nearest(spec.place, places) or places[0]}'"
        raise fault(spec.path, "[drive] place", one_of(places), f"'{spec.place}'", mend)
    if spec.kind == "release":
        return _release_of(spec, mechanism)
    _check_begin(spec)
    if spec.kind == "impact":
        return impact(spec.place, spec.force, spec.start, spec.drive_duration or 0.0)
    end = _end_of(spec)
    if spec.shape is None:
        return _steps_of(spec, end)
    _check_period(spec, end)
    period = spec.period or 1.0
    return wave(spec.place, spec.shape, spec.amplitude or 0.0, period, spec.start, end)


def _end_of(spec: DriveSpec) -> float:
    return spec.duration if spec.drive_duration is None else spec.start + spec.drive_duration


def _check_period(spec: DriveSpec, end: float) -> None:
    period = spec.period or 1.0
    if 2 * (min(end, spec.duration) - spec.start) / period > MOST_EDGES:
        expected = f"at most {MOST_EDGES} half periods"
        raise fault(spec.path, "[drive] period", expected, shown(period), "write it in s")


def _check_joint(spec: DriveSpec, mechanism: Mechanism) -> None:
    """A drive of the wrist or of a swing needs a model in which that joint is driven."""
    joint = "wrist" if spec.kind == "wrist" else "arm"
    if spec.place != joint:
        expected = f"the place '{joint}' for a drive of kind '{spec.kind}'"
        raise fault(spec.path, "[drive] place", expected, f"'{spec.place}'", "remove 'place'")
    if joint not in mechanism.grounds:
        able = [model for model in MODELS if joint in Robot(model).grounds]
        found = (
            f"a robot of model '{mechanism.model}'" if isinstance(mechanism, Robot) else "a chain"
        )
        expected = f"a rig whose {joint} is driven by '{spec.kind}': model {one_of(able)}"
        mend = f"write model = '{able[0]}' in the rig, or another kind of drive"
        raise fault(spec.path, "[drive] kind", expected, found, mend)


def _wrist_of(spec: DriveSpec) -> Drive:
    if spec.file is not None:
        return Drive(joints=_joints(spec, ("wrist",)))
    end, period = _end_of(spec), spec.period or 1.0
    _check_period(spec, end)
    shape, amplitude = spec.shape or "sine", spec.amplitude or 0.0
    joint = shaped("wrist", shape, amplitude, period, spec.start, end, spec.duration)
    return Drive(joints=(joint,))


def _swing_of(spec: DriveSpec, mechanism: Mechanism) -> Drive:
    """The arm, the wrist where the mechanism drives it, and the ball, on the profile's clock."""
    drive, ball = Drive(joints=_joints(spec, mechanism.grounds)), spec.impact
    if ball is None:
        return drive
    start = spec.start + ball.time
    if start >= spec.duration:
        expected = f"a time before the end of [times], {spec.duration:g} s"
        mend = "hit earlier, or simulate longer"
        raise fault(spec.path, "[drive] impact time", expected, f"{start:g} s", mend)
    return replace(impact("clubhead", ball.force, start, ball.duration), joints=drive.joints)


def _joints(spec: DriveSpec, joints: tuple[str, ...]) -> tuple[Prescribed, ...]:
    assert spec.file is not None
    columns = read_profile(spec.file, tuple(f"{joint}_angle" for joint in joints))
    times = spec.start + columns["time"]
    if len(times) > MOST_EDGES:
        raise fault(spec.file, "", f"at most {MOST_EDGES} rows", f"{len(times)}", "leave some out")
    if times[0] >= spec.duration:
        expected = f"a first time before the end of [times], {spec.duration:g} s"
        raise fault(spec.file, "column 'time'", expected, f"{times[0]:g} s", "simulate longer")
    found = []
    for joint in joints:
        angles = columns[f"{joint}_angle"]
        found.append(through(joint, times.tolist(), angles.tolist(), spec.duration))
        _check_still(spec, times, found[-1])
    return tuple(found)


def _check_still(spec: DriveSpec, times: np.ndarray, joint: Prescribed) -> None:
    """A motor that starts or stops dead is a profile that was cut off."""
    inside = np.clip(times, 0.0, spec.duration)
    fastest = float(np.max(np.abs(joint.at(inside)[:, 1]), initial=0.0))
    for edge, jump in zip(joint.edges, joint.jumps[:, 1], strict=True):
        if abs(jump) > STILL * fastest:
            assert spec.file is not None
            end = "begins" if edge < times[-1] else "ends"
            expected = f"a profile that rests where it {end}, at {edge:g} s, inside [times]"
            found = f"{jump:.3g} rad/s there"
            mend = "lengthen the profile until it rests, or change 'duration' or 'start'"
            raise fault(spec.file, f"column '{joint.joint}_angle'", expected, found, mend)


def drive_places(mechanism: Mechanism) -> tuple[str, ...]:
    """Where a force or torque can act on a mechanism, or a hand can hold it [-]."""
    if isinstance(mechanism, Chain):
        return tuple(mechanism.law_places())
    turning = ("collet", "wrist", "hand") if "collet_angle" in mechanism.coordinates else ()
    return ("clubhead", "grip", *turning)


def _release_of(spec: DriveSpec, mechanism: Mechanism) -> Drive:
    if spec.start > 0:
        mend = "leave 'start' out: the motion begins with the release"
        raise fault(spec.path, "[drive] start", "0 for a release", shown(spec.start), mend)
    if spec.clubhead_deflection is None:
        return release(spec.place, spec.displacement or 0.0)
    if spec.place != "clubhead":
        mend = "write displacement instead, or remove 'place'"
        place = "[drive] clubhead_deflection"
        raise fault(spec.path, place, "the place 'clubhead'", f"'{spec.place}'", mend)
    frame = "absolute" if isinstance(mechanism, Chain) else "collet"
    return release(spec.place, spec.clubhead_deflection, frame)


def _check_begin(spec: DriveSpec) -> None:
    """A drive that begins after the last sample would move nothing, in silence."""
    begin = spec.start + (spec.times[0] if spec.times else 0.0)
    if begin >= spec.duration:
        place = "[drive] times" if spec.times else "[drive] start"
        expected = f"a beginning before the end of [times], {spec.duration:g} s"
        mend = "begin earlier, or simulate longer"
        raise fault(spec.path, place, expected, f"{begin:g} s", mend)


def _steps_of(spec: DriveSpec, end: float) -> Drive:
    times = tuple(spec.start + time for time in spec.times)
    kept = [(time, value) for time, value in zip(times, spec.values, strict=True) if time < end]
    if spec.drive_duration is not None:
        kept.append((end, 0.0))
    if len(kept) > MOST_EDGES:
        expected = f"at most {MOST_EDGES} of them"
        raise fault(spec.path, "[drive] times", expected, f"{len(kept)}", "leave some out")
    return torque(spec.place, tuple(t for t, _ in kept), tuple(v for _, v in kept))


def equilibrium(mechanism: Mechanism, p: Mapping[str, Any], hold: Hold) -> tuple[Array, Array]:
    """Balance of the linear mechanism under the force that holds one place displaced.

    On a pinned wrist the collet turns along as far as that force turns it.

    Args:
        mechanism: chain or robot.
        p: its numbers by name [SI]; may be traced.
        hold: the place and its displacement.

    Returns:
        coordinates, shape (n,) [m or rad], and the force or torque of the hand [N or N m]. They
        are not finite, or miss the displacement, where no such balance exists.

    Source: ``K q = f F`` with ``s q = d``, solved together; tests/model/test_drives.py.
    """
    n = len(mechanism.coordinates)
    stiffness = stiffness_matrix(mechanism.rows(p))[:n, :n]
    push, seen = hold_rows(mechanism, p, hold)
    scale = jnp.maximum(jnp.max(jnp.abs(stiffness)), 1e-300)
    top = jnp.concatenate([stiffness / scale, -push[:, None]], axis=1)
    bordered = jnp.concatenate([top, jnp.append(seen, 0.0)[None]])
    solved = jnp.linalg.solve(bordered, jnp.zeros(n + 1).at[n].set(hold.displacement))
    return solved[:n], solved[n] * scale


def hold_rows(mechanism: Mechanism, p: Mapping[str, Any], hold: Hold) -> tuple[Array, Array]:
    """Generalized force of the hand's unit force, and the row that sees the displacement [1, m]."""
    n = len(mechanism.coordinates)
    quantity = "angle" if mechanism.turns(hold.place) else "position"
    seen = mechanism.sensor_row(hold.place, quantity, hold.frame, p)[:n]
    return mechanism.force_row(hold.place, p), seen


def check_balance(coordinates: np.ndarray, found: np.ndarray, hold: Hold) -> None:
    """Refuse a start that is no balance.

    Args:
        coordinates: of each design, shape (..., n) [m or rad].
        found: displacement of the place held, for each design [m or rad].
        hold: the place and the displacement wanted.

    Raises:
        ValueError: where anything is not finite, or misses what was wanted.
    """
    missed = ~(np.abs(found - hold.displacement) <= 1e-6 * abs(hold.displacement))
    if np.any(missed) or not np.all(np.isfinite(coordinates)):
        raise ValueError(
            f"release at {hold.place!r}: expected springs that hold the rig in balance at "
            f"{hold.displacement:g}, found none that do (a stiffness is zero, a law takes it away, "
            "or the bent club does not reach so far). Mend: give the rig a stiffness there, or "
            "release another place or from nearer."
        )
