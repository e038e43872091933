"""What a record is and shows before anything is fitted: numbers, and warnings in sentences."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from .records import Channel, Record
from .signals import dominant_frequency, noise_std, quantization_step

FEWEST_PER_PERIOD = 8.0
"""Samples a period of the main frequency below which motion is seen coarsely [-]."""

FEWEST_PERIODS = 3.0
"""Periods of the main frequency below which a record is short [-]."""

COARSE_STEP = 0.02
"""Step of the converter over the span from which on it is called coarse [-]."""

LOUD_NOISE = 0.1
"""Noise over the spread of the signal from which on it is called loud [-]."""


def describe(record: Record) -> dict[str, Any]:
    """What a record is and shows, as plain tables and numbers that JSON can hold.

    Args:
        record: the record.

    Returns:
        ``name``, ``file``, ``test``, ``split``, ``description``, ``rig``, ``n_samples``,
        ``sample_rate`` [Hz], ``duration`` [s], ``channels`` by name, ``parameters`` and ``start``
        [SI], ``warnings`` in sentences, ``files`` with their SHA-256.
    """
    channels = {channel.name: _statistics(channel) for channel in record.channels}
    warnings = [*record.warnings]
    for channel in record.channels:
        warnings += _findings(channel.name, channels[channel.name])
    if record.rig_path is None:
        warnings.append("No rig is named: add 'rig' in [record], or give --rig.")
    return {
        "name": record.name,
        "file": str(record.path),
        "test": record.test,
        "split": record.split,
        "description": record.description,
        "rig": None if record.rig_path is None else str(record.rig_path),
        "n_samples": len(record.times),
        "sample_rate": record.sample_rate,
        "duration": float(record.times[-1]),
        "channels": channels,
        "parameters": dict(record.parameters),
        "start": dict(record.start),
        "warnings": warnings,
        "files": dict(record.files),
    }


def _statistics(channel: Channel) -> dict[str, Any]:
    values, rate, clipped = channel.values, channel.sample_rate, channel.clipped
    return {
        "role": channel.role,
        "quantity": channel.quantity,
        "place": channel.place,
        "frame": channel.frame,
        "unit": channel.unit,
        "n_samples": len(values),
        "sample_rate": rate,
        "start_time": channel.start_time,
        "duration": (len(values) - 1) / rate,
        "clock_unknown": channel.clock_unknown,
        "held": channel.held,
        "first": float(values[0]),
        "low": float(values.min()),
        "high": float(values.max()),
        "span": float(np.ptp(values)),
        "mean": float(values.mean()),
        "rms": float(np.sqrt(np.mean(np.square(values)))),
        "dominant_frequency": dominant_frequency(values, rate),
        "noise_stated": channel.noise,
        "noise_estimate": noise_std(values, rate),
        "quantization_step": quantization_step(values),
        "clipping": None if clipped is None else asdict(clipped),
        "tolerance": dict(channel.tolerance),
    }


def _findings(name: str, seen: dict[str, Any]) -> list[str]:
    """What deserves a second look in one channel, in sentences."""
    unit = "" if seen["unit"] == "1" else f" {seen['unit']}"
    found = []
    if (clipped := seen["clipping"]) is not None:
        levels = [clipped[key] for key in ("low", "high") if clipped[key] is not None]
        at = " and ".join(f"{level:.6g}{unit}" for level in levels)
        doubt = " (or commanded so)" if seen["role"] == "input" else ""
        tops = f"{clipped['runs']} flat top{'' if clipped['runs'] == 1 else 's'}"
        share = f"{100 * clipped['share']:.2g} % of its samples stand on {tops}"
        found.append(f"{name} is clipped at {at}{doubt}: {share}.")
    frequency = seen["dominant_frequency"]
    if frequency is not None and seen["sample_rate"] / frequency < FEWEST_PER_PERIOD:
        found.append(
            f"{name} has {seen['sample_rate'] / frequency:.1f} samples a period of its main "
            f"frequency {frequency:.4g} Hz; {FEWEST_PER_PERIOD:g} or more show its shape."
        )
    if frequency is not None and seen["duration"] * frequency < FEWEST_PERIODS:
        found.append(f"{name} lasts {seen['duration'] * frequency:.1f} periods only.")
    step, span = seen["quantization_step"], seen["span"]
    if step is not None and step > COARSE_STEP * span and span / step > 2.5:
        found.append(f"{name} has {span / step:.0f} steps of {step:.3g}{unit} over its span only.")
    return found + _noise_findings(name, seen, unit)


def _noise_findings(name: str, seen: dict[str, Any], unit: str) -> list[str]:
    noise, stated = seen["noise_estimate"], seen["noise_stated"]
    if noise is None:
        return []
    found = []
    spread = float(np.sqrt(max(seen["rms"] ** 2 - seen["mean"] ** 2, 0.0)))
    if seen["role"] == "response" and noise > LOUD_NOISE * spread:
        share = 100 * noise / spread
        found.append(f"{name} has noise of about {noise:.3g}{unit}, {share:.0f} % of its signal.")
    if stated is not None and noise > 3.0 * stated:
        found.append(
            f"{name} has noise of about {noise:.3g}{unit} at high frequencies, where the sidecar "
            f"states {stated:.3g}{unit}."
        )
    return found
