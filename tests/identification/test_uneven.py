"""Noise that grows or has heavy tails: chosen and weighed rightly, its density the exact one."""

from dataclasses import replace
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy import stats
from scipy.signal import lfilter

from supple.identification.base import fit_base
from supple.identification.coast import eliminated
from supple.identification.constants import fit_json
from supple.identification.likelihood import log_posterior
from supple.identification.noise import Noise, choose_noise
from supple.identification.problem import Problem, make_problem
from supple.identification.tails import expanded
from supple.identification.uneven import Told, Uneven, choose_law, likeliest_law, motion_of
from supple.identification.weighing import with_laws
from tests.identification.benches import DAMPING, STIFFNESS, make_bench
from tests.identification.replicates import NAMES, QUICK, drawn, fit_of, ranks, under_law
from tests.lab.noise import draw_noise

COUNT = 2000
TIMES = np.arange(COUNT)
PREDICTED = 20.0 * np.exp(-TIMES / 800) * np.cos(2 * np.pi * 0.031 * TIMES)
MOTION = motion_of(PREDICTED)
KINDS = {
    "white": ((), 0.0, 0.0),
    "ar1": ((0.95,), 0.0, 0.0),
    "ar2": ((0.9, -0.4), 0.0, 0.0),
    "growing": ((), 3.0, 0.0),
    "ar1 + growing": ((0.8,), 3.0, 0.0),
    "student_t": ((), 0.0, 0.25),
    "ar1 + student_t": ((0.8,), 0.0, 0.25),
    "growing + student_t": ((), 3.0, 0.25),
}


def student(tail: float) -> Any:
    """Student's law of unit scale; the normal law for a tail of 0."""
    return stats.t(1 / tail) if tail else stats.norm()


def made(kind: str, seed: int, count: int = COUNT) -> np.ndarray:
    """Noise of a kind, of unit scale at rest; its memory long under way."""
    phi, growth, tail = KINDS[kind]
    chance = np.random.default_rng([seed, 5])
    new = chance.standard_t(1 / tail, count + 500) if tail else chance.standard_normal(count + 500)
    told = np.asarray(lfilter([1.0], [1.0, *(-p for p in phi)], new))[500:]
    return told * np.sqrt(1.0 + (growth * MOTION[:count]) ** 2)


def chosen(residual: np.ndarray) -> Noise:
    return choose_law(choose_noise(residual, PREDICTED)[0], residual, PREDICTED)


def right(kind: str, seeds: range) -> int:
    return sum(chosen(made(kind, seed)).law == kind for seed in seeds)


@pytest.mark.parametrize("kind", KINDS)
def test_the_law_is_chosen_by_the_data(kind):
    assert right(kind, range(10)) >= 9


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_the_right_law_is_chosen_in_95_of_100(kind):
    assert right(kind, range(100, 200)) >= 95


@pytest.mark.parametrize("kind", ["growing", "student_t", "ar1 + growing", "growing + student_t"])
def test_the_numbers_of_a_law_are_found(kind):
    phi, growth, tail = KINDS[kind]
    law = Uneven(phi, 1.5, growth or 0.0, tail or 0.0, MOTION, np.ones(COUNT))
    table = []
    for seed in range(12):
        residual = made(kind, seed)
        found = likeliest_law(law, residual, residual + PREDICTED)
        assert isinstance(found, Uneven)
        table.append([found.std, found.growth, found.tail, *found.coefficients])
    middle, error = np.mean(table, axis=0), np.std(table, axis=0) / np.sqrt(12)
    truth = np.array([1.0, growth, tail, *phi])
    assert np.all(np.abs(middle - truth) < 4 * error + 1e-9), (middle, error)
    assert middle == pytest.approx(truth, abs=0.25)


@pytest.mark.parametrize(
    ("kind", "law", "words"),
    [
        ("heteroscedastic", {"growth": 3.0}, {"growing"}),
        ("heavy_tailed", {"freedom": 4.0}, {"student_t"}),
        ("outliers", {"share": 0.01}, {"student_t"}),
        ("quantised", {}, {"white", "ar1"}),
        ("white", {}, {"white"}),
    ],
)
def test_the_noises_of_the_bench_are_told_apart(kind, law, words):
    for seed in range(5):
        residual = draw_noise(kind, 0.3, PREDICTED, np.random.default_rng(seed), law)
        assert chosen(residual).law in words


def test_a_coarse_instrument_is_not_believed_beyond_its_steps(monkeypatch):
    """At rest it shows the same reading for ever; that is no noise of size zero."""
    step, even = 4.0, Noise((), 1.0)
    brief = 20.0 * np.exp(-TIMES / 200) * np.cos(2 * np.pi * 0.031 * TIMES)
    residual = step * np.round(brief / step) - brief
    assert choose_law(even, residual, brief) is even
    monkeypatch.setattr("supple.identification.uneven._resolution", lambda values: 0.0)
    assert isinstance(choose_law(even, residual, brief), Uneven)


def test_few_samples_and_no_motion_choose_nothing():
    even = Noise((), 1.0)
    residual = made("growing + student_t", 1)
    assert choose_law(even, residual[:90], PREDICTED[:90]) is even
    assert choose_law(even, residual, np.ones(COUNT)) is even
    assert choose_law(even, np.zeros(COUNT), PREDICTED) is even


@pytest.mark.parametrize("kind", ["ar1 + growing", "ar1 + student_t", "growing + student_t"])
def test_innovations_are_even_and_weights_are_those_of_the_law(kind):
    phi, growth, tail = KINDS[kind]
    residual = made(kind, 2)
    law = Uneven(phi, 1.0, growth, tail, MOTION, np.ones(COUNT)).weighed(residual)
    e = law.innovations(residual)
    fits = student(tail)
    assert stats.kstest(e, fits.cdf).pvalue > 1e-3
    assert np.corrcoef(np.abs(e[len(phi) :]), MOTION[len(phi) :])[0, 1] < 0.08
    slope = (fits.logpdf(e - 1e-6) - fits.logpdf(e + 1e-6)) / 2e-6
    assert law.trust**2 * e == pytest.approx(slope, abs=1e-6)
    assert np.mean(law.whiten(residual) ** 2) == pytest.approx(1.0, abs=0.06)
    assert law.marginal_std == pytest.approx(np.std(residual), rel=0.15)
    columns = law.whiten(np.column_stack([residual, -2 * residual]))
    assert columns == pytest.approx(np.column_stack([law.whiten(residual)] * 2) * [1, -2])
    circle = np.arange(20000) / 20000
    assert np.mean(law.spectrum(circle)) == pytest.approx(law.marginal_std**2, rel=1e-6)


@given(st.floats(0.01, 0.39))
def test_expected_weights_are_the_information_of_students_law(tail):
    law = Uneven((), 1.0, 0.0, tail, np.zeros(3), np.ones(3)).expected
    told = student(tail)
    grid = np.linspace(-60.0, 60.0, 40001)
    slope = np.gradient(told.logpdf(grid), grid)
    information = np.trapezoid(slope**2 * told.pdf(grid), grid)
    assert law.trust**2 == pytest.approx(np.full(3, information), rel=2e-3)


def test_what_unknowns_have_followed_is_counted():
    """Of a memory and a size after twenty numbers were fitted to 200 samples."""
    columns = np.random.default_rng(0).standard_normal((200, 20)).cumsum(axis=0)
    told, even, table = Told(columns, np.zeros((20, 20))), Noise((0.5,), 1.0), []
    for seed in range(30):
        new = np.random.default_rng([seed, 9]).standard_normal(400)
        noise = np.asarray(lfilter([1.0], [1.0, -0.6], new))[200:]
        white = even.whiten(np.column_stack([columns, noise]))
        left = noise - columns @ np.linalg.lstsq(white[:, :-1], white[:, -1], rcond=None)[0]
        bare, counted = (likeliest_law(even, left, noise, t) for t in (None, told))
        table.append([bare.std, counted.std, bare.coefficients[0], counted.coefficients[0]])
    bare, counted, faint, right = np.mean(table, axis=0)
    assert counted == pytest.approx(1.0, abs=0.03) and bare < 0.97
    assert right == pytest.approx(0.6, abs=0.05) and faint < 0.52


# the density


def test_normal_innovations_have_the_products_of_their_columns():
    white = np.random.default_rng(1).standard_normal((2, 4, 50))
    rate, center = jnp.array([0.5, 1.0, 2.0]), jnp.array([0.1, -1.0, 0.3])
    found = expanded(jnp.array(white), jnp.ones((2, 50)), jnp.zeros(2), rate, center)
    assert np.asarray(found) == pytest.approx(np.einsum("smn,skn->mk", white, white), rel=1e-9)


@pytest.mark.parametrize("tail", [0.05, 0.2, 0.35])
def test_linear_numbers_are_integrated_out_of_students_law(tail):
    """Against Gauss and Hermite's quadrature over both of them, up to one constant."""
    chance = np.random.default_rng(3)
    columns = chance.standard_normal((2, 150))
    rate, center = np.array([0.8, 0.3]), np.array([0.4, -1.0])
    nodes, weights = np.polynomial.hermite_e.hermegauss(24)
    told, wanted = [], []
    for seed in range(4):
        truth = center + chance.standard_normal(2) / rate
        gap = truth @ columns + np.random.default_rng(seed).standard_t(1 / tail, 150)
        white = np.vstack([columns, gap])[None]
        prior = jnp.array(rate), jnp.array(center)
        whole = expanded(jnp.array(white), jnp.ones((1, 150)), jnp.array([tail]), *prior)
        told.append(float(eliminated(whole, *prior)[0]))
        spread = np.linalg.inv(columns @ columns.T)
        root = np.linalg.cholesky(2.0 * spread)
        middle = truth + spread @ columns @ np.clip(gap - truth @ columns, -4, 4)
        grid = np.stack(np.meshgrid(nodes, nodes, indexing="ij"), axis=-1).reshape(-1, 2)
        points = middle + grid @ root.T
        left = gap - points @ columns
        log = np.sum(student(tail).logpdf(left), axis=1)
        log -= 0.5 * np.sum(((points - center) * rate) ** 2, axis=1)
        share = np.log(np.outer(weights, weights).ravel()) + 0.5 * np.sum(grid**2, axis=1)
        wanted.append(np.logaddexp.reduce(log + share))
    assert np.ptp(told) > 1.0
    assert np.array(told) - told[0] == pytest.approx(np.array(wanted) - wanted[0], abs=0.15)


@pytest.mark.parametrize(("growth", "tail"), [(3.0, 0.0), (0.0, 0.25)])
def test_the_density_is_that_of_the_whole_channel(small_problem, growth, tail):
    """Against the closed form of a decay, its linear numbers at their best values."""
    one = drawn(small_problem, np.random.default_rng(3), 0.0, growth=growth, tail=tail)
    fit = under_law(fit_of(one, 0), growth > 0, tail > 0)
    density = log_posterior(fit, 4)
    part = "growth" if growth else "tail"
    assert [u.label.split("[")[0] for u in density.unknowns[2:]] == [
        "see_cart.noise", f"see_cart.{part}"
    ]  # fmt: skip
    root = np.linalg.cholesky(density.covariance)
    points = density.mean + np.random.default_rng(1).standard_normal((4, len(root))) @ root.T
    wanted = []
    for point in points:
        numbers = density.natural(point)
        value = profiled(one, fit, numbers, part)
        slopes = [u.log_slope(at) for u, at in zip(density.unknowns, point) if not u.is_scale]
        wanted.append(value + float(np.sum(slopes)))
    told = density(points)
    assert np.ptp(told) > 1.0
    assert told - told[0] == pytest.approx(np.array(wanted) - wanted[0], abs=0.1)


def profiled(one, fit, numbers: np.ndarray, part: str) -> float:
    """Log density with linear numbers integrated by Laplace's method, from a closed-form decay."""
    prepared = one.problem.records[0]
    values, mass = prepared.sensors[0].values, one.problem.numbers["masses.cart.mass"]
    time = np.arange(len(values)) * prepared.step
    k, c, size, last = numbers
    a = c / (2 * mass)
    w = np.sqrt(k / mass - a**2)
    fade = np.exp(-a * time)
    sine = fade * np.sin(w * time) / w
    columns = np.stack([fade * np.cos(w * time) + a * sine, sine, np.ones_like(time)])
    (law,) = log_laws(fit)
    sizes = np.sqrt(1.0 + (last * law.motion) ** 2) if part == "growth" else np.ones_like(time)
    tail = 0.0 if part == "growth" else last
    scale = size * sizes
    prior = np.array([entry.prior for entry in one.entries[2:]])
    center = np.array([entry.center for entry in one.entries[2:]])
    best = center.copy()
    for _ in range(60):
        e = (values - best @ columns) / scale
        weight = (1 + tail) / (1 + tail * e**2)
        weighed = columns * weight / scale**2
        information = weighed @ columns.T + np.diag(prior**-2)
        best = np.linalg.solve(information, weighed @ values + center / prior**2)
    e = (values - best @ columns) / scale
    slope = (1 + tail) * (1 - tail * e**2) / (1 + tail * e**2) ** 2
    curved = (columns * slope / scale**2) @ columns.T + np.diag(prior**-2)
    total = np.sum(student(tail).logpdf(e) - np.log(scale)) - 0.5 * np.sum(
        ((best - center) / prior) ** 2
    )
    total -= 0.5 * np.linalg.slogdet(curved)[1] + np.log(size)
    for entry, number in zip(one.entries[:2], (k, c)):
        total -= 0.5 * ((number - entry.center) / entry.prior) ** 2
    return float(total)


def log_laws(fit) -> list[Uneven]:
    return [noise for noise in fit.model.noises.values() if isinstance(noise, Uneven)]


# fits


def test_even_noise_leaves_a_fit_as_it_is(clean_fit):
    assert with_laws(clean_fit) is clean_fit
    assert fit_json(clean_fit, {})["noise"]["law"] == "white"


def test_errors_of_the_model_are_not_taken_for_noise_that_grows(softening_fit):
    """They grow with the motion too; the noise of the instrument stays what it was."""
    fit = with_laws(softening_fit)
    assert not log_laws(fit)
    assert fit.problem.floor == softening_fit.problem.floor


@pytest.mark.parametrize(
    ("noise", "law", "word", "number"),
    [
        ("heteroscedastic", {"growth": 4.0}, "growing", "growth"),
        ("heavy_tailed", {"freedom": 3.0}, "student_t", "freedom"),
    ],
)
def test_a_fit_under_such_noise_knows_it_and_is_right(tmp_path, noise, law, word, number):
    bench = make_bench(tmp_path, noise=noise, noise_law=law, snr_db=30.0, seed=4)
    plain = fit_base(make_problem(bench.records, bench.rig))
    fit = with_laws(plain)
    assert {one.law for one in log_laws(fit)} == {word}
    told = fit_json(fit, {})
    assert told["noise"]["law"] == word and told["noise"]["parameters"][number] > 1
    for label, truth in (("links.spring.stiffness", STIFFNESS), ("links.spring.damping", DAMPING)):
        index = fit.index(label)
        assert abs(fit.value(index) - truth) < 4 * fit.std(index)
        if word == "student_t":
            assert fit.std(index) < 0.9 * plain.std(index)
    assert fit.converged
    again = with_laws(fit)
    shift = np.abs(again.x - fit.x) / np.sqrt(np.diag(fit.covariance))
    assert np.max(shift) < 0.05


def test_a_stated_noise_is_not_asked(tmp_path):
    bench = make_bench(tmp_path, noise="heavy_tailed", noise_law={"freedom": 3.0}, snr_db=30.0)
    fit = fit_base(make_problem(bench.records, bench.rig))
    records = []
    for prepared in fit.problem.records:
        (sensor,) = prepared.sensors
        told = replace(sensor, channel=replace(sensor.channel, noise=1e-3))
        records.append(replace(prepared, sensors=(told,)))
    model = replace(fit.model, problem=replace(fit.problem, records=tuple(records)))
    stated = replace(fit, model=model)
    assert with_laws(stated) is stated


# calibration


def worst_p_value(problem: Problem, count: int, growth: float, tail: float, told: bool) -> float:
    """Smallest p-value of uniform ranks of the two constants, corrected for their number."""
    table = []
    for seed in range(count):
        one = drawn(problem, np.random.default_rng([31, seed]), 0.0, growth=growth, tail=tail)
        fit = fit_of(one, 0)
        fit = under_law(fit, growth > 0, tail > 0) if told else fit
        found = ranks(fit, one.truth, replace(QUICK, seed=seed))
        table.append([found[name] for name in NAMES])
    shares = np.array(table).T
    centered = 2 * np.abs(shares - 0.5)
    chances = [stats.kstest(row, "uniform").pvalue for row in (*shares, *centered)]
    return min(chances) * len(chances)


@pytest.mark.slow
@pytest.mark.parametrize(("growth", "tail"), [(4.0, 0.0), (0.0, 0.3), (3.0, 0.2)])
def test_ranks_of_the_truth_are_uniform_under_uneven_noise(small_problem, growth, tail):
    assert worst_p_value(small_problem, 200, growth, tail, told=True) > 0.01


@pytest.mark.slow
def test_an_even_likelihood_fails_the_same_test_where_noise_grows(small_problem):
    """Its posteriors are too narrow where the motion is large and too wide where it is small."""
    assert worst_p_value(small_problem, 400, 12.0, 0.0, told=False) < 0.01
