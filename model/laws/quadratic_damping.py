"""Quadratic damping: drag that grows with the square of the speed."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp

from ..law import Law, Place


def force(strength: Any, stretch: Any, rate: Any, place: Place) -> Any:
    """Force ``c2 v |v|`` [N or N m]."""
    return strength * rate * jnp.abs(rate)


LAW = Law(
    name="quadratic_damping",
    kind="link",
    also=("head",),
    symbol="quadratic_damping",
    dimension=(1, -2, 2),
    natural=lambda scales: scales.force / scales.rate**2,
    force=force,
    signed=False,
    dissipative=True,
    formula="f = c2 v |v|",
    sentence="Damping at the {place} grows with speed: a drag of {value} that the model lacks.",
    cure="Air or fluid drag: keep it in the model, or shield the moving part.",
    source="Rayleigh 1876; Nayek et al. 2021, doi:10.1016/j.ymssp.2021.107783",
)
