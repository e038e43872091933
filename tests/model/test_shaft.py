"""The shaft against Euler's elastica, with tension along it too, and against a chain of links."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, strategies as st
from numpy.polynomial import Polynomial
from scipy.integrate import solve_bvp

from supple.model import planar, shaft
from supple.model.lagrange import bent_shaft
from supple.model.robot import PRESETS
from supple.model.swing import signals_of, swing
from tests.lab.links import Club, Hold, arrows, swing as swing_links

LEVER = 0.965


def elastica(share: float, tension: float) -> tuple[float, float, float]:
    """Force across, place along the root and angle of the head of a cantilever of length 1.

    EI is 1 too; the head is held at a bend of `share` while `tension` pulls it along the root.
    """
    along = np.linspace(0, 1, 101)

    def rates(_: np.ndarray, y: np.ndarray, p: np.ndarray) -> np.ndarray:
        push = -p[0] * np.cos(y[0]) + tension * np.sin(y[0])
        return np.stack([y[1], push, np.sin(y[0]), np.cos(y[0])])

    def ends(a: np.ndarray, b: np.ndarray, _: np.ndarray) -> np.ndarray:
        return np.array([a[0], b[1], a[2], b[2] - share, a[3]])

    straight = share * np.stack([1.5 * along * (2 - along), 3 * (1 - along), along**2, along])
    straight[3] = along
    guess = [3 * share + 1.2 * share * tension]
    run = solve_bvp(rates, ends, along, straight, p=guess, tol=1e-9, max_nodes=100_000)
    assert run.success, run.message
    return float(run.p[0]), float(run.y[3, -1]), float(run.y[0, -1])


def ours(share: float, tension: float) -> tuple[float, float, float]:
    """The same by the shaft, whose stiffness is then 3."""
    short, lean, _ = shaft.shortening(1.0, share)
    force = shaft.force(1.0, 3.0, share) + tension * lean
    return force, 1.0 - short, shaft.slope_at_head(1.0, share)


# tension [EI/a^2], largest bend, errors of the force [-] and of the head's place [lengths]
STATED = [
    (0.0, 0.5, 2e-5, 3e-6),
    (0.0, 0.6, 4e-3, 2e-4),
    (4.0, 0.5, 0.017, 0.0066),
    (4.0, 0.6, 0.017, 0.0113),
    (8.0, 0.5, 0.036, 0.0105),
    (8.0, 0.6, 0.041, 0.0178),
]


@pytest.mark.parametrize(("tension", "most", "force", "place"), STATED)
def test_it_is_the_elastica_as_far_as_is_stated(tension, most, force, place):
    assert most <= shaft.LARGEST_BEND
    for share in (0.02, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6):
        if share <= most:
            truth, found = elastica(share, tension), ours(share, tension)
            assert abs(found[0] / truth[0] - 1) < force
            assert abs(found[1] - truth[1]) < place
            if not tension:
                assert found[2] == pytest.approx(truth[2], rel=1e-5 if share <= 0.5 else 5e-5)


def test_the_second_order_alone_would_be_far_off():
    """What the head feels at a bend of 0.3 m of a club of 0.965 m, and where it is."""
    force, along, _ = elastica(0.3 / LEVER, 0.0)
    assert 3 * 0.3 / LEVER / force < 0.91
    assert abs(1 - 0.6 * (0.3 / LEVER) ** 2 - along) > 1.5e-3


def test_it_is_left_where_the_force_is_one_per_cent_off():
    def off(share: float) -> float:
        return abs(ours(share, 0.0)[0] / elastica(share, 0.0)[0] - 1)

    assert off(shaft.LARGEST_BEND) < 0.005 and off(0.64) < 0.01 < off(0.65)


def test_the_first_terms_are_those_of_its_series():
    """Angle of the line ``p t1 + p^3 t3`` under a load p, exact polynomials along it."""
    x = Polynomial([0.0, 1.0])

    def bent(load: Polynomial) -> Polynomial:
        """Twice integrated, held at the root and free at the head."""
        slope = load.integ()
        return (slope - slope(1.0)).integ()

    first = bent(Polynomial([-1.0]))
    third = bent(0.5 * first**2)
    assert first.coef == pytest.approx((x - 0.5 * x**2).coef)

    def whole(line: Polynomial) -> float:
        return float(line.integ()(1.0))

    bend = whole(first), whole(third - first**3 / 6)
    short = 0.5 * whole(first**2), whole(first * third - first**4 / 24)
    head = first(1.0), third(1.0)
    # of p and p^3, and p^2 and p^4, to the bend s: p = s/b1 - (b3/b1) (s/b1)^3 ...
    scale, fall = 1 / bend[0], bend[1] / bend[0]
    assert scale == pytest.approx(3.0)
    assert -fall * scale**2 == pytest.approx(shaft.FORCE[0], rel=1e-12)
    assert short[0] * scale**2 == pytest.approx(0.6, rel=1e-12)
    told = (short[1] / short[0] - 2 * fall) * scale**2
    assert told == pytest.approx(shaft.SHORTENING[0], rel=1e-12)
    assert head[0] * scale == pytest.approx(1.5, rel=1e-12)
    assert (head[1] / head[0] - fall) * scale**2 == pytest.approx(shaft.SLOPE[0], rel=1e-12)


def test_the_force_is_the_slope_of_the_energy_and_slopes_are_slopes():
    for share in (-0.55, 0.0, 0.1, 0.4):
        bend = share * LEVER
        slope = jax.grad(shaft.energy, 2)(LEVER, 139.0, bend)
        assert shaft.force(LEVER, 139.0, bend) == pytest.approx(float(slope), abs=1e-12)

        def short(bend: Any) -> Any:
            return shaft.shortening(LEVER, bend)[0]

        _, lean, curve = shaft.shortening(LEVER, bend)
        assert lean == pytest.approx(float(jax.grad(short)(bend)), abs=1e-14)
        assert curve == pytest.approx(float(jax.grad(jax.grad(short))(bend)), rel=1e-13)


SHARES, TILTS = st.floats(-0.5, 0.5), st.floats(-0.4, 0.4)


@given(SHARES, TILTS)
def test_the_bend_is_found_again_whatever_the_grip_s_angle(share, tilt):
    bend = share * LEVER
    reach = LEVER - shaft.shortening(LEVER, bend)[0]
    along = reach * np.cos(tilt) - bend * np.sin(tilt)
    across = reach * np.sin(tilt) + bend * np.cos(tilt)
    found = shaft.bend_of(LEVER, across, tilt)
    head = shaft.head_at(LEVER, across, tilt, found)
    # the series of cosine and sine leave 1e-12 at 0.4 rad, the Newton steps 1e-11
    assert found == pytest.approx(bend, abs=2e-11)
    assert head.along == pytest.approx(along, abs=2e-11)


def test_the_bend_is_found_up_to_the_largest_tilt_and_lost_beyond():
    def off(share: float, tilt: float) -> float:
        bend = share * LEVER
        across = (LEVER - shaft.shortening(LEVER, bend)[0]) * np.sin(tilt) + bend * np.cos(tilt)
        return abs(shaft.bend_of(LEVER, across, tilt) - bend) / LEVER

    def worst(most_bend: float, tilt: float) -> float:
        shares = np.linspace(-most_bend, most_bend, 25)
        return max(off(share, sign * tilt) for share in shares for sign in (-1, 1))

    assert worst(0.5, shaft.LARGEST_TILT) < 5e-9
    assert worst(shaft.LARGEST_BEND, shaft.LARGEST_TILT) < 6e-6
    assert worst(shaft.LARGEST_BEND, 0.7) > 5e-4 and worst(shaft.LARGEST_BEND, 0.8) > 0.03


@given(SHARES, TILTS, st.lists(st.floats(-3, 3), min_size=4, max_size=4))
def test_the_head_moves_as_its_place_says(share, tilt, moves):
    """Rates and acceleration against those of the place by jax, along a curve in time."""
    across_rate, tilt_rate, across_bend, tilt_bend = moves
    across = LEVER * (np.sin(tilt) + share)

    def place(t: Any) -> Any:
        y = across + across_rate * t + across_bend * t * t / 2
        turn = tilt + tilt_rate * t + tilt_bend * t * t / 2
        head = shaft.head_at(LEVER, y, turn, shaft.bend_of(LEVER, y, turn))
        return jnp.stack([head.bend, head.along])

    speed = jax.jacfwd(place)
    head = shaft.head_at(LEVER, across, tilt, shaft.bend_of(LEVER, across, tilt))
    rates = shaft.rates(head, across_rate, tilt_rate)
    assert rates == pytest.approx(np.asarray(speed(0.0)), rel=1e-8, abs=1e-8)
    gain = shaft.acceleration(head, rates[0], tilt_rate, across_bend, tilt_bend)
    assert gain == pytest.approx(float(jax.jacfwd(speed)(0.0)[1]), rel=1e-7, abs=1e-7)


def test_small_bends_and_tilts_are_those_of_the_second_order():
    """What differs is of the third order in the bend, and of the fourth in the place along."""
    off = []
    for size in (0.04, 0.02):
        across = 2.0 * size * LEVER
        head = shaft.head_at(LEVER, across, size, shaft.bend_of(LEVER, across, size))
        near = shaft.near_head(LEVER, across, size)
        off.append([abs(near.bend - head.bend), abs(near.along - head.along)])
        along = jax.grad(lambda y, t: shaft.near_head(LEVER, y, t).along, (0, 1))(across, size)
        assert near.along_by == pytest.approx([float(x) for x in along], rel=1e-12)
    assert np.log2(np.array(off[0]) / off[1]) == pytest.approx([3.0, 4.0], abs=0.1)


@pytest.mark.parametrize("slopes", [jax.jacfwd, jax.jacrev])
def test_slopes_that_jax_is_told_are_those_it_would_find(slopes):
    def plain(lever: Any, across: Any, tilt: Any) -> shaft.Head:
        return shaft.head_at(lever, across, tilt, shaft.bend_of(lever, across, tilt))

    at, which = tuple(jnp.asarray(x) for x in (LEVER, 0.35, 0.2)), (0, 1, 2)
    told, found = slopes(bent_shaft, which)(*at), jax.jacfwd(plain, which)(*at)
    again = slopes(slopes(bent_shaft, which), which)(*at)
    anew = jax.jacfwd(jax.jacfwd(plain, which), which)(*at)
    for one, other in ((told, found), (again, anew)):
        pairs = zip(jax.tree.leaves(one), jax.tree.leaves(other), strict=True)
        assert all(x == pytest.approx(float(y), rel=1e-9, abs=1e-9) for x, y in pairs)


LINKS, NODE = 12, 1e-4
STIFF = PRESETS["robo_v"] | {"sleeve_stiffness": 1e8, "sleeve_damping": 1e4}


def chain() -> Club:
    """The same club as hinged links, each joint with next to no mass."""
    at, h = planar.points_of(STIFF), LEVER / LINKS
    length = np.concatenate([[at.grip + h / 2], np.full(LINKS - 1, h), [h / 2]])
    mass = np.append(np.full(LINKS, NODE), STIFF["clubhead_mass"])
    inertia = np.zeros(LINKS + 1)
    inertia[0] = STIFF["collet_inertia"] + STIFF["grip_inertia"]
    inertia[0] += STIFF["grip_mass"] * at.grip**2
    moment = STIFF["collet_mass"] * STIFF["collet_centre"] + STIFF["grip_mass"] * at.grip
    loss = STIFF["shaft_damping"] / STIFF["shaft_stiffness"]
    club = Club(length, mass, inertia, moment, np.ones(LINKS), loss)
    stiffness, _, row = club.clamped()
    hinge = np.full(LINKS, STIFF["shaft_stiffness"] * float(row @ np.linalg.solve(stiffness, row)))
    return Club(length, mass, inertia, moment, hinge, loss)


# seconds of half a turn; the bend it makes [m]; errors of the head across the collet and along it
@pytest.mark.parametrize(
    ("seconds", "bend", "across", "along"),
    [(0.6, 0.19, 0.003, 0.01), (0.5, 0.27, 0.004, 0.01), (0.44, 0.35, 0.006, 0.02)],
)
def test_a_swing_is_that_of_a_chain_of_links(seconds, bend, across, along):
    """A passive wrist behind an arm: its shape follows the tension in the links alone."""
    beat = 2 * np.pi / seconds

    def arm(t: float) -> tuple[float, float, float]:
        if t >= seconds:
            return 3.0, 0.0, 0.0
        share = t / seconds
        return (
            3.0 * (share - np.sin(beat * t) / (2 * np.pi)),
            3.0 / seconds * (1 - np.cos(beat * t)),
            3.0 / seconds * beat * np.sin(beat * t),
        )

    held = STIFF["wrist_stiffness"], STIFF["wrist_damping"]
    hold = Hold(arm, lambda t: (0.0, 0.0, 0.0), STIFF["arm_length"], held, 0.0, (0.0, 1.0))
    truth = swing_links(chain(), hold, None, 0.55, rate=2000.0, exact=1e-7)
    out, aside = arrows(truth.angle[:, 0])
    from_wrist = truth.head - truth.hand
    told = np.stack([np.sum(from_wrist * out, axis=1), np.sum(from_wrist * aside, axis=1)])
    drive = signals_of(truth.times, arm=np.array([arm(t)[0] for t in truth.times]))
    found = swing("passive_wrist", STIFF, drive, gravity=0.0)
    at, q = planar.points_of(STIFF), found.positions.T
    seen = np.stack([at.grip + planar.head_of(STIFF, q).along, q[3]])
    assert found.status == "The swing was simulated."
    most = np.abs(told[1]).max()
    short = (at.head - told[0]).max()
    assert most == pytest.approx(bend, abs=0.02) and most < found.most_bend
    assert np.abs(seen[1] - told[1]).max() < across * most
    assert np.abs(seen[0] - told[0]).max() < along * short
    assert np.abs(q[0] - truth.angle[:, 0]).max() < 2e-3
