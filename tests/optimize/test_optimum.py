"""A certified optimum: that of a finer grid, of closed forms, and of exact derivatives."""

from dataclasses import replace

import numpy as np
import pytest

from supple.model.chain import Chain
from supple.model.drives import impact, release
from supple.model.linear import Port
from supple.model.robot import PRESETS, Robot
from supple.optimize import optimum
from supple.optimize.optimum import certify
from supple.optimize.sweep import Axis, SweepTask, score_designs, sweep
from supple.studies.optimum_words import optimum_words

NUMBERS = PRESETS["robo_v_sleeve_50"]
WRISTS = SweepTask(
    Robot("pinned_wrist", tuple(NUMBERS)),
    NUMBERS,
    impact("clubhead", -1600.0, 0.0, 0.005),
    np.arange(2000) / 1000.0,
    (0.005, 2.0),
    Port("clubhead", "acceleration", "collet"),
    ("rms", "peak", "log_decrement_modal"),
    (
        Axis("wrist_stiffness", 20.0 + 30.0 * np.arange(12), "N m/rad"),
        Axis("wrist_damping", 1.0 + 1.5 * np.arange(12), "N m s/rad"),
    ),
)
CART_NUMBERS = {
    "masses.cart.mass": 0.5,
    "links.spring.stiffness": 200.0,
    "links.spring.damping": 0.3,
}


@pytest.fixture(scope="module")
def found():
    return sweep(WRISTS)


def grid_around(at: dict[str, float], share: float, count: int) -> dict[str, np.ndarray]:
    lines = [value * np.linspace(1 - share, 1 + share, count) for value in at.values()]
    return {name: g.ravel() for name, g in zip(at, np.meshgrid(*lines, indexing="ij"))}


def test_the_optimum_is_that_of_a_grid_drawn_closer(found):
    one = certify(found, "rms")
    assert one is not None and one.status == "certified" and one.how == "gradient"
    design, lowest = found.extreme("rms", lowest=True)
    for share in (0.5, 0.1, 0.02, 0.004):
        grid = grid_around(design, share, 41)
        values = score_designs(replace(WRISTS, scores=("rms",)), grid)["rms"]
        design = {name: float(v[int(np.argmin(values))]) for name, v in grid.items()}
        lowest = float(values.min())
    assert one.value <= lowest * (1 + 1e-9)
    assert one.value == pytest.approx(lowest, rel=1e-6)
    for name, value in design.items():
        assert one.design[name] == pytest.approx(value, rel=5e-3)
    assert one.on_grid >= one.value and one.finer >= one.value * (1 - 1e-6)
    assert max(map(abs, one.elasticity.values())) < 1e-6 and one.bounds == {}


@pytest.mark.slow
def test_twenty_maps_of_other_grids_agree_on_it():
    generator = np.random.default_rng(4)
    values = []
    for _ in range(20):
        axes = tuple(
            Axis(name, np.sort(generator.uniform(low, high, 15)))
            for name, low, high in (("wrist_stiffness", 20, 300), ("wrist_damping", 2, 20))
        )
        ends = [(20.0, 300.0), (2.0, 20.0)]
        axes = tuple(
            replace(one, values=np.array([low, *one.values, high]))
            for one, (low, high) in zip(axes, ends)
        )
        one = certify(sweep(replace(WRISTS, scores=("rms",), axes=axes)), "rms")
        assert one is not None and one.status == "certified"
        values.append(one.value)
    assert np.ptp(values) < 1e-6 * values[0]


def test_gradient_and_curvature_are_those_of_differences(found):
    """At a bound, where the gradient is not zero."""
    task = replace(WRISTS, scores=("rms",), axes=tuple(
        replace(axis, values=axis.values + move) for axis, move in zip(WRISTS.axes, (150.0, 10.0))
    ))  # fmt: skip
    one = certify(sweep(task), "rms")
    assert one is not None and one.bounds == {"wrist_stiffness": "low", "wrist_damping": "low"}
    assert one.design == {"wrist_stiffness": 170.0, "wrist_damping": 11.0}

    def log_rms(*moves: float) -> float:
        moved = zip(one.design.items(), moves)
        numbers = {name: np.array([value * np.exp(move)]) for (name, value), move in moved}
        return float(score_designs(task, numbers)["rms"][0])

    for k, name in enumerate(one.design):
        steps = [1e-4 * sign * np.eye(2)[k] for sign in (1, -1)]
        slope = (log_rms(*steps[0]) - log_rms(*steps[1])) / 2e-4 / one.value
        assert one.elasticity[name] == pytest.approx(slope, rel=1e-5)
        steps = [1e-2 * sign * np.eye(2)[k] for sign in (1, -1)]
        bend = (log_rms(*steps[0]) - 2 * one.value + log_rms(*steps[1])) / 1e-4 / one.value
        assert one.curvature is not None
        assert one.curvature[k, k] == pytest.approx(bend, rel=2e-3)


def test_a_peak_with_corners_is_settled_by_grids(found):
    one = certify(found, "peak")
    assert one is not None and one.status == "certified" and one.curvature is None
    grid = grid_around(one.design, 2e-3, 31)
    near = score_designs(replace(WRISTS, scores=("peak",)), grid)["peak"]
    assert near.min() >= one.value * (1 - 1e-6) and one.value < one.on_grid


def test_the_price_of_a_move_is_one_percent(found):
    one = certify(found, "rms")
    assert one is not None
    for name, ends in one.reach.items():
        for end in ends:
            assert end is not None
            moved = {key: np.array([value]) for key, value in one.design.items()}
            moved[name] = np.array([end])
            value = score_designs(replace(WRISTS, scores=("rms",)), moved)["rms"][0]
            assert value == pytest.approx(1.01 * one.value, rel=1e-3)
    assert one.sharpness("wrist_stiffness") == "flat" and one.sharpness("wrist_damping") == "even"
    words = optimum_words(one, {"rms": "m/s^2", "wrist_stiffness": "N m/rad"})
    assert "The lowest rms is 116 m/s² at wrist stiffness 61.41 N m/rad" in words
    assert "flat along wrist stiffness, even along wrist damping" in words


def test_a_decrement_has_its_best_at_the_critical_damping():
    """Of a cart alone the decrement grows without bound towards it: the last that oscillates."""
    chain = Chain(("cart",), (("spring", "ground", "cart"),))
    damping = np.linspace(1.0, 19.0, 10)  # critical: 20
    task = SweepTask(
        chain, CART_NUMBERS, release("cart", 0.1), np.arange(1000) / 500.0, (0.0, 2.0),
        Port("cart", "position"), ("log_decrement_modal", "rms"),
        (Axis("links.spring.damping", damping), Axis("masses.cart.mass", np.array([0.5]))),
    )  # fmt: skip
    one = certify(sweep(task), "log_decrement_modal")
    assert one is not None and not one.is_lowest and one.how == "grid"
    assert one.design == {"links.spring.damping": 19.0}
    assert one.bounds == {"links.spring.damping": "high"}
    assert one.value == pytest.approx(2 * np.pi * 0.95 / np.sqrt(1 - 0.95**2), rel=1e-9)
    assert "widen that axis" in optimum_words(one, {})


def test_the_best_rms_of_a_released_cart_is_the_closed_form():
    """The integral of x² of a cart let go is least for a damping ratio of one half."""
    chain = Chain(("cart",), (("spring", "ground", "cart"),))
    task = SweepTask(
        chain, CART_NUMBERS, release("cart", 0.1), np.arange(20_000) / 5000.0, (0.0, 4.0),
        Port("cart", "position"), ("rms",),
        (Axis("links.spring.damping", np.linspace(1.0, 30.0, 8)),),
    )  # fmt: skip
    one = certify(sweep(task), "rms")
    assert one is not None and one.status == "certified"
    assert one.design["links.spring.damping"] == pytest.approx(10.0, rel=1e-3)


def test_nothing_is_certified_where_nothing_is_finite(found):
    lost = replace(found, scores={"rms": np.full(WRISTS.shape, np.nan)})
    assert certify(lost, "rms") is None


def test_a_better_design_on_the_finer_grid_is_told(found, monkeypatch):
    monkeypatch.setattr(optimum, "_polished", lambda slope, scale, start: start + 0.3)
    one = certify(found, "rms")
    assert (
        one is not None
        and one.status == "not_certified"
        and "do not trust" in optimum_words(one, {})
    )
