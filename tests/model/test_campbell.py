"""Modes in a steady rotation: closed forms, the energies themselves, and modes followed."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from supple.model import planar
from supple.model.campbell import campbell, modes_at
from supple.model.linear import modes
from supple.model.robot import MODELS, PRESETS, Robot

CLUB = PRESETS["robo_v_sleeve_50"]
STIFF = CLUB | {"sleeve_stiffness": 1e7, "shaft_stiffness": 9e4}


def robot(model: str = "pinned_wrist") -> Robot:
    return Robot(model, tuple(CLUB))


def moments(p: Any) -> tuple[float, float]:
    """First and second moment of the whole stiff club about the wrist's pivot [kg m, kg m^2]."""
    at = planar.points_of(p)
    first = (
        p["collet_mass"] * p["collet_centre"]
        + p["grip_mass"] * at.grip
        + p["clubhead_mass"] * at.head
    )
    second = p["collet_inertia"] + p["grip_inertia"] + p["grip_mass"] * at.grip**2
    return first, second + p["clubhead_mass"] * at.head**2


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("model", MODELS)
def test_at_rest_they_are_the_linear_modes(model, preset):
    p = PRESETS[preset]
    ours, truth = modes_at(robot(model), p, 0.0), modes(robot(model), p)
    assert np.all(np.abs(ours.poles - truth.poles) < 1e-9 * np.maximum(np.abs(truth.poles), 1.0))
    swings = truth.damped_frequencies > 0.1
    for name in ("frequencies", "damping_ratios", "damped_frequencies"):
        found, wanted = getattr(ours, name)[swings], getattr(truth, name)[swings]
        assert found == pytest.approx(wanted, rel=1e-9)
    for one, other in zip(ours.shapes.T[swings], truth.shapes.T[swings], strict=True):
        alike = abs(np.vdot(one, other)) / np.linalg.norm(one) / np.linalg.norm(other)
        assert alike == pytest.approx(1.0, abs=1e-9)


def lagrange(speed: float, wrist: float) -> Any:
    """Lagrange's equations of the energies, the arm at 0 turning at `speed`."""
    d, rate = jnp.array([0.0, wrist]), jnp.array([speed, 0.0])

    def momentum(q: Any, v: Any, d: Any) -> Any:
        return jax.grad(planar.kinetic_energy, 2)(CLUB, q, v, d, rate, jnp)

    def equations(q: Any, v: Any, a: Any) -> Any:
        change = jax.jvp(momentum, (q, v, d), (v, a, rate))[1]
        moving = jax.grad(planar.kinetic_energy, 1)(CLUB, q, v, d, rate, jnp)
        springs = jax.grad(planar.spring_energy, 1)(CLUB, q, d, True)
        losses = jax.grad(planar.dissipation, 2)(CLUB, q, v, rate, True)
        return change - moving + springs + losses

    return equations


def test_the_matrices_are_those_of_the_energies_about_the_bent_club():
    speed, wrist = 15.0, 0.6
    found = modes_at(robot(), CLUB, speed, wrist)
    assert found.is_balanced and abs(found.equilibrium[3]) > 0.01
    given = jnp.asarray(found.equilibrium), jnp.array([speed, 0.0, 0.0, 0.0]), jnp.zeros(4)
    equations = lagrange(speed, wrist)
    stiffness, damping, mass = jax.jacfwd(equations, (0, 1, 2))(*given)
    assert np.max(np.abs(equations(*given))) < 1e-9
    for ours, truth in zip(
        (found.stiffness, found.damping, found.mass), (stiffness, damping, mass), strict=True
    ):
        assert np.max(np.abs(ours - truth)) < 1e-11 * np.max(np.abs(truth))


def test_rotation_adds_gyroscopic_forces_and_forces_with_a_potential():
    still, turning = (modes_at(robot(), CLUB, speed, 0.6) for speed in (0.0, 15.0))
    assert np.max(np.abs(turning.mass - turning.mass.T)) < 1e-14
    assert np.max(np.abs(turning.stiffness - turning.stiffness.T)) < 1e-7
    # the shaft's damper turns with the bent line: what is left beside it has no power
    q, v = jnp.asarray(turning.equilibrium), jnp.zeros(4)
    losses = jax.hessian(planar.dissipation, 2)(CLUB, q, v, jnp.zeros(2), True)
    assert np.max(np.abs(losses - still.damping)) < 0.01
    added = turning.damping - np.asarray(losses)
    assert np.max(np.abs(added)) > 0.01
    assert np.max(np.abs(added + added.T)) < 1e-9 * np.max(np.abs(turning.damping))


def test_centrifugal_stiffening_is_tension_times_shortening():
    """Springs, less what flies outwards, plus the head's pull along the shaft."""
    speed, at, m = 40.0, planar.points_of(CLUB), CLUB["clubhead_mass"]
    found = modes_at(robot("fixed_collet"), CLUB, speed)
    short = jax.hessian(planar.foreshortening, 1)(CLUB, jnp.zeros(4))[1:, 1:]
    pull = m * speed**2 * (CLUB["arm_length"] + at.head)
    springs = jax.hessian(planar.spring_energy, 1)(CLUB, jnp.zeros(4), jnp.zeros(2), False)
    springs = np.asarray(springs)[1:, 1:]
    bare = springs - speed**2 * np.diag([CLUB["grip_mass"], 0.0, m])
    assert found.stiffness == pytest.approx(bare + pull * np.asarray(short), abs=1e-8)
    # without its shortening the shaft could not hold the head from sqrt(k/m), 26 rad/s, on
    limit = np.sqrt(CLUB["shaft_stiffness"] / m)
    assert 26.0 < limit < 26.5 < speed and np.linalg.eigvalsh(bare).min() < 0 and found.is_stable


@pytest.mark.parametrize("model", ["fixed_collet", "driven_collet", "pinned_wrist"])
def test_a_club_in_line_with_its_arm_is_stable_at_40_rad_per_s(model):
    assert modes_at(robot(model), CLUB, 40.0).is_stable


@pytest.mark.parametrize("speed", [5.0, 20.0])
def test_a_stiff_club_without_a_wrist_spring_is_a_centrifugal_pendulum(speed):
    first, second = moments(STIFF)
    wanted = speed * np.sqrt(STIFF["arm_length"] * first / second) / (2 * np.pi)
    found = modes_at(robot("driven_collet"), STIFF, speed)
    nearest = np.min(np.abs(found.frequencies - wanted))
    assert nearest < 0.01 * wanted and not nearest < 1e-9 * wanted  # stiff, but not rigid


def test_a_club_folded_back_is_pressed_over_where_its_wrist_gives_way():
    weak = STIFF | {"wrist_stiffness": 20.0, "wrist_damping": 0.5}
    first, _ = moments(weak)
    limit = np.sqrt(weak["wrist_stiffness"] / (weak["arm_length"] * first))
    speeds = np.arange(0.0, 1.5 * limit, limit / 100)
    found = campbell(robot(), weak, speeds, np.pi)
    (at,) = [at for at in found.unstable_from if at is not None]
    assert at == pytest.approx(limit, rel=0.03)
    assert found.status == "unstable" and f"unstable from {at:.6g} rad/s" in found.sentence


def test_modes_are_followed_by_shape_where_their_frequencies_cross():
    found = campbell(robot(), CLUB, np.arange(0.0, 41.0, 5.0))
    assert found.status == "stable" and "stable at all speeds from 0 to 40" in found.sentence
    assert found.likeness.min() > 0.99
    first, second = found.frequencies[:, 0], found.frequencies[:, 1]
    assert first[0] < second[0] and first[-1] > second[-1]
    for row, speed in zip(found.poles, found.speeds, strict=True):
        own = modes_at(robot(), CLUB, speed)
        assert np.sort(np.abs(row)) == pytest.approx(np.sort(np.abs(own.poles)), rel=1e-9)
    apart = campbell(robot(), CLUB, [0.0, 40.0])
    assert apart.poles[-1] == pytest.approx(found.poles[-1], rel=1e-9)
    back = campbell(robot(), CLUB, [40.0, 0.0])
    assert np.sort(back.frequencies[1]) == pytest.approx(np.sort(found.frequencies[0]), rel=1e-9)


def test_a_mode_keeps_its_row_when_a_slower_oscillation_appears():
    """Without a wrist spring the club hangs loose at rest, and swings slowly once it turns."""
    found = campbell(robot("driven_collet"), CLUB, [0.0, 10.0, 40.0])
    own = modes_at(robot("driven_collet"), CLUB, 10.0)
    assert own.frequencies[0] < 2.0 < 10.0 < own.frequencies[1]
    assert found.frequencies[1, 0] == pytest.approx(own.frequencies[1], rel=1e-9)
    assert np.all(np.diff(found.frequencies[:, 0]) > 0) and found.likeness[:, 0].min() > 0.99


def test_it_says_where_the_balance_ends_and_where_the_shaft_bends_too_far():
    folded = campbell(robot("fixed_collet"), CLUB, [0.0, 30.0, 60.0], 2.0)
    assert "no steady bent club was found" in folded.sentence
    assert not folded.is_balanced[-1]
    gripped = CLUB | {"sleeve_stiffness": 1e8}
    bent = campbell(robot("fixed_collet"), gripped, [0.0, 40.0], 2.0)
    assert "beyond 0.58 m, 0.6 of its length" in bent.sentence and np.all(bent.is_balanced)
    fine = campbell(robot("fixed_collet"), gripped, [0.0, 30.0], 1.0)
    assert 0.3 < fine.bend < fine.most_bend and "bends by" not in fine.sentence
    straight = modes_at(robot("fixed_collet"), CLUB, 60.0, 2.0)
    assert not straight.is_balanced and straight.equilibrium[3] == 0.0


def test_a_fixed_collet_needs_no_wrist():
    few = {name: value for name, value in CLUB.items() if not name.startswith("wrist")}
    found = modes_at(Robot("fixed_collet", tuple(few)), few, 20.0, 0.1)
    assert found.poles == pytest.approx(modes_at(robot("fixed_collet"), CLUB, 20.0, 0.1).poles)


def test_what_cannot_be_is_refused():
    with pytest.raises(ValueError, match="found none for 'grip_mass'"):
        modes_at(robot(), {k: v for k, v in CLUB.items() if k != "grip_mass"}, 1.0)
    with pytest.raises(ValueError, match="grip_mass = nan"):
        modes_at(robot(), CLUB | {"grip_mass": np.nan}, 1.0)
    with pytest.raises(ValueError, match="found inf"):
        modes_at(robot(), CLUB, np.inf)
    with pytest.raises(ValueError, match="no spring holds"):
        modes_at(robot("driven_collet"), CLUB, 1.0, 0.5)
    with pytest.raises(ValueError, match="at least one"):
        campbell(robot(), CLUB, [])
