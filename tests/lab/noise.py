"""Noise of the bench's sensors: white, coloured, growing, heavy-tailed, outliers, quantised."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

KINDS = ("white", "ar1", "ar2", "heteroscedastic", "heavy_tailed", "outliers", "quantised")


def draw_noise(
    kind: str, std: float, signal: np.ndarray, rng: np.random.Generator, law: dict | None = None
) -> np.ndarray:
    """Noise of standard deviation `std` for `signal`; outliers come on top of it.

    Args:
        kind: one of KINDS.
        std: standard deviation, in the signal's unit.
        signal: the clean channel, shape (n,).
        rng: where the chance comes from.
        law: parameters from `draw_law`; drawn here where absent.

    Raises:
        ValueError: if the kind is not known.
    """
    law = draw_law(kind, rng) if law is None else law
    count = len(signal)
    white = rng.standard_normal(count)
    if kind == "white":
        return std * white
    if kind == "ar1":
        return std * _coloured([law["rho"]], rng, count)
    if kind == "ar2":
        return std * _coloured([law["phi_1"], law["phi_2"]], rng, count)
    if kind == "heteroscedastic":
        share = 1 + law["growth"] * np.abs(signal) / max(np.abs(signal).max(), 1e-300)
        return std * white * share / np.sqrt(np.mean(share**2))
    if kind == "heavy_tailed":
        return std * rng.standard_t(law["freedom"], count) * np.sqrt(1 - 2 / law["freedom"])
    if kind == "outliers":
        hit = rng.random(count) < law["share"]
        kick = rng.uniform(8.0, 12.0, count) * rng.choice([-1.0, 1.0], count)
        return std * (white + hit * kick)
    if kind == "quantised":  # half of the variance is rounding
        step = std * np.sqrt(6.0)
        return step * np.round((signal + std * np.sqrt(0.5) * white) / step) - signal
    raise ValueError(f"noise {kind!r}: expected one of {KINDS}")


def draw_law(kind: str, rng: np.random.Generator) -> dict[str, float]:
    """Random parameters of a kind of noise."""
    if kind == "ar1":
        return {"rho": float(rng.uniform(0.5, 0.95))}
    if kind == "ar2":
        radius, turn = rng.uniform(0.5, 0.9), rng.uniform(0.15, 0.6) * np.pi
        return {"phi_1": float(2 * radius * np.cos(turn)), "phi_2": float(-(radius**2))}
    if kind == "heteroscedastic":
        return {"growth": float(rng.uniform(2.0, 5.0))}
    if kind == "heavy_tailed":
        return {"freedom": 4.0}
    if kind == "outliers":
        return {"share": 0.01}
    return {}


def _coloured(memory: list[float], rng: np.random.Generator, count: int) -> np.ndarray:
    """Autoregressive noise of unit variance, its start long forgotten."""
    poles = np.concatenate([[1.0], -np.asarray(memory)])
    reply = np.asarray(lfilter([1.0], poles, np.eye(1, 4000)[0]))
    lead = 1000
    long = np.asarray(lfilter([1.0], poles, rng.standard_normal(count + lead)))
    return long[lead:] / np.linalg.norm(reply)
