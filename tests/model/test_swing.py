"""Planar swings: against scipy's integrators, energy kept, the linear robot as motions shrink."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.linalg import expm

from supple.model import planar, swing as swings_of
from supple.model.lagrange import trace
from supple.model.linear import state_space
from supple.model.robot import PRESETS, Robot
from supple.model.shaft import LARGEST_TILT
from supple.model.swing import Signals, signals_of, swing, swings

NUMBERS = PRESETS["robo_v_sleeve_50"]
TIMES = np.arange(601) / 1000.0


def half_turn(times: np.ndarray, seconds: float = 0.8, reach: float = np.pi) -> np.ndarray:
    """An arm that turns by `reach` in so many seconds, its acceleration one sine."""
    share = np.clip(times / seconds, 0, 1)
    return reach * (share - np.sin(2 * np.pi * share) / (2 * np.pi))


def scipy_swing(signals: Signals, pull: float, law: Callable[[float, float], float]) -> np.ndarray:
    """The same swing by scipy, from the energies alone; `law` acts at the wrist."""
    p = NUMBERS

    @jax.jit
    def forces(q: Any, v: Any, d: Any, rate: Any, bend: Any) -> tuple[Any, Any]:
        def momentum(q: Any, v: Any, d: Any, rate: Any) -> Any:
            return jax.grad(planar.kinetic_energy, 2)(p, q, v, d, rate, jnp)

        zero = jnp.zeros(4)
        change = jax.jvp(momentum, (q, v, d, rate), (v, zero, rate, bend))[1]
        left = change - jax.grad(planar.kinetic_energy, 1)(p, q, v, d, rate, jnp)
        left += jax.grad(planar.weight_energy, 1)(p, q, d, pull, jnp)
        left += jax.grad(planar.spring_energy, 1)(p, q, d, True)
        left += jax.grad(planar.dissipation, 2)(p, q, v, rate, True)
        mass = jax.hessian(planar.kinetic_energy, 2)(p, q, v, d, rate, jnp)
        return mass, left

    spline = CubicSpline(signals.times, half_turn(signals.times))

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        d = np.array([spline(t), 0.0])
        rate, bend = np.array([spline(t, 1), 0.0]), np.array([spline(t, 2), 0.0])
        mass, left = forces(y[:4], y[4:], d, rate, bend)
        left = np.array(left)
        left[0] += law(y[0] - d[0], y[4] - rate[0])
        return np.concatenate([y[4:], np.linalg.solve(np.asarray(mass), -left)])

    run = solve_ivp(
        rates, (0, signals.times[-1]), np.zeros(8), "Radau", t_eval=signals.times[::20],
        rtol=1e-9, atol=1e-12,
    )  # fmt: skip
    assert run.success
    return run.y.T


def off(ours: np.ndarray, truth: np.ndarray) -> float:
    """Largest error of a coordinate, relative to the largest value that it takes."""
    return float(np.max(np.abs(ours - truth) / np.abs(truth).max(axis=0)))


def test_a_swing_against_scipy():
    signals = signals_of(TIMES, arm=half_turn(TIMES))
    pull = 6.0
    ours = swing("passive_wrist", NUMBERS, signals, gravity=6.0, start=np.zeros(8))
    truth = scipy_swing(signals, pull, lambda stretch, rate: 0.0)
    assert off(ours.positions[::20], truth[:, :4]) < 1e-6
    assert off(ours.velocities[::20], truth[:, 4:]) < 1e-5
    assert ours.change < 1e-4


@pytest.mark.slow
def test_a_swing_with_friction_in_the_wrist_against_scipy():
    signals = signals_of(TIMES, arm=half_turn(TIMES))
    laws = {("wrist", "coulomb_friction"): 2.0}
    width = 0.05
    ours = swing(
        "passive_wrist", NUMBERS, signals, gravity=6.0, laws=laws, widths=(1e-4, width),
        start=np.zeros(8),
    )  # fmt: skip
    truth = scipy_swing(signals, 6.0, lambda stretch, rate: 2.0 * np.tanh(rate / width))
    assert off(ours.positions[::20], truth[:, :4]) < 1e-5
    without = swing("passive_wrist", NUMBERS, signals, gravity=6.0, start=np.zeros(8))
    assert np.max(np.abs(ours.positions[:, 0] - without.positions[:, 0])) > 1e-3


SLOW = [pytest.param(model, marks=pytest.mark.slow) for model in ("driven_arm", "pinned_wrist")]


@pytest.mark.parametrize("model", ["passive_wrist", *SLOW, "driven_collet"])
def test_energy_is_kept_without_damping(model):
    bare = NUMBERS | {"shaft_damping": 0.0, "sleeve_damping": 0.0, "wrist_damping": 0.0}
    times = np.arange(8001) / 4000.0
    start = swing(model, bare, signals_of(times[:5])).positions[0]
    start = np.concatenate([start, [1.5, 0.0, 0.0, 0.0]])
    found = swing(model, bare, signals_of(times), start=start)
    moving = np.ptp(found.positions[:, 0]) * np.ptp(found.bend)
    assert moving > 1e-4, "collet and shaft must have moved for this to mean anything"
    assert np.ptp(found.energy) < 1e-8 * np.abs(found.energy).max()


def test_small_swings_are_the_linear_robot_s():
    """Relative differences fall with the square of the motion: the first error is cubic."""
    space = state_space(Robot("pinned_wrist", tuple(NUMBERS)), NUMBERS)
    matrix = np.asarray(space.a)[:8, :8]
    shape = np.array([0.3, 0.0, 0.0, 0.05, 0.0, 0.0, 0.0, 0.5])
    times = TIMES
    errors = []
    for size in (0.2, 0.1, 0.05):
        found = swing("pinned_wrist", NUMBERS, signals_of(times), gravity=0.0, start=size * shape)
        linear = expm(matrix * times[-1]) @ (size * shape)
        errors.append(np.abs(found.positions[-1] - linear[:4])[[0, 3]] / np.abs(linear[[0, 3]]))
    orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert np.all((orders > 1.8) & (orders < 2.2)), orders


@pytest.mark.slow
def test_many_designs_are_each_their_own():
    table = {name: np.full(3, value) for name, value in NUMBERS.items()}
    table["wrist_stiffness"] = np.array([150.0, 300.0, 600.0])
    signals = signals_of(TIMES, arm=half_turn(TIMES))
    many = swings("passive_wrist", table, [signals])
    for index, stiffness in enumerate(table["wrist_stiffness"]):
        alone = swing("passive_wrist", NUMBERS | {"wrist_stiffness": stiffness}, signals)
        assert off(many[index].positions, alone.positions) < 1e-9


def test_a_fixed_collet_stays_where_it_is():
    force = np.where(TIMES < 0.002, 50.0, 0.0)
    found = swing("fixed_collet", NUMBERS, signals_of(TIMES, force=force))
    assert not found.positions[:, 0].any() and not found.velocities[:, 0].any()
    assert np.abs(found.positions[:, 3]).max() > 1e-3


def test_it_rests_in_balance_with_its_weight():
    held = signals_of(TIMES, arm=np.full_like(TIMES, 0.8))
    found = swing("passive_wrist", NUMBERS, held)
    assert np.abs(found.velocities).max() < 1e-9
    assert found.positions[0, 0] < 0.8, "the club hangs below its drive"
    free = swing("passive_wrist", NUMBERS, held, gravity=0.0)
    assert free.positions[0] == pytest.approx([0.8, 0, 0, 0], abs=1e-12)


@pytest.mark.slow
def test_gradients_against_differences():
    signals = signals_of(TIMES, arm=half_turn(TIMES))
    values, starts = signals.values[..., None], signals.start[..., None]

    def speed(stiffness: Any, mass: Any) -> Any:
        table = {name: jnp.array([value]) for name, value in NUMBERS.items()}
        table |= {"wrist_stiffness": stiffness[None], "clubhead_mass": mass[None]}
        found = trace(
            "passive_wrist", (), True, 8, table, values, starts, np.zeros(8), 1e-3, 9.81,
            np.zeros(0), np.zeros(2),
        )  # fmt: skip
        return jnp.max(found[4]), found[3][0, -1]

    at = [NUMBERS["wrist_stiffness"], NUMBERS["clubhead_mass"]]
    slopes = jax.jacfwd(speed, (0, 1))(*map(jnp.asarray, at))
    for which, value in enumerate(at):
        step = 1e-5 * value
        pairs = []
        for sign in (1, -1):
            moved = list(at)
            moved[which] += sign * step
            pairs.append(np.array(speed(*map(jnp.asarray, moved))))
        difference = (pairs[0] - pairs[1]) / (2 * step)
        assert [float(s[which]) for s in slopes] == pytest.approx(difference, rel=1e-6)


def test_what_cannot_be_trusted_is_said():
    soft = NUMBERS | {"shaft_stiffness": 50.0}
    hard = signals_of(TIMES, arm=half_turn(TIMES, 0.6))
    found = swing("passive_wrist", soft, hard)
    assert np.abs(found.bend).max() > found.most_bend == planar.most_bend(soft)
    assert "beyond 0.58 m, 0.6 of its length" in found.status
    stiffer = swing("passive_wrist", NUMBERS, hard)
    assert 0.15 < np.abs(stiffer.bend).max() and stiffer.status == swings_of.FINISHED
    loose = swing("passive_wrist", NUMBERS | {"sleeve_stiffness": 100.0}, hard)
    assert np.abs(loose.positions[:, 2]).max() > LARGEST_TILT
    assert "The grip tilts by" in loose.status and "beyond 0.6 rad" in loose.status
    gentle = swing("passive_wrist", NUMBERS, signals_of(TIMES, arm=half_turn(TIMES, 0.8, 0.5)))
    assert gentle.status == swings_of.FINISHED
    pushed = NUMBERS | {"shaft_damping": -20.0}
    wild = swing("passive_wrist", pushed, signals_of(TIMES, arm=half_turn(TIMES, 0.35)))
    assert wild.status in (swings_of.RAN_AWAY,) or "did not converge" in wild.status


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"model": "robot"}, "expected one of"),
        ({"laws": {("wrist", "sensor_delay"): 1.0}}, "expected a force law"),
        ({"laws": {("moon", "coulomb_friction"): 1.0}}, "expected a force law"),
    ],
)
def test_unknown_things_are_refused(change, words):
    asked: dict[str, Any] = {"model": "pinned_wrist", "laws": None} | change
    with pytest.raises(ValueError, match=words) as refusal:
        swing(asked["model"], NUMBERS, signals_of(TIMES), laws=asked["laws"])
    assert "Mend:" in str(refusal.value)


def test_samples_that_do_not_fit_are_refused():
    with pytest.raises(ValueError, match="uniform"):
        signals_of(np.array([0.0, 1.0, 3.0]))
    with pytest.raises(ValueError, match="finite samples"):
        signals_of(TIMES, arm=TIMES[:-1])
    with pytest.raises(ValueError, match="finite samples"):
        signals_of(TIMES, torque=np.full_like(TIMES, np.nan))
