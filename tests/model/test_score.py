"""Scores: closed forms against samples and modes, derivatives, and the thesis's maps of wrists."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg
from hypothesis import given, strategies as st

from supple.model.chain import Chain
from supple.model.drives import Hold, impact, release
from supple.model.linear import Port, modes
from supple.model.motion import respond
from supple.model.ringdown import (
    FreeResponse,
    after_impulse,
    after_release,
    energy,
    free_samples,
    transition,
)
from supple.model.robot import PRESETS, Robot
from supple.model.score import (
    SCORES,
    closed_rms,
    cycles,
    log_decrement,
    modal_decrement,
    peak,
    rms,
    settling,
)

# Table 4, line 1248: the 50 % sleeve as chapter 7 simulates it
NUMBERS = PRESETS["robo_v"] | {"sleeve_stiffness": 130e3, "sleeve_damping": 12e3}
ROBOT = Robot("pinned_wrist", tuple(NUMBERS))
FORCE = Port("clubhead", "force", held=True)
SENSOR = Port("clubhead", "acceleration", "collet")
IMPULSE = 0.255
TIMES = np.arange(2001) * 1e-3
CHAIN = Chain(("cart",), (("spring", "ground", "cart"),))


@jax.jit
def _response(numbers):
    return after_impulse(ROBOT, numbers, FORCE, IMPULSE, SENSOR)


def response(stiffness, damping, **others):
    wrist = {"wrist_stiffness": stiffness, "wrist_damping": damping}
    return _response(NUMBERS | others | wrist)


def by_modes(free: FreeResponse, times: np.ndarray) -> np.ndarray:
    poles, vectors = np.linalg.eig(np.asarray(free.a))
    shares = (np.asarray(free.row) @ vectors) * np.linalg.solve(vectors, np.asarray(free.start))
    return np.real(np.exp(np.outer(times, poles)) @ shares)


def rms_by_modes(free: FreeResponse, duration: float) -> float:
    poles, vectors = np.linalg.eig(np.asarray(free.a))
    shares = (np.asarray(free.row) @ vectors) * np.linalg.solve(vectors, np.asarray(free.start))
    both = poles[:, None] + poles[None]
    whole = shares @ ((np.exp(both * duration) - 1.0) / both) @ shares
    return float(np.sqrt(np.real(whole) / duration))


def cart(stiffness=200.0, damping=0.3, mass=0.5):
    return {
        "masses.cart.mass": mass,
        "links.spring.stiffness": stiffness,
        "links.spring.damping": damping,
    }


# closed forms


@pytest.mark.parametrize("wrist", [(50.0, 6.0), (200.0, 4.0), (1000.0, 30.0), (1e5, 2.0)])
def test_closed_rms_samples_and_modes_agree(wrist):
    free = response(*wrist)
    whole = float(closed_rms(free, (0.0, 2.0)))
    assert whole == pytest.approx(rms_by_modes(free, 2.0), rel=1e-9)
    sampled = np.asarray(free_samples(free, 1e-3, 2001))
    assert sampled == pytest.approx(by_modes(free, TIMES), abs=1e-9 * np.abs(sampled).max())
    dense = by_modes(free, np.arange(100_000) * 2e-5 + 1e-5)  # middles of short steps
    assert whole == pytest.approx(np.sqrt(np.mean(dense**2)), rel=1e-5)
    late = by_modes(free, np.arange(40_000) * 1e-5 + 0.100005)
    part = float(closed_rms(free, (0.1, 0.5)))
    assert part == pytest.approx(np.sqrt(np.mean(late**2)), rel=1e-5)
    assert energy(free, 100.0) == pytest.approx(float(energy(free)), rel=1e-11)


def test_the_energy_is_that_of_the_equation_of_lyapunov():
    free = response(200.0, 4.0)
    a, start, row = (np.asarray(one) for one in (free.a, free.start, free.row))
    solved = scipy.linalg.solve_continuous_lyapunov(a, -np.outer(start, start))
    assert energy(free) == pytest.approx(row @ solved @ row, rel=1e-5)  # its own rounding
    exact = scipy.linalg.expm(a * 1e-3)
    assert np.asarray(transition(free.a, 1e-3)) == pytest.approx(exact, abs=1e-6)


def test_the_energy_of_one_mass_is_that_of_the_textbook():
    p = cart()
    free = after_impulse(CHAIN, p, Port("cart", "force"), 0.7, Port("cart", "position"))
    natural, ratio = np.sqrt(200.0 / 0.5), 0.3 / (2 * np.sqrt(200.0 * 0.5))
    expected = (0.7 / 0.5) ** 2 / (4 * ratio * natural**3)
    assert energy(free) == pytest.approx(expected, rel=1e-12)
    assert modal_decrement(free) == pytest.approx(2 * np.pi * ratio / np.sqrt(1 - ratio**2))


def test_what_never_decays_has_infinite_energy_and_a_finite_rms():
    free = after_impulse(
        CHAIN, cart(damping=0.0), Port("cart", "force"), 1.0, Port("cart", "velocity")
    )
    assert energy(free) == np.inf
    period = 2 * np.pi / np.sqrt(200.0 / 0.5)
    assert closed_rms(free, (0.0, period)) == pytest.approx(2.0 / np.sqrt(2.0), rel=1e-12)
    assert modal_decrement(free) == pytest.approx(0.0, abs=1e-12)


def test_what_does_not_move_has_no_energy_and_what_creeps_has_no_finite_decrement():
    still = after_impulse(CHAIN, cart(), Port("cart", "force"), 0.0, Port("cart", "position"))
    assert energy(still) == 0.0
    creeping = cart(damping=100.0)
    slow = after_impulse(CHAIN, creeping, Port("cart", "force"), 1.0, Port("cart", "position"))
    assert modal_decrement(slow) == np.inf


def test_an_impulse_is_the_limit_of_a_short_blow():
    numbers = NUMBERS | {"sleeve_stiffness": 60e3, "sleeve_damping": 200.0}
    short = 1e-6
    free = after_impulse(ROBOT, numbers, FORCE, IMPULSE, Port("clubhead", "position", "collet"))
    blow = impact("clubhead", IMPULSE / short, 0.0, short)
    moved = respond(ROBOT, numbers, blow, TIMES, (Port("clubhead", "position", "collet"),))
    expected = np.asarray(free_samples(free, 1e-3, 2001))
    assert moved.samples[:, 0] == pytest.approx(expected, abs=2e-5 * np.abs(expected).max())


def test_a_release_is_that_of_the_simulation():
    free = after_release(ROBOT, NUMBERS, Hold("clubhead", "collet", 0.15), SENSOR)
    moved = respond(ROBOT, NUMBERS, release("clubhead", 0.15, "collet"), TIMES, (SENSOR,))
    expected = moved.samples[:, 0]
    found = np.asarray(free_samples(free, 1e-3, 2001))
    assert found == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())
    assert energy(free) == pytest.approx(float(energy(free, 100.0)), rel=1e-9)


def test_the_modal_decrement_is_that_of_the_oscillating_mode():
    p = NUMBERS | {"wrist_stiffness": 1000.0, "wrist_damping": 30.0}
    own = modes(ROBOT, p)
    ratio = own.damping_ratios[own.damped_frequencies > 0][0]
    expected = 2 * np.pi * ratio / np.sqrt(1 - ratio**2)
    assert modal_decrement(response(1000.0, 30.0)) == pytest.approx(expected, rel=1e-9)


# sampled


@given(
    ratio=st.floats(0.02, 0.25),
    frequency=st.sampled_from([2.0, 4.0, 5.0, 8.0]),
    scale=st.floats(1e-3, 1e3),
)
def test_every_reading_finds_the_decrement_of_a_pure_decay(ratio, frequency, scale):
    times = np.arange(4000) * 5e-4
    rate = 2 * np.pi * frequency * ratio / np.sqrt(1 - ratio**2)
    samples = scale * np.exp(-rate * times) * np.sin(2 * np.pi * frequency * times)
    expected = rate / frequency
    assert log_decrement(samples, times, reading="local") == pytest.approx(expected, rel=0.01)
    if ratio < 0.15:  # the spectrum's largest bin is the frequency itself
        assert log_decrement(samples, times) == pytest.approx(expected, rel=0.02)
    top = expected / frequency  # ends the envelope's own period
    assert 0.0 < settling(samples, times) < np.log(20.0) / rate + top + 1.0 / frequency


def test_scores_are_read_as_the_contract_says():
    times = np.arange(1000) * 1e-3
    samples = np.exp(-3.1 * times) * np.cos(2 * np.pi * 5.0 * times)
    inside = (times >= 0.1) & (times <= 0.9)
    assert rms(samples, times, (0.1, 0.9)) == pytest.approx(np.sqrt(np.mean(samples[inside] ** 2)))
    assert peak(-samples, times, (0.1, 0.9)) == pytest.approx(np.abs(samples[inside]).max())
    tops = np.array([samples[200 * i : 200 * (i + 1)].max() for i in range(5)])
    assert log_decrement(samples, times) == pytest.approx(np.log(tops[0] / tops[4]) / 4)
    last = np.flatnonzero(np.abs(samples) > 0.05)[-1]
    assert times[last] <= settling(samples, times) <= times[last + 1]
    assert cycles(samples, times) == np.sum(np.exp(-3.1 * 0.2 * np.arange(1, 5)) > 0.05)


def test_a_decrement_ends_where_the_decay_falls_below_one_per_cent():
    times = np.arange(1000) * 1e-3
    quick = np.exp(-15.0 * times) * np.sin(2 * np.pi * 5.0 * times)
    noisy = np.where(times < 0.5, quick, 1e-3 * np.sin(2 * np.pi * 5.0 * times))
    assert log_decrement(noisy, times, reading="local") == pytest.approx(3.0, rel=1e-3)
    quicker = np.exp(-25.0 * times) * np.sin(2 * np.pi * 5.0 * times)  # exp(-5) is below 1 %
    assert log_decrement(quicker, times, reading="local") == pytest.approx(5.0, rel=1e-2)


def test_where_nothing_swings_there_is_no_decrement_and_no_settling():
    times = np.arange(100) * 1e-2
    assert np.isnan(log_decrement(np.exp(-times), times, reading="local"))
    assert np.isnan(log_decrement(-np.ones(100), times))
    assert settling(np.cos(50 * times), times) == np.inf
    assert settling(np.zeros(100), times) == 0.0
    assert cycles(np.zeros(100), times) == 0


@pytest.mark.parametrize("name", list(SCORES))
@pytest.mark.parametrize("at", [0, 700, 2000])
def test_what_is_no_number_has_no_score(name, at):
    """Least of all the best one: a motion that ran away settles at once, if one only compares."""
    samples = np.stack([free_samples(response(k, 9.0), 1e-3, 2001) for k in (100.0, 500.0)])
    samples[0, at] = np.nan
    found = np.asarray(SCORES[name](samples, TIMES))
    assert np.isnan(found[0]) and np.isfinite(found[1])
    assert found[1] == SCORES[name](samples[1], TIMES)


def test_scores_of_nothing_have_no_slope():
    """The first step of a search may start where nothing moves yet."""
    still = jnp.zeros(len(TIMES))
    for each in (rms, peak, settling):
        slope = jax.grad(lambda y, score=each: score(y, TIMES))(still)
        assert np.all(np.isfinite(slope))

    def closed(start: float) -> jax.Array:
        moved = response(100.0, 9.0)
        return closed_rms(FreeResponse(moved.a, start * moved.start, moved.row), (0.1, 0.8))

    assert float(closed(0.0)) == 0.0 and float(jax.grad(closed)(0.0)) == 0.0
    assert float(jax.grad(closed)(1.0)) == pytest.approx(float(closed(1.0)), rel=1e-12)


@pytest.mark.parametrize("name", list(SCORES))
def test_designs_lead_and_each_scores_alone(name):
    samples = np.stack([free_samples(response(k, 9.0), 1e-3, 2001) for k in (100.0, 500.0)])
    together = SCORES[name](samples[:, None], TIMES, (0.0, 1.5))
    assert together.shape == (2, 1)
    alone = [SCORES[name](one, TIMES, (0.0, 1.5)) for one in samples]
    assert np.asarray(together)[:, 0] == pytest.approx(np.asarray(alone), rel=1e-12)


def test_what_cannot_be_scored_is_refused():
    with pytest.raises(ValueError, match="holds samples"):
        rms(np.ones(5), np.arange(5.0), (7.0, 9.0))
    with pytest.raises(ValueError, match="put time last"):
        peak(np.ones((5, 2)), np.arange(5.0))
    with pytest.raises(ValueError, match="even steps"):
        log_decrement(np.ones(3), np.array([0.0, 1.0, 3.0]))
    with pytest.raises(ValueError, match="period, local"):
        log_decrement(np.ones(3), np.arange(3.0), reading="first")
    with pytest.raises(ValueError, match="end < infinity"):
        closed_rms(response(100.0, 5.0), (0.0, np.inf))
    with pytest.raises(ValueError, match="a force or a torque"):
        after_impulse(ROBOT, NUMBERS, Port("clubhead", "position"), 1.0, SENSOR)


# derivatives


def _closed_scores(x):
    free = response(x[0], x[1], clubhead_mass=x[2])
    return jnp.stack([closed_rms(free, (0.0, 2.0)), energy(free), modal_decrement(free)])


def _sampled_scores(x):
    samples = free_samples(response(x[0], x[1], clubhead_mass=x[2]), 1e-3, 2001)
    names = ("rms", "peak", "settling", "log_decrement", "log_decrement_local")
    return jnp.stack([SCORES[name](samples, TIMES, (0.0, 1.9)) for name in names])


@pytest.mark.parametrize(
    ("scores", "part"),
    [
        (_closed_scores, 1e-4),
        # small steps, within which the same sample stays the largest
        pytest.param(_sampled_scores, 2e-5, marks=pytest.mark.slow),
    ],
)
def test_derivatives_are_those_of_central_differences(scores, part):
    at, quick = jnp.array([400.0, 9.0, 0.2]), jax.jit(scores)
    found = np.asarray(jax.jit(jax.jacfwd(scores))(at))

    def slope(i, part):
        step = part * at[i]
        return np.asarray(quick(at.at[i].add(step)) - quick(at.at[i].add(-step))) / (2 * step)

    for i in range(3):
        expected = (4 * slope(i, part) - slope(i, 2 * part)) / 3  # Richardson
        size = np.maximum(np.abs(expected), 0.01 * np.asarray(quick(at)) / at[i])
        off = np.abs(found[:, i] - expected) / size
        assert np.max(off) < 1e-6, (i, off)


def test_both_ways_of_derivation_agree():
    free = response(150.0, 6.0)

    @jax.jit
    def of_matrix(a):
        return closed_rms(FreeResponse(a, free.start, free.row), (0.1, 2.0))

    along = free.a * jnp.asarray(np.random.default_rng(1).uniform(-1.0, 1.0, free.a.shape))
    backward = float(jnp.sum(jax.grad(of_matrix)(free.a) * along))
    forward = float(jax.jvp(of_matrix, (free.a,), (along,))[1])
    assert forward == pytest.approx(backward, rel=1e-6)


# the thesis, chapter 7.3; t = 0 at the end of the impulse, samples of 1 ms, 2 s


@functools.cache
def _tile():
    def one(wrist, inertia):
        free = response(wrist[0], wrist[1], collet_inertia=inertia)
        samples = free_samples(free, 1e-3, 2001)
        local = log_decrement(samples, TIMES, reading="local")
        return closed_rms(free, (0.0, 2.0)), local, peak(samples, TIMES, (1e-3, 2.0))

    return jax.jit(jax.vmap(one, in_axes=(0, None)))


def _map(stiffness, damping, inertia):
    grid = np.stack([axis.ravel() for axis in np.meshgrid(stiffness, damping, indexing="ij")], 1)
    found = _tile()(jnp.asarray(grid), inertia)
    return [np.asarray(one).reshape(len(stiffness), len(damping)) for one in found]


def test_single_designs_of_the_thesis():
    """Lines 1493-1513 and 1469, as an independent calculation finds them."""
    found, local, _ = _map([50.0, 125.0, 200.0], [4.0, 6.0, 7.0, 9.0], 0.02809)
    assert found[1, 2] == pytest.approx(4.116, rel=2e-3)  # line 1495: the smallest RMS
    assert np.all(found >= found[1, 2])
    assert found[2, 0] == pytest.approx(4.58, rel=3e-3)
    assert local[0, 1] == pytest.approx(4.71, abs=5e-3)
    assert local[0, 3] == pytest.approx(3.58, abs=5e-3)
    for wrist, inertia, expected in (((500.0, 11.0), 0.02809, 20.3), ((350.0, 11.0), 0.0102, 19.9)):
        near = _map(wrist[0] + 75.0 * np.arange(-1, 2), wrist[1] + np.arange(-1.0, 2), inertia)[2]
        assert near[1, 1] == pytest.approx(expected, abs=0.05)  # line 1513: the lowest peak
        assert np.all(near >= near[1, 1])
    samples = [
        free_samples(response(*wrist), 1e-3, 2001) for wrist in ((500.0, 50.0), (1000.0, 30.0))
    ]
    assert list(cycles(jnp.stack(samples), TIMES)) == [3, 4]  # line 1469


@pytest.mark.slow
@pytest.mark.parametrize(
    ("inertia", "mean", "smallest"), [(0.02809, 0.6111, 4.112), (0.0102, 0.6087, 4.057)]
)
def test_the_maps_of_75_by_75_wrists(inertia, mean, smallest):
    """Lines 1491-1513: grid 50 + 75 n by 2 + 2 n."""
    count = np.arange(75)
    found, local, tops = _map(50.0 + 75.0 * count, 2.0 + 2.0 * count, inertia)
    assert np.mean(local) == pytest.approx(mean, abs=1e-4)
    assert np.min(found) == pytest.approx(smallest, abs=1e-3)
    assert np.unravel_index(np.argmin(found), found.shape) == (1, 2)  # (125, 6)
    assert np.max(local) == local[0, 2]  # (50, 6)
    assert np.min(tops) == pytest.approx(20.4, abs=0.1)
    shares = np.mean(found[2:9, 2:20] < 6.2)  # line 1515: 200 to 600, 5 to 40
    assert shares > 0.95
