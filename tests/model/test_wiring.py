"""Laws in force are data: which rows, how strong; any place and any pair share one program."""

from itertools import pairwise
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from supple.model import march, respond
from supple.model.linear import Port
from supple.model.plant import Plant, laws_of, mechanism_laws, numbers_vector
from supple.model.respond import simulate
from supple.model.robot import Robot
from tests.model.test_respond import COUNT, PAIR, PAIR_NUMBERS, STEP


def test_laws_at_any_place_share_one_program(monkeypatch):
    """Which rows are in force is data: another place, or a second law, is not compiled anew."""
    traced = []

    def marched(*given: Any) -> Any:
        traced.append(given)
        return march.march_rows(*given)

    monkeypatch.setattr(respond, "march_rows", marched)
    count = COUNT + 3  # a length that no other test has compiled
    sensors = (Port("b", "position"),)
    inputs, widths = np.zeros((count, 0)), np.array([[1e-3, 0.05]])
    found = {}
    for place in ("left", "mid"):
        plant = Plant(PAIR, (), sensors, (place,))
        z = numbers_vector(plant, PAIR_NUMBERS)
        z[plant.slots["start"]] = [0.1, -0.2, 0.0, 0.3]
        names = [law.name + part for _, law, part in plant.law_numbers]
        z[plant.slots["strengths"].start + names.index("cubic_stiffness")] = 900.0
        found[place] = np.asarray(
            simulate(plant, 2, z, jnp.asarray(inputs), jnp.asarray(STEP), widths)
        )[:, 0]
        assert plant.wiring.select.sum() == 1.0
    assert len(traced) == 1

    def rates(_: float, y: np.ndarray, place: str) -> np.ndarray:
        stretch = {"left": y[0], "mid": y[1] - y[0]}
        speed = {"left": y[2], "mid": y[3] - y[2]}
        force = {
            name: PAIR_NUMBERS[f"links.{name}.stiffness"] * stretch[name]
            + PAIR_NUMBERS[f"links.{name}.damping"] * speed[name]
            + (900.0 * stretch[name] ** 3 if name == place else 0.0)
            for name in ("left", "mid")
        }
        bend = [(force["mid"] - force["left"]) / 1.5, -force["mid"] / 0.5]
        return np.array([y[2], y[3], *bend])

    times = np.arange(count) * STEP
    for place, ours in found.items():
        run = solve_ivp(
            rates, (0, times[-1]), [0.1, -0.2, 0.0, 0.3], t_eval=times, rtol=1e-9, atol=1e-12,
            args=(place,),
        )  # fmt: skip
        assert np.max(np.abs(ours - run.y[1])) < 2e-3 * np.max(np.abs(run.y[1]))


def test_a_program_holds_the_laws_that_act_and_answers_as_one_of_all_does():
    sensors, inputs = (Port("b", "position"),), jnp.zeros((COUNT, 0))
    found = {}
    for acting in (None, ("hysteresis",), ("hysteresis", "cubic_stiffness")):
        plant = Plant(PAIR, (), sensors, ("left", "mid"), acting)
        z = numbers_vector(plant, PAIR_NUMBERS)
        z[plant.slots["start"]] = [0.1, -0.2, 0.0, 0.3]
        names = [(place, law.name, symbol) for place, law, symbol in plant.law_numbers]
        first = plant.slots["strengths"].start
        z[first + names.index(("left", "hysteresis", ""))] = 8.0
        z[first + names.index(("left", "hysteresis", "knee"))] = 0.05
        widths = np.tile([1e-3, 0.05], (2, 1))
        found[acting] = np.asarray(simulate(plant, 2, z, inputs, jnp.asarray(STEP), widths))[:, 0]
    alone = Plant(PAIR, (), sensors, ("left",), ("hysteresis",))
    assert alone.program == alone.bare.program == ("hysteresis",)
    assert Plant(PAIR, (), sensors).program == ()
    beside = Plant(PAIR, (), sensors, ("left",), ("hysteresis", "cubic_stiffness")).program
    assert {"hysteresis", "cubic_stiffness", "clearance"} <= set(beside)
    assert "relaxation" not in beside
    every = Plant(PAIR, (), sensors, ("left",)).program
    assert {"relaxation", "slip", *beside} <= set(every)
    size = np.max(np.abs(found[None]))
    for ours in found.values():
        np.testing.assert_allclose(ours, found[None], atol=1e-12 * size)
    z[first + names.index(("left", "hysteresis", ""))] = 0.0
    bare = np.asarray(simulate(plant, 2, z, inputs, jnp.asarray(STEP), widths))[:, 0]
    assert np.max(np.abs(found[None] - bare)) > 1e-2 * size


@pytest.mark.parametrize("model", ["driven_wrist", "driven_arm", "pinned_wrist", "fixed_collet"])
def test_a_bare_plant_has_the_program_of_its_own(model):
    """What is compiled is asked of the plant in one place and of the bare one in another."""
    robot = Robot(model)
    names = [law.name for law in mechanism_laws(robot)]
    assert {"slip", "cubic_stiffness", "support_flexibility"} <= set(names)
    everywhere = tuple(robot.law_places())
    for acting in (None, (), *((one,) for one in names), *pairwise(names), tuple(names[:6])):
        plant = Plant(robot, (), (), everywhere, acting)
        assert plant.bare.program == plant.program
        assert plant.bare.bare == plant.bare
        assert set(acting or ()) <= set(plant.program)
        assert plant.wiring.spread.shape[0] == sum(1 + len(one.shapes) for one in laws_of(plant))


def test_systems_are_solved_as_by_their_inverse():
    rng = np.random.default_rng(5)
    for size in (2, 3, 6, march.MOST_UNROLLED + 1):
        matrix = jnp.eye(size) + 0.2 * jnp.asarray(rng.standard_normal((size, size)))
        right = jnp.asarray(rng.standard_normal(size))
        wanted = np.linalg.solve(np.asarray(matrix), np.asarray(right))
        for found in (march._solved(matrix, right), march.inverse(matrix) @ right):
            np.testing.assert_allclose(np.asarray(found), wanted, rtol=1e-9)
