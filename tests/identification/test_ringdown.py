"""Ring-downs against machines of the bench: close modes, error bars, curves against amplitude."""

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.integrate import quad

from supple.identification.noise import Misfit, Noise
from supple.identification.ringdown import (
    GOOD,
    LEFT,
    NOTHING,
    hilbert_envelope,
    log_decrement,
    matrix_pencil,
    ring_modes,
)
from supple.identification.ringdown_curves import amplitude_curves
from tests.lab.bodies import Machine, chain
from tests.lab.motion import Law, simulate
from tests.lab.noise import draw_noise

RATE, MASS = 100.0, 0.5


def cart(ratio: float = 0.01, hertz: float = 4.0) -> Machine:
    beat = 2 * np.pi * hertz
    numbers = {
        "masses.cart.mass": MASS,
        "links.spring.stiffness": MASS * beat**2,
        "links.spring.damping": 2 * ratio * beat * MASS,
    }
    layout = {"masses": ["cart"], "links": {"spring": ("ground", "cart")}, "motion": "translation"}
    return chain(numbers, layout)


def twins() -> Machine:
    """A heavy cart and a light one that rides on it: two modes 5 % apart."""
    heavy, light = 1.0, 0.0024
    beat = 2 * np.pi * 4.1
    numbers = {
        "masses.cart.mass": heavy,
        "masses.rider.mass": light,
        "links.spring.stiffness": heavy * beat**2,
        "links.spring.damping": 2 * 0.011 * beat * heavy,
        "links.tie.stiffness": light * beat**2,
        "links.tie.damping": 2 * 0.011 * beat * light,
    }
    links = {"spring": ("ground", "cart"), "tie": ("cart", "rider")}
    layout = {"masses": ["cart", "rider"], "links": links, "motion": "translation"}
    return chain(numbers, layout)


def ring(machine: Machine, count: int, laws: tuple[Law, ...] = (), reach: float = 1.0):
    """Position of the first body, let go at `reach`."""
    size = len(machine.bodies)
    start = np.zeros(2 * size)
    start[0] = reach
    return simulate(machine, laws, start, np.zeros((count, size)), RATE).position[:, 0]


def loud(clean: np.ndarray, decibels: float) -> float:
    return float(np.sqrt(np.mean(clean**2))) * 10 ** (-decibels / 20)


@pytest.fixture(scope="module")
def single() -> np.ndarray:
    return ring(cart(), 1200)


def test_close_modes_are_told_apart_at_20_db_where_the_decrement_is_lost():
    machine = twins()
    beats, ratios = machine.modes()
    assert 1.04 < beats[1] / beats[0] < 1.06
    clean, rng = ring(machine, 2000), np.random.default_rng(1)
    off, scores = [], []
    for _ in range(20):
        seen = clean + loud(clean, 20.0) * rng.standard_normal(len(clean))
        found = ring_modes(seen, RATE)
        assert len(found.rings) == 2 and found.status == GOOD
        for one, beat, ratio in zip(
            sorted(found.rings, key=lambda r: r.frequency), beats, ratios, strict=True
        ):
            told = beat * np.sqrt(1 - ratio**2)
            off.append((abs(one.frequency / told - 1), abs(one.damping_ratio / ratio - 1)))
            scores.append((one.frequency - told) / one.frequency_std)
            scores.append((one.damping_ratio - ratio) / one.damping_ratio_std)
    frequency, damping = np.max(off, axis=0)
    assert frequency <= 0.002 and damping <= 0.05
    assert 0.75 < np.sqrt(np.mean(np.square(scores))) < 1.25
    naive = log_decrement(clean, RATE)
    assert min(abs(naive.frequency / beats - 1)) > 0.002 and naive.frequency_std > 0.01


@pytest.mark.parametrize("read", [log_decrement, hilbert_envelope])
def test_the_naive_readings_agree_on_one_clean_mode(read, single):
    found = read(single + 1e-3 * np.random.default_rng(2).standard_normal(len(single)), RATE)
    assert found.frequency == pytest.approx(4.0, rel=2e-3)
    assert found.damping_ratio == pytest.approx(0.01, rel=0.03)
    assert found.amplitude == pytest.approx(1.0, rel=0.05)


def covered(clean, kind: str, law: dict, sets: int) -> np.ndarray:
    """Share of 95 % intervals that hold frequency and damping ratio."""
    rng, inside = np.random.default_rng(7), []
    told = 4.0 * np.sqrt(1 - 0.01**2)
    for _ in range(sets):
        seen = clean + draw_noise(kind, loud(clean, 30.0), clean, rng, law)
        one = ring_modes(seen, RATE, count=1).rings[0]
        inside.append(
            (
                abs(one.frequency - told) < 1.96 * one.frequency_std,
                abs(one.damping_ratio - 0.01) < 1.96 * one.damping_ratio_std,
            )
        )
    return np.mean(inside, axis=0)


@pytest.mark.parametrize(("kind", "law"), [("white", {}), ("ar1", {"rho": 0.9})])
def test_error_bars_cover(kind, law, single):
    assert np.all(covered(single, kind, law, 60) > 0.86)  # 0.86: a chance of 0.4 %


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "law"), [("white", {}), ("ar1", {"rho": 0.9})])
def test_error_bars_cover_in_93_to_97_percent(kind, law, single):
    share = covered(single, kind, law, 800)
    assert np.all((share > 0.93) & (share < 0.97)), share


def test_error_bars_of_white_noise_do_not_cover_under_coloured_noise(single, monkeypatch):
    """A deliberately wrong likelihood fails the test of coverage."""

    def white(residual, _):
        return Noise((), float(np.std(residual))), Misfit(1.0, 1.0, 10)

    monkeypatch.setattr("supple.identification.ringdown.choose_noise", white)
    assert np.min(covered(single, "ar1", {"rho": 0.9}, 60)) < 0.8


def curve_sets(law: Law, sets: int, ratio: float = 0.004):
    machine, rng = cart(ratio), np.random.default_rng(3)
    clean = ring(machine, 3000, (law,), 0.02)
    for _ in range(sets):
        yield amplitude_curves(clean + 1e-4 * rng.standard_normal(len(clean)), RATE)


def duffing(amplitude: np.ndarray, cubic: float) -> np.ndarray:
    """Frequency of an undamped cart on a spring with a cubic part, by its energy [Hz]."""
    beat2 = (2 * np.pi * 4.0) ** 2

    def period(a: float) -> float:
        def slowness(turn: float) -> float:
            square = a * a * (1 + np.sin(turn) ** 2)
            return 1 / np.sqrt(beat2 + cubic / MASS * square / 2)

        return 4 * quad(slowness, 0.0, np.pi / 2)[0]

    return np.array([1 / period(a) for a in amplitude])


def test_a_stiffening_spring_has_duffings_backbone_with_error_bars():
    cubic = 0.15 * MASS * (2 * np.pi * 4.0) ** 2 / 0.02**2
    scores = []
    for curves in curve_sets(Law("cubic_stiffness", 0, cubic), 12):
        assert len(curves.amplitude) >= 5 and np.all(np.diff(curves.amplitude) < 0)
        told = duffing(curves.amplitude, cubic)
        assert told[0] / told[-1] > 1.02
        off = np.abs(curves.frequency - told)
        assert np.all(off < 2e-3 * told + 4.0 * curves.frequency_std)
        small = curves.amplitude < 0.5 * curves.amplitude[0]  # where a stretch is nearly even
        scores += list(((curves.frequency - told) / curves.frequency_std)[small])
    assert np.mean(np.abs(scores) < 1.96) > 0.85


def test_quadratic_damping_falls_in_a_line_with_amplitude():
    drag = 0.4
    for curves in curve_sets(Law("quadratic_damping", 0, drag), 4):
        told = 0.004 + 4 * drag * curves.amplitude / (3 * np.pi * MASS)
        off = np.abs(curves.damping_ratio - told)
        assert np.all(off < 0.02 * told + 4.0 * curves.damping_ratio_std)
        assert curves.damping_ratio[0] > 1.4 * curves.damping_ratio[5]


def test_a_spring_that_stiffens_is_no_sum_of_fixed_modes_and_noise_rings_not():
    cubic = 0.15 * MASS * (2 * np.pi * 4.0) ** 2 / 0.02**2
    clean = ring(cart(0.004), 1500, (Law("cubic_stiffness", 0, cubic),), 0.02)
    noise = 1e-5 * np.random.default_rng(1).standard_normal(len(clean))
    assert ring_modes(clean + noise, RATE, count=1).status == LEFT
    silent = ring_modes(np.random.default_rng(1).standard_normal(600), RATE)
    assert silent.status == NOTHING and not silent.rings
    with pytest.raises(ValueError, match="at least 32 samples"):
        ring_modes(np.zeros(12), RATE)


@given(st.floats(0.5, 20.0), st.floats(0.002, 0.2), st.floats(0.0, 6.28), st.floats(-3.0, 3.0))
def test_the_pencil_is_exact_without_noise(hertz, ratio, phase, rest):
    times = np.arange(200) / RATE
    pole = 2 * np.pi * hertz * (-ratio + 1j * np.sqrt(1 - ratio**2))
    values = np.real(np.exp(pole * times + 1j * phase)) + rest
    found = matrix_pencil(values, RATE, 3)
    assert np.min(np.abs(found - pole)) < 1e-5 * abs(pole)
