"""The gauges of one recorded swing, read on the points of its profile with what is not known."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from ..identification.one_clock import OwnClock
    from ..identification.records import Channel, Record
    from ..identification.resolve import Carrier, Relative
    from ..identification.strain import Calibration
    from ..identification.swing_channels import SwingChannels
    from ..optimize.profile import SwingProfile

NEEDED = ("toe", "lead", "toe_strain", "lead_strain")
"""Channels of a record: two accelerations at the head [m/s^2] and two strains of the shaft [1]."""

PARTNERS = {"toe_strain": "toe", "lead_strain": "lead"}
"""Which accelerometer moves as a gauge does: the shaft's force moves the head."""

PRESET = "robo_v_sleeve_50"

SLOPE = 1.5
"""Turn of the end of a bar clamped at the other, times its length, for its deflection [-]."""

CLEAR = 0.010
"""How long before impact the collet's motion is taken off: resampling spreads the blow [s]."""

BENT = 0.01
"""Below this p-value a calibration's line is said to bend [-]."""


@dataclass(frozen=True, eq=False)
class SwingRead:
    """One swing's gauges.

    Attributes:
        name: of the record.
        found: its channels in the swing plane [m/s^2, m].
        relative: the head's acceleration less the collet's up to the blow, with its error.
        clocks: of each channel, as JSON can hold it.
        calibrations: of each strain, as JSON can hold it.
        profile_std: ``grip`` [rad] and ``impact`` [s] of the profile; only those stated.
        words: what was done to bring the channels together, in sentences.
        warnings: what is in doubt, in sentences.
    """

    name: str
    found: SwingChannels
    relative: Relative
    clocks: tuple[dict[str, Any], ...]
    calibrations: tuple[dict[str, Any], ...]
    profile_std: Mapping[str, float]
    words: tuple[str, ...]
    warnings: tuple[str, ...]


def stated_errors(folder: Path, inputs: dict[str, str]) -> dict[str, float]:
    """How far a profile's grip lies off its markers near the impact, where `profile.json` says it.

    Args:
        folder: that `supple profile` wrote into.
        inputs: takes up the SHA-256 of the file.

    Returns:
        ``grip`` [rad], or nothing.
    """
    from ..model.door import sha256_of

    path = folder / "profile.json"
    if not path.is_file():
        return {}
    content = path.read_bytes()
    try:
        grip = float(json.loads(content)["impact"]["near"]["grip"])
    except (ValueError, KeyError, TypeError):
        return {}
    inputs[str(path)] = sha256_of(content)
    return {"grip": grip}


def read_swing(
    record: Record, profile: SwingProfile, stated: Mapping[str, float] | None = None, seed: int = 0
) -> SwingRead:
    """The gauges of a swing on the points of its profile, in the swing plane, with their errors.

    Each channel is read by its own clock: that of the record, of its own file with
    ``clock_offset``, or, where that is not told, the one at which blow and motion meet those of
    the accelerometer beside it. Strain becomes metres by the sidecar's readings,
    ``[channels.NAME.calibration]`` with ``deflection`` and ``reading``, whose errors then stand in
    place of ``tolerance``; else by the thesis's 0.024 per metre with ``tolerance`` as its error.
    ``[profile]`` in the sidecar states ``grip_std`` [rad] and ``impact_std`` [s].

    Args:
        record: with the channels of `NEEDED` [SI].
        profile: of the same swing [s, rad].
        stated: errors of the profile where the record states none, as of `stated_errors`.
        seed: of the draws behind the error of head less collet.

    Returns:
        Its channels [m/s^2, m], and the head's acceleration less the collet's up to the blow.

    Raises:
        ValueError: where no impact is found, or a clock is neither told nor to be found.
    """
    from ..identification.lowpass import STRAIN_CUTOFFS
    from ..identification.resolve import relative_acceleration
    from ..identification.swing_channels import GripTurn, swing_channels
    from ..identification.swing_errors import relative_std

    channels = {name: record.channel(name) for name in NEEDED}
    own = _clocks(record, channels)
    both = tuple(_calibration(channels[name]) for name in NEEDED[2:])
    known = {**(stated or {}), **record.profile_std}
    turn = GripTurn(
        profile.time, profile.angles[:, 2], profile.impact_time, known.get("impact", 0.0),
        known.get("grip", 0.0),
    )  # fmt: skip
    try:
        found = swing_channels(_gauges(channels, own), turn, (both[0], both[1]))
    except ValueError as error:
        raise ValueError(f"{record.path}: {error}") from None
    before, carrier = before_blow(found), _carrier(record)
    if before.sum() < FEWEST:
        raise _apart(record, int(before.sum()))
    angles = profile.angles[before]
    relative = relative_acceleration(
        profile.time[before], found.acceleration.in_plane[before], angles[:, 0], angles[:, 1],
        carrier, found.deflection.in_plane[before], STRAIN_CUTOFFS[0],
    )  # fmt: skip
    std = relative_std(found.errors, before, angles[:, :2], carrier, STRAIN_CUTOFFS[0], seed)
    return SwingRead(
        record.name,
        found,
        replace(relative, std=std),
        tuple(_told_clock(own[name]) for name in NEEDED),
        tuple(_told_calibration(name, one) for name, one in zip(NEEDED[2:], both, strict=True)),
        known,
        tuple(dict.fromkeys(own[name].sentence for name in NEEDED if own[name].sentence)),
        _warnings(own, dict(zip(NEEDED[2:], both, strict=True)), known),
    )


FEWEST = 32
"""Fewest points before impact that all gauges saw [-]."""


def _apart(record: Record, count: int) -> ValueError:
    from ..model.door import fault

    expected = f"at least {FEWEST} points before impact that all gauges saw"
    mend = "correct clock_offset, or name records of the same swing"
    return fault(record.path, "[channels]", expected, f"{count}", mend)


def _clocks(record: Record, channels: Mapping[str, Channel]) -> dict[str, OwnClock]:
    """By name; those of the lead accelerometer, whose clock meets the profile's, at first."""
    from ..identification.instant import impact_instant
    from ..identification.one_clock import own_clocks

    lead = channels["lead"]
    blow = impact_instant(lead.values, lead.sample_rate, lead.start_time)
    order = [lead, *(one for name, one in channels.items() if name != "lead")]
    found = own_clocks(record.path, order, PARTNERS, None if blow.status == "none" else blow.time)
    return {one.name: one for one in found}


def _gauges(channels: Mapping[str, Channel], own: Mapping[str, OwnClock]) -> Any:
    from ..identification.swing_channels import Gauges

    toe, lead, *strains = (channels[name] for name in NEEDED)
    clocks = tuple(own[name].clock for name in NEEDED)
    return Gauges(
        lead.sample_rate, toe.values, lead.values, *(one.values for one in strains),
        noise=(toe.noise or 0.0, lead.noise or 0.0),
        strain_noise=(strains[0].noise or 0.0, strains[1].noise or 0.0),
        clocks=(clocks[0], clocks[1], clocks[2], clocks[3]),
        strain_clock_std=max(own[name].std for name in NEEDED[2:]),
    )  # fmt: skip


def _calibration(one: Channel) -> Calibration:
    from ..identification.strain import STRAIN_PER_METER, Calibration

    if one.calibration is not None:
        return one.calibration
    gain, zero = (one.tolerance.get(name, 0.0) for name in ("gain", "offset"))
    return Calibration(gain_std=STRAIN_PER_METER * gain, zero_std=zero)


def _told_clock(one: OwnClock) -> dict[str, Any]:
    is_found = one.way == "found"
    return {
        "channel": one.name,
        "way": one.way,
        "rate": {"value": one.clock.rate, "unit": "Hz"},
        "start": {"value": one.clock.start, "std": one.std, "unit": "s"},
        "correlation": one.correlation if is_found else None,
    }


def _told_calibration(name: str, one: Calibration) -> dict[str, Any]:
    return {
        "channel": name,
        "gain": {"value": one.gain, "std": one.gain_std, "unit": "1/m"},
        "zero": {"value": one.zero, "std": one.zero_std, "unit": "1"},
        "readings": one.count,
        "bend_p_value": one.curvature_p,
    }


def _warnings(
    own: Mapping[str, OwnClock], calibrations: Mapping[str, Calibration], known: Mapping[str, float]
) -> tuple[str, ...]:
    said = []
    for name, one in calibrations.items():
        if one.curvature_p is not None and one.curvature_p < BENT:
            said.append(
                f"{name}: its readings bend away from a line (p = {one.curvature_p:.2g}); the "
                "gain holds for deflections like those of the readings."
            )
    untold = [text for key, text in (("impact", "instant of impact"), ("grip", "grip's angle"))
              if key not in known]  # fmt: skip
    if untold:
        said.append(
            f"No error of the profile's {' and of its '.join(untold)} is stated; none is in the "
            "errors. [profile] in the sidecar takes impact_std [s] and grip_std [rad]."
        )
    return tuple(said)


def _carrier(record: Record) -> Carrier:
    """Lengths and masses by the record's rig, or by the preset with the thesis's final wrist."""
    from ..identification.resolve import Carrier
    from ..model.rig import read_rig
    from ..model.robot import PRESETS
    from .thesis.runs import FINAL_WRIST

    p = PRESETS[PRESET] | dict(zip(("wrist_stiffness", "wrist_damping"), FINAL_WRIST, strict=True))
    if record.rig_path is not None:
        rig = read_rig(record.rig_path)
        p = p | {name: one.value for name, one in rig.parameters.items()}
    p = p | record.parameters
    grip = p["sleeve_offset"] + p["sleeve_spacing"] / 2
    shaft = p["club_length"] - p["grip_length"] / 2
    return Carrier(
        grip + shaft,
        p["arm_length"],
        p["collet_inertia"] + p["grip_inertia"] + p["grip_mass"] * grip**2,
        p["collet_mass"] * p["collet_centre"] + p["grip_mass"] * grip,
        p["clubhead_mass"],
        p["wrist_stiffness"],
        p["wrist_damping"],
        SLOPE / shaft,
    )


def before_blow(found: SwingChannels) -> np.ndarray:
    """Points that all gauges saw and that lie clear of the blow, shape (p,) [-]."""
    impact = found.shift.ours(np.array([found.impact.time]))[0]
    return found.is_known & (found.points < impact - CLEAR)
