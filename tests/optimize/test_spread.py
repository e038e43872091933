"""The spread of an optimum: against the closed form of a released cart, and one draw alone."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from supple.model.chain import Chain
from supple.model.drives import impact, release
from supple.model.linear import Port
from supple.model.robot import PRESETS, Robot
from supple.optimize.optimum import certify
from supple.optimize.spread import Spread, spread
from supple.optimize.sweep import Axis, Map, SweepTask, score_designs, sweep

NUMBERS = {
    "masses.cart.mass": 0.5,
    "links.spring.stiffness": 200.0,
    "links.spring.damping": 0.3,
}
SPAN, RATE = 6.0, 200.0
CART = SweepTask(
    Chain(("cart",), (("spring", "ground", "cart"),)), NUMBERS, release("cart", 0.1),
    np.arange(int(SPAN * RATE)) / RATE, (0.0, SPAN), Port("cart", "position"), ("rms",),
    (Axis("links.spring.damping", np.linspace(2.0, 40.0, 20), "N s/m"),),
)  # fmt: skip
GENERATOR = np.random.default_rng(11)
DRAWS = {
    "links.spring.stiffness": 200.0 * np.exp(GENERATOR.normal(0.0, 0.4, 40)),
    "masses.cart.mass": 0.5 * np.exp(GENERATOR.normal(0.0, 0.1, 40)),
    "links.spring.damping": GENERATOR.uniform(0.0, 1.0, 40),
    "offset[one]": GENERATOR.normal(size=40),
}
WRIST = PRESETS["robo_v_sleeve_50"]
ROBOT = SweepTask(
    Robot("pinned_wrist", tuple(WRIST)),
    WRIST,
    impact("clubhead", -1600.0, 0.0, 0.005),
    np.arange(1000) / 500.0,
    (0.005, 2.0),
    Port("clubhead", "acceleration", "collet"),
    ("rms",),
    (
        Axis("wrist_stiffness", 20.0 + 30.0 * np.arange(12), "N m/rad"),
        Axis("wrist_damping", 1.0 + 1.5 * np.arange(12), "N m s/rad"),
    ),
)


@pytest.fixture(scope="module")
def carts() -> Spread:
    found = spread(sweep(CART), "rms", DRAWS, {"links.spring.damping": 10.0})
    assert found is not None
    return found


def rms(damping: float | np.ndarray, stiffness: np.ndarray, mass: np.ndarray) -> np.ndarray:
    """Of a cart let go at x0 = 0.1 m: the integral of x² is x0² (1 + 4 z²) / (4 z w).

    Its sum over samples holds half a step more of the first.
    """
    natural, ratio = np.sqrt(stiffness / mass), damping / (2 * np.sqrt(stiffness * mass))
    whole = (1 + 4 * ratio**2) / (4 * ratio * natural) + 0.5 / RATE
    return 0.1 * np.sqrt(whole / SPAN)


def test_each_draws_optimum_is_half_its_critical_damping(carts):
    expected = np.sqrt(DRAWS["links.spring.stiffness"] * DRAWS["masses.cart.mass"])
    assert carts.designs["links.spring.damping"] == pytest.approx(expected, rel=2e-3)
    told = rms(expected, DRAWS["links.spring.stiffness"], DRAWS["masses.cart.mass"])
    assert carts.values == pytest.approx(told, rel=2e-3)
    low, high = carts.interval("links.spring.damping")
    inside = (expected >= low * (1 - 2e-3)) & (expected <= high * (1 + 2e-3))
    assert 0.87 <= inside.mean() <= 0.97


def test_the_design_for_all_draws_is_that_of_the_closed_mean(carts):
    k, m = DRAWS["links.spring.stiffness"], DRAWS["masses.cart.mass"]
    known: Any = minimize_scalar(
        lambda c: rms(c, k, m).mean(), bounds=(2.0, 40.0), method="bounded"
    )
    assert carts.best["links.spring.damping"] == pytest.approx(known.x, rel=2e-3)
    assert carts.of_best.mean() == pytest.approx(known.fun, rel=2e-3)
    assert carts.of_nominal is not None and carts.of_best.mean() <= carts.of_nominal.mean()
    price = carts.price(carts.of_best)
    assert price.min() >= -1e-9 and price.max() > 0.01


def test_what_is_designed_or_not_of_the_rig_is_passed_over(carts):
    assert carts.unknown == ("links.spring.stiffness", "masses.cart.mass")
    others = {name: DRAWS[name] for name in ("links.spring.damping", "offset[one]")}
    with pytest.raises(ValueError, match=r"besides links.spring.damping.*Mend:"):
        spread(sweep(CART), "rms", others)


@pytest.fixture(scope="module")
def robots() -> Map:
    return sweep(ROBOT)


def test_draws_that_all_say_what_the_rig_says_give_its_certified_optimum(robots):
    found = robots
    one = certify(found, "rms")
    draws = {name: np.full(3, WRIST[name]) for name in ("sleeve_stiffness", "shaft_stiffness")}
    assert one is not None
    cloud = spread(found, "rms", draws, one.design)
    assert cloud is not None
    for name, value in one.design.items():
        assert cloud.designs[name] == pytest.approx(np.full(3, value), rel=2e-3)
        assert cloud.best[name] == pytest.approx(value, rel=2e-3)
    assert cloud.values == pytest.approx(np.full(3, one.value), rel=1e-6)
    assert cloud.of_nominal == pytest.approx(np.full(3, one.value), rel=1e-9)


def test_a_draws_optimum_is_that_of_a_map_of_its_own(robots):
    draws = {"sleeve_stiffness": WRIST["sleeve_stiffness"] * np.array([0.2, 1.0, 5.0])}
    cloud = spread(robots, "rms", draws)
    assert cloud is not None and cloud.of_nominal is None
    own = replace(ROBOT, numbers={**WRIST, "sleeve_stiffness": draws["sleeve_stiffness"][0]})
    one = certify(sweep(own), "rms")
    assert one is not None and one.status == "certified"
    assert cloud.values[0] == pytest.approx(one.value, rel=1e-6)
    there = {name: np.array([v]) for name, v in cloud.best.items()}
    assert score_designs(own, there)["rms"][0] == pytest.approx(cloud.of_best[0], rel=1e-9)
    assert np.ptp(cloud.values) > 0.01 * cloud.values[0]


def test_the_highest_is_best_where_more_is_better():
    task = replace(ROBOT, scores=("log_decrement_modal",))
    draws = {"sleeve_stiffness": WRIST["sleeve_stiffness"] * np.array([0.5, 1.0])}
    cloud = spread(sweep(task), "log_decrement_modal", draws)
    assert cloud is not None and not cloud.is_lowest
    assert (cloud.values >= cloud.of_best - 1e-12).all()
    assert (cloud.price(cloud.of_best) >= -1e-12).all()
