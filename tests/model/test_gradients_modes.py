"""Slopes of modes and of a critical damping are those of differences."""

from typing import Any

import numpy as np
import pytest

from supple.model.chain import Chain
from supple.model.critical import critical_damping
from supple.model.linear import modes
from supple.model.slopes import critical_slopes, mode_slopes
from tests.model.test_gradients import NUMBERS, robot


@pytest.mark.parametrize("model", ["fixed_collet", "pinned_wrist"])
def test_slopes_of_modes_are_those_of_differences(model):
    mechanism = robot(model)
    found = mode_slopes(mechanism, NUMBERS)
    for index, name in enumerate(found.names):
        size = NUMBERS[name]
        h = 1e-5 * size

        def moved(h: float, name: str = name) -> Any:
            return modes(mechanism, NUMBERS | {name: NUMBERS[name] + h})

        up, down, wide, low = (moved(k * h) for k in (1, -1, 2, -2))
        for key in ("poles", "frequencies", "damping_ratios"):
            near = (getattr(up, key) - getattr(down, key)) / (2 * h)
            far = (getattr(wide, key) - getattr(low, key)) / (4 * h)
            wanted = (4 * near - far) / 3
            scale = np.abs(getattr(modes(mechanism, NUMBERS), key)) / size
            off = np.abs(getattr(found, key)[index] - wanted) / np.maximum(np.abs(wanted), scale)
            assert np.max(off) < 1e-6, (name, key)


CART = Chain(("a", "b"), (("s", "ground", "a"), ("t", "a", "b")))
CART_NUMBERS = {
    "masses.a.mass": 1.0, "masses.b.mass": 0.5, "links.s.stiffness": 40.0,
    "links.s.damping": 3.0, "links.t.stiffness": 25.0, "links.t.damping": 20.0,
}  # fmt: skip


def test_slopes_of_a_critical_damping_are_those_of_differences():
    name = "links.s.damping"

    def end(p: dict[str, float]) -> float:
        return critical_damping(CART, p, name).intervals[0][0]

    found = critical_slopes(CART, CART_NUMBERS, name, end(CART_NUMBERS))
    assert set(found) == set(CART_NUMBERS) - {name}
    for key, slope in found.items():
        size, worst = CART_NUMBERS[key], np.inf
        for part in (3e-2, 1e-2, 3e-3):
            moves = part * np.array([-2.0, -1.0, 1.0, 2.0])
            at = [end(CART_NUMBERS | {key: size * (1 + move)}) for move in moves]
            wanted = (8 * (at[2] - at[1]) - (at[3] - at[0])) / (12 * part * size)
            worst = min(worst, abs(slope / wanted - 1))
        assert worst < 1e-6, (key, worst)
