"""What sleeve does this silicone make? From runs of a testing machine to stiffness and damping."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..identification.coupon import Sample
    from ..identification.loop import Loop
    from ..identification.sleeve import SleeveShape
    from ..identification.viscoelastic import Law

FREQUENCY = 4.0
"""Frequency for which a sleeve is made [Hz]; the club's own, thesis line 1237."""

NEAR = 0.25
"""How far a single run's frequency may be from that, as a share of it [-]."""

NORMAL_95 = 1.96


def coupon_files(
    paths: Sequence[Path],
    sizes: Path | None = None,
    frequency: float = FREQUENCY,
    seed: int = 0,
) -> tuple[dict[str, Any], bool]:
    """Measures every run, fits a law where there is a sweep, and makes a sleeve.

    Args:
        paths: sidecars, or the machine's own files.
        sizes: a file with [sample] and [sleeve]; a sidecar's own sample comes first.
        frequency: for which the sleeve is made [Hz].
        seed: kept in the provenance; nothing here is drawn by chance.

    Returns:
        The contents of ``sleeve.json``, and whether they are to be trusted.

    Raises:
        ValueError: in the words of the door.
    """
    from .. import __version__
    from ..identification.coupon import read_coupon
    from ..identification.loop import GOOD, STIFFNESS_ONLY, measure_loop
    from ..identification.sleeve import read_sizes

    began = time.perf_counter()
    if not 0 < frequency < math.inf:
        raise ValueError(
            f"--frequency: expected a frequency above 0 Hz, found {frequency:g}. "
            "Mend: name that of the club."
        )
    sample, shape, files = None, None, {}
    if sizes is not None:
        sample, shape, files[str(sizes)] = read_sizes(sizes)
    loops = []
    for path in paths:
        coupon = read_coupon(path)
        files |= coupon.files or {}
        loops.append(measure_loop(coupon))
    samples = [loop.coupon.sample or sample for loop in loops]
    runs = [_run(loop, own) for loop, own in zip(loops, samples, strict=True)]
    warnings = [sentence for loop in loops for sentence in loop.warnings]
    usable = [i for i, loop in enumerate(loops) if loop.status == GOOD]
    law, unit = _law([loops[i] for i in usable], [samples[i] for i in usable], warnings)
    material = _material(loops, samples, usable, law, unit, frequency, warnings)
    sleeve = _sleeve(material, shape, warnings)
    doubtful = [loop.coupon.name for loop in loops if loop.status not in (GOOD, STIFFNESS_ONLY)]
    status = "in_doubt" if doubtful else "good" if usable else STIFFNESS_ONLY
    seconds = round(time.perf_counter() - began, 3)
    result = {
        "status": status,
        "sentence": _sentence(material, sleeve, doubtful),
        "files": runs,
        "law": None if law is None else _law_json(law, unit),
        "material": material,
        "sleeve": sleeve,
        "warnings": warnings,
        "provenance": {
            "version": __version__,
            "inputs": files,
            "seed": seed,
            "seconds": seconds,
        },
    }
    return result, status != "in_doubt"


def _told(value: float, std: float, unit: str) -> dict[str, Any] | None:
    """A number with its error in the shape of the contract; None where there is none."""
    if not (math.isfinite(value) and math.isfinite(std)):
        return None
    low, high = value - NORMAL_95 * std, value + NORMAL_95 * std
    return {"value": value, "std": std, "low": low, "high": high, "unit": unit}


def _scaled(one: Mapping[str, Any] | None, factor: float, unit: str) -> dict[str, Any] | None:
    return None if one is None else _told(one["value"] * factor, one["std"] * factor, unit)


def _run(loop: Loop, sample: Sample | None) -> dict[str, Any]:
    has_phase = math.isfinite(loop.phase)
    storage = _told(loop.stiffness, loop.stiffness_std, "N/m")
    loss = _told(loop.loss_stiffness, loop.loss_stiffness_std, "N/m")
    factor = None if sample is None else sample.geometry_factor
    return {
        "name": loop.coupon.name,
        "file": str(loop.coupon.path),
        "status": loop.status,
        "frequency": loop.frequency,
        "periods": loop.periods,
        "amplitude": loop.amplitude,
        "load_amplitude": loop.load_amplitude,
        "gap": loop.gap,
        "stiffness": storage,
        "phase": _told(loop.phase, loop.phase_std, "rad"),
        "phase_by_peaks": _told(loop.phase_by_peaks, loop.phase_by_peaks_std, "rad"),
        "tan_delta": _told(loop.tan_delta, loop.tan_delta_std, "1") if has_phase else None,
        "damping": _told(loop.damping, loop.damping_std, "N s/m") if has_phase else None,
        "storage_modulus": None if factor is None else _scaled(storage, factor, "Pa"),
        "loss_modulus": None if factor is None else _scaled(loss, factor, "Pa"),
        "sample": None if sample is None else {"height": sample.height, "area": sample.area},
        "warnings": list(loop.warnings),
    }


def _law(
    loops: list[Loop], samples: list[Sample | None], warnings: list[str]
) -> tuple[Law | None, str]:
    """The law of a sweep, in Pa where all sizes are known, else in N/m of one sample."""
    import numpy as np

    from ..identification.viscoelastic import FEWEST_FREQUENCIES, MISFIT, fit_law

    known = [sample.geometry_factor for sample in samples if sample is not None]
    unit = "Pa" if loops and len(known) == len(loops) else "N/m"
    found = {round(loop.frequency, 2) for loop in loops}
    if len(found) < FEWEST_FREQUENCIES:
        return None, unit
    factors = np.array(known) if unit == "Pa" else np.ones(len(loops))
    law = fit_law(
        np.array([loop.frequency for loop in loops]),
        factors * np.array([complex(loop.stiffness, loop.loss_stiffness) for loop in loops]),
        factors[:, None]
        * np.array([[loop.stiffness_std, loop.loss_stiffness_std] for loop in loops]),
    )
    if law.chi2 > MISFIT:
        warnings.append(
            f"The best law misses the sweep: its misfit has {law.chi2:.3g} times the errors' "
            "power. The runs differ by more than their frequency."
        )
    return law, unit


def _law_json(law: Law, unit: str) -> dict[str, Any]:
    stds = list(map(float, law.std))
    return {
        "name": law.name,
        "rest": _told(law.rest, stds[0], unit),
        "branches": [
            {
                "modulus": _told(modulus, stds[1 + 2 * i], unit),
                "relaxation_time": _told(tau, stds[2 + 2 * i], "s"),
            }
            for i, (modulus, tau) in enumerate(law.branches)
        ],
        "reduced_chi2": law.chi2,
        "bic": {str(count): value for count, value in law.bic.items()},
        "frequencies": [law.low, law.high],
    }


def _material(
    loops: list[Loop],
    samples: list[Sample | None],
    usable: list[int],
    law: Law | None,
    unit: str,
    frequency: float,
    warnings: list[str],
) -> dict[str, Any] | None:
    """Storage and loss at the frequency of the sleeve, by the law or by the nearest run."""
    if law is not None:
        if not law.low * (1 - NEAR) <= frequency <= law.high * (1 + NEAR):
            warnings.append(
                f"{frequency:g} Hz lies outside the sweep of {law.low:.3g} to {law.high:.3g} Hz: "
                "the law is only supposed to hold there."
            )
        value, stds = complex(law.modulus(frequency)[0]), law.modulus_std(frequency)
        first = samples[usable[0]]
        return _both(value, stds, unit, frequency, f"{law.name} law", first)
    candidates = usable or [i for i, loop in enumerate(loops) if math.isfinite(loop.phase)]
    if not candidates:
        warnings.append("No run tells a phase: without one there is no damping and no sleeve.")
        return None
    nearest = min(candidates, key=lambda i: abs(math.log(loops[i].frequency / frequency)))
    loop, sample = loops[nearest], samples[nearest]
    if abs(loop.frequency / frequency - 1) > NEAR:
        warnings.append(
            f"The run nearest to {frequency:g} Hz is {loop.coupon.name} at {loop.frequency:.3g} "
            "Hz, and silicone depends on frequency: test there, or at three frequencies or more."
        )
    factor = 1.0 if sample is None else sample.geometry_factor
    value = complex(loop.stiffness, loop.loss_stiffness) * factor
    stds = (loop.stiffness_std * factor, loop.loss_stiffness_std * factor)
    unit = "N/m" if sample is None else "Pa"
    return _both(value, stds, unit, loop.frequency, loop.coupon.name, sample)


def _both(
    value: complex,
    stds: tuple[float, float],
    unit: str,
    frequency: float,
    source: str,
    sample: Sample | None,
) -> dict[str, Any]:
    ratio = value.imag / value.real
    spread = ratio * math.hypot(stds[0] / value.real, stds[1] / value.imag)
    return {
        "frequency": frequency,
        "source": source,
        "storage": _told(value.real, stds[0], unit),
        "loss": _told(value.imag, stds[1], unit),
        "tan_delta": _told(ratio, spread, "1"),
        "geometry_factor": None if sample is None else sample.geometry_factor,
    }


def _sleeve(
    material: Mapping[str, Any] | None, shape: SleeveShape | None, warnings: list[str]
) -> dict[str, Any] | None:
    """Stiffness and damping of the whole sleeve, and of one of its four elements."""
    from ..identification.sleeve import ELEMENTS

    if material is None:
        return None
    if shape is None or material["storage"]["unit"] != "Pa":
        missing = "the sleeve's sizes" if shape is None else "the sample's sizes"
        warnings.append(f"No sleeve was made: {missing} are not stated; name them with --sizes.")
        return None
    omega, width = 2 * math.pi * material["frequency"], shape.width_per_height
    storage, loss = material["storage"], material["loss"]
    factor, each = material["geometry_factor"], 1.0 / ELEMENTS
    return {
        "frequency": material["frequency"],
        "stiffness": _scaled(storage, width, "N/m"),
        "damping": _scaled(loss, width / omega, "N s/m"),
        "parameters": {  # of one element: what a rig wants
            "sleeve_stiffness": _scaled(storage, width * each, "N/m"),
            "sleeve_damping": _scaled(loss, width * each / omega, "N s/m"),
        },
        "elements": ELEMENTS,
        "factor": None if factor is None else width * factor,
        "wall": shape.wall,
        "contact": shape.contact,
    }


def _sentence(
    material: Mapping[str, Any] | None, sleeve: Mapping[str, Any] | None, doubtful: list[str]
) -> str:
    doubt = f" In doubt: {', '.join(doubtful)}." if doubtful else ""
    if material is None:
        return f"These runs tell no damping.{doubt}"
    text = f"At {material['frequency']:.3g} Hz tan delta is {_short(material['tan_delta'])}"
    if sleeve is None:
        unit = material["storage"]["unit"]
        return f"{text} and the storage {_short(material['storage'])} {unit}.{doubt}"
    return (
        f"{text}; the sleeve has {_short(sleeve['stiffness'])} N/m and "
        f"{_short(sleeve['damping'])} N s/m.{doubt}"
    )


def _short(one: Mapping[str, Any]) -> str:
    return f"{one['value']:.4g} ± {one['std']:.2g}"


def show_coupon(result: Mapping[str, Any]) -> None:
    """Prints every run as a line, and the sleeve under it.

    Args:
        result: of `coupon_files`.
    """
    from rich import box
    from rich.console import Console
    from rich.table import Table

    console = Console(highlight=False, markup=False)
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    table.add_column("run", overflow="fold")
    for heading in ("Hz", "stiffness, N/m", "tan delta", "damping, N s/m"):
        table.add_column(heading, justify="right")
    table.add_column("status")
    for run in result["files"]:
        figures = [run[key] for key in ("stiffness", "tan_delta", "damping")]
        cells = ["-" if one is None else _short(one) for one in figures]
        table.add_row(run["name"], f"{run['frequency']:.3g}", *cells, run["status"])
    console.print(table)
    for warning in result["warnings"]:
        console.print(f"! {warning}")
    console.print(result["sentence"])
