"""A diagnosis and its views made up by numpy, to test the reports without the engine."""

from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class View:
    record: str
    split: str
    channel: str
    quantity: str
    unit: str
    time: np.ndarray
    measured: np.ndarray
    before: np.ndarray
    after: np.ndarray
    displacement: np.ndarray
    velocity: np.ndarray
    unit_displacement: str
    unit_velocity: str
    noise_std: float
    is_decay: bool


def motion(times, start, *, stiffness=400.0, damping=0.4, friction=0.0, cubic=0.0, steps=8):
    """A mass of 1 kg on a spring by the semi-implicit Euler rule, in fine steps."""
    interval = (times[1] - times[0]) / steps
    x, v, seen, speeds = start, 0.0, [], []
    for i in range(len(times) * steps):
        if i % steps == 0:
            seen.append(x)
            speeds.append(v)
        force = -stiffness * x - cubic * x**3 - damping * v - friction * np.tanh(v / 1e-3)
        v += interval * force
        x += interval * v
    return np.array(seen), np.array(speeds)


def decay_view(name="decay_1", split="train", start=0.1, seed=0, n_samples=1500, noise=4e-4) -> Any:
    times = np.arange(n_samples) / 200.0
    true, speed = motion(times, start, friction=0.25, cubic=4000.0)
    before, _ = motion(times, start, stiffness=412.0, damping=1.1)
    after, _ = motion(times, start, friction=0.249, cubic=3990.0)
    measured = true + noise * np.random.default_rng(seed).normal(size=n_samples)
    return View(
        record=name,
        split=split,
        channel="head",
        quantity="position",
        unit="m",
        time=times,
        measured=measured,
        before=before,
        after=after,
        displacement=true,
        velocity=speed,
        unit_displacement="m",
        unit_velocity="m/s",
        noise_std=noise,
        is_decay=True,
    )


def long_view(n_samples=200_000) -> Any:
    """A driven record as long as laboratories make them."""
    times = np.arange(n_samples) / 1000.0
    rng = np.random.default_rng(3)
    slow = np.interp(times, times[::200], np.cumsum(rng.normal(size=n_samples // 200)))
    speed = np.gradient(slow, times)
    gap = 0.4 * np.sign(speed)
    return View(
        record="driven_long",
        split="train",
        channel="screw_force",
        quantity="force",
        unit="N",
        time=times,
        measured=slow + gap + 0.1 * rng.normal(size=n_samples),
        before=slow,
        after=slow + gap,
        displacement=slow,
        velocity=speed,
        unit_displacement="m",
        unit_velocity="m/s",
        noise_std=0.1,
        is_decay=False,
    )


CAUSE = {
    "law": "coulomb_friction",
    "place": "spring",
    "probability": 0.98,
    "parameters": {
        "force": {"value": 0.249, "std": 0.004, "low": 0.241, "high": 0.257, "unit": "N"}
    },
    "delta_bic": 5812.4,
    "score_p_value": 1e-40,
}
SECOND = {
    "law": "cubic_stiffness",
    "place": "spring",
    "probability": 0.93,
    "parameters": {
        "stiffness": {"value": 3990.0, "std": 31.0, "low": 3930.0, "high": 4050.0, "unit": "N/m^3"}
    },
    "delta_bic": 402.0,
    "score_p_value": 3e-22,
}
OTHERS = [
    {"law": "quadratic_damping", "place": "spring", "probability": 0.01, "delta_bic": 3611.0},
    {"law": "clearance", "place": "spring", "probability": 0.0, "delta_bic": 120.3},
    {"law": "sensor_offset", "place": "head", "probability": 0.0, "delta_bic": -6.1},
    {"law": "sensor_delay", "place": "head", "probability": 0.0, "delta_bic": -5.2},
]


def diagnosis(status="named", **changes):
    sentences = {
        "named": "The spring has Coulomb friction of 0.249 ± 0.004 N that the model lacks.",
        "ambiguous": "Coulomb friction or quadratic damping at the spring is missing; these "
        "records cannot tell which.",
        "adequate": "The model explains these records to within their noise.",
        "unknown": "Something at the spring is missing that no known law explains: the misfit is "
        "9.1 times the noise, and grows with the speed.",
        "refused": "The records are too short to judge a model by: 12 samples where at least 64 "
        "are needed.",
    }
    has_cause = status in ("named", "ambiguous")
    made = {
        "status": status,
        "title": "cart on a spring, 3 records",
        "sentence": sentences[status],
        "cannot_tell": ["head/sensor_gain"],
        "causes": [CAUSE, SECOND] if has_cause else [],
        "candidates": [CAUSE, SECOND, *OTHERS] if status != "refused" else [],
        "confusable": [
            {"a": "spring/coulomb_friction", "b": "spring/quadratic_damping", "alikeness": 0.87}
        ],
        "misfit": {
            "before": {"reduced_chi2": 41.2, "whiteness_p": 1e-30},
            "after": {"reduced_chi2": 1.03, "whiteness_p": 0.41},
        },
        "noise": {"law": "ar1", "parameters": {"rho": 0.31, "std": 0.0004}},
        "gain": {
            "records": ["decay_3"],
            "nrmse_before": 0.31,
            "nrmse_after": 0.02,
            "noise_floor": 0.018,
            "explained": 0.99,
        },
        "parameters": {
            "links.spring.stiffness": {"before": 412.0, "after": 400.2, "std": 0.3, "unit": "N/m"},
            "links.spring.damping": {"before": 1.1, "after": 0.401, "std": 0.01, "unit": "N s/m"},
        },
        "nuisances": {
            "decay_1.head.offset": {"value": 1e-5, "std": 2e-5, "unit": "m", "tolerance": 3e-4}
        },
        "decision": {"best_before": {"damping": 1.9}, "best_after": {"damping": 1.2}},
        "why": [
            "The misfit is 41 times the noise, so noise does not explain it.",
            "The residual steps with the sign of the velocity, as dry friction does.",
            "The score test singles it out among 6 candidates: p = 1e-40.",
            "The next best, quadratic damping, explains 62 % of what it explains.",
            "Held-out records agree: the error falls from 31 % to 2 %.",
        ],
        "what_next": "Use the extended rig; to be surer, repeat the decay from 0.2 m.",
        "records": [
            {
                "name": name,
                "split": split,
                "test": "decay",
                "n_samples": 1500,
                "sample_rate": 200.0,
            }
            for name, split in (("decay_1", "train"), ("decay_2", "train"), ("decay_3", "held_out"))
        ],
        "history": [
            {"law": None, "place": None, "reduced_chi2": 41.2, "bic": 9e4, "delta_bic": 0.0},
            {
                "law": "coulomb_friction",
                "place": "spring",
                "reduced_chi2": 1.9,
                "bic": 8.4e4,
                "delta_bic": 5812.4,
            },
            {
                "law": "cubic_stiffness",
                "place": "spring",
                "reduced_chi2": 1.03,
                "bic": 8.3e4,
                "delta_bic": 402.0,
            },
        ],
        "missing_force": None,
        "rig": {
            "kind": "chain",
            "motion": "translation",
            "masses": ["cart"],
            "links": {"spring": ["ground", "cart"]},
        },
        "provenance": {
            "version": "0.1.0",
            "inputs": {"decay_1.csv": "ab" * 32, "decay_1.toml": "cd" * 32},
            "seed": 0,
            "seconds": 12.34,
        },
    }
    if status == "unknown":
        x = np.linspace(-2.0, 2.0, 80)
        made["missing_force"] = {
            "place": "spring",
            "against": "velocity",
            "x": list(x),
            "force": list(np.sin(3 * x) * x**2),
            "unit_x": "m/s",
            "unit_force": "N",
        }
    if not has_cause:
        made["gain"] = {}
        made["history"] = []
    return made | changes
