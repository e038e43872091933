"""A drive that shakes about what it is told: the told motion itself, with a tone on it."""

import jax.numpy as jnp
import numpy as np
import pytest

from supple.model.chain import Chain
from supple.model.law import library
from supple.model.linear import Port
from supple.model.plant import Plant, numbers_vector
from supple.model.respond import simulate, tangents
from supple.model.ripple import RISE, told_column
from supple.model.robot import PRESETS, Robot

STEP, COUNT, BEGIN = 5e-4, 1200, 200
SIZE, HERTZ, PHASE, ONSET = 0.003, 14.0, 0.8, 0.1203
WIDTHS = np.zeros((0, 2))
TIMES = STEP * np.arange(COUNT)
TOLD = np.where(np.arange(COUNT) < BEGIN, 0.0, 0.3 * np.sin(6.0 * (TIMES - TIMES[BEGIN])) ** 2)
ROBOT = Plant(Robot("driven_wrist"), (Port("wrist", "angle"),), (Port("clubhead", "acceleration"),))
CHAIN = Plant(
    Chain(("cart",), (("spring", "ground", "cart"),)),
    (Port("ground", "position"),),
    (Port("cart", "position"),),
)


def vector(plant: Plant, ripple: tuple[float, ...]) -> np.ndarray:
    numbers = PRESETS["robo_v_sleeve_50"]
    if plant is CHAIN:
        numbers = dict(zip(plant.mechanism.names, (0.2, 40.0, 0.3), strict=True))
    z = numbers_vector(plant, numbers)
    z[plant.slots["ripple"]] = ripple
    return z


def seen(plant: Plant, ripple: tuple[float, ...], told: np.ndarray) -> np.ndarray:
    inputs = jnp.asarray(told[:, None])
    return np.asarray(simulate(plant, 1, vector(plant, ripple), inputs, jnp.asarray(STEP), WIDTHS))


def shaken() -> np.ndarray:
    """The told motion with its ripple, put on by hand."""
    rise = np.clip((TIMES - ONSET) / RISE, 0.0, 1.0)
    return TOLD + SIZE * rise * np.sin(2 * np.pi * HERTZ * TIMES + PHASE)


@pytest.mark.parametrize("plant", [ROBOT, CHAIN])
def test_a_ripple_is_a_told_motion_with_a_tone_on_it(plant):
    found = seen(plant, (SIZE, HERTZ, PHASE, ONSET), TOLD)[:, 0]
    wanted, plain = (seen(plant, (0.0, 0.0, 0.0, 0.0), told)[:, 0] for told in (shaken(), TOLD))
    size = np.max(np.abs(wanted))
    np.testing.assert_allclose(found, wanted, atol=1e-9 * size)
    assert np.max(np.abs(plain - wanted)) > 2e-4 * size
    np.testing.assert_array_equal(seen(plant, (0.0, HERTZ, PHASE, ONSET), TOLD)[:, 0], plain)


def test_what_is_pushed_does_not_ripple():
    plant = Plant(CHAIN.mechanism, (Port("cart", "force"),), CHAIN.sensors)
    z = numbers_vector(plant, dict(zip(plant.mechanism.names, (0.2, 40.0, 0.3), strict=True)))
    inputs, step = jnp.asarray(TOLD[:, None]), jnp.asarray(STEP)
    plain = np.asarray(simulate(plant, 1, z, inputs, step, WIDTHS))
    z[plant.slots["ripple"]] = (SIZE, HERTZ, PHASE, ONSET)
    np.testing.assert_array_equal(np.asarray(simulate(plant, 1, z, inputs, step, WIDTHS)), plain)
    assert told_column(plant) is None
    two = Plant(Robot("driven_arm"), (Port("arm", "angle"), Port("wrist", "angle")), ())
    assert told_column(two) == 1, "the joint next to the club"


def test_derivatives_are_those_of_differences():
    z, at = vector(ROBOT, (SIZE, HERTZ, PHASE, ONSET)), ROBOT.slots["ripple"].start
    inputs, step = jnp.asarray(TOLD[:, None]), jnp.asarray(STEP)
    directions = np.zeros((4, ROBOT.size))
    directions[np.arange(4), at + np.arange(4)] = 1.0
    found = np.asarray(tangents(ROBOT, 1, z, directions, inputs, step, WIDTHS))[:, :, 0]
    for row in range(4):
        ends = []
        for move in (1e-6, -1e-6):
            moved = z.copy()
            moved[at + row] *= 1 + move
            ends.append(np.asarray(simulate(ROBOT, 1, moved, inputs, step, WIDTHS))[:, 0])
        wanted = (ends[0] - ends[1]) / (2e-6 * z[at + row])
        np.testing.assert_allclose(found[row], wanted, atol=1e-6 * np.max(np.abs(wanted)))


def test_a_tone_is_found_in_the_errors_of_told_motions_with_a_phase_of_each():
    law, rng = library()["drive_ripple"], np.random.default_rng(4)
    frequency, phase, onset = law.shapes
    errors = {
        name: (wave(at, begin) + 3e-4 * rng.normal(size=COUNT), STEP)
        for name, at, begin in (("one", 0.4, 0.07), ("two", -2.0, 0.2))
    }
    assert frequency.sought is not None and phase.guess is not None and onset.guess is not None
    (found,) = frequency.sought(errors)
    assert found == pytest.approx(HERTZ, abs=0.3)
    for name, at, begin in (("one", 0.4, 0.07), ("two", -2.0, 0.2)):
        assert phase.guess(*errors[name], (HERTZ,)) == pytest.approx(at, abs=0.1)
        assert onset.guess(*errors[name], (HERTZ,)) == pytest.approx(begin, abs=0.015)
    still = {"one": (np.zeros(COUNT), STEP)}
    assert frequency.sought(still)[0] > 0.0, "nothing to see is no error"
    assert 0.0 <= onset.guess(*still["one"], (HERTZ,)) < TIMES[-1]


def wave(phase: float, begin: float) -> np.ndarray:
    rise = np.clip((TIMES - begin) / RISE, 0.0, 1.0)
    return 1e-3 * rise * np.sin(2 * np.pi * HERTZ * TIMES + phase)
