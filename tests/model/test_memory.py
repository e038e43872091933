"""Laws that remember: each follows its own equations, and its derivatives are exact."""

from itertools import pairwise

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from supple.model.chain import Chain
from supple.model.drives import impact
from supple.model.law import Place, Scales, library, unit_of
from supple.model.linear import Port
from supple.model.motion import CONVERGED, respond
from supple.model.plant import Plant, numbers_vector
from supple.model.respond import simulate, state_history, tangents

MASS, STIFFNESS, DAMPING, STEP = 0.17, 24.0, 0.05, 0.01
NUMBERS = {
    "masses.cart.mass": MASS,
    "links.spring.stiffness": STIFFNESS,
    "links.spring.damping": DAMPING,
}
CHAIN = Chain(("cart",), (("spring", "ground", "cart"),))
PLANT = Plant(CHAIN, (Port("cart", "force"),), (Port("cart", "position"),), ("spring",))
START = (0.1, -0.3)
LASTING = {name: law for name, law in library().items() if law.memory is not None}
CASES = {
    "hysteresis": (0.4, 0.03),
    "relaxation": (6.0, 0.12),
    "slip": (0.4, 0.04),
    "stiffness_drift": (12.0, 0.15),
}
SCALES = Scales(stretch=0.05, rate=0.6, force=2.0, stiffness=40.0, time=0.08)


def push(times):
    return 0.3 * np.sin(7.0 * times)


def vector(name: str, numbers: tuple[float, ...]) -> np.ndarray:
    z = numbers_vector(PLANT, NUMBERS)
    for slot, (_, law, symbol) in enumerate(PLANT.law_numbers):
        if law.name == name:
            symbols = ["", *(shape.symbol for shape in law.shapes)]
            z[PLANT.slots["strengths"].start + slot] = numbers[symbols.index(symbol)]
    z[PLANT.slots["start"]] = START
    return z


def marched(z: np.ndarray, times: np.ndarray, substeps: int = 8) -> np.ndarray:
    inputs = jnp.asarray(push(times)[:, None])
    return np.asarray(simulate(PLANT, substeps, z, inputs, times[1] - times[0], CORNERS))


CORNERS = jnp.full((1, 2), 1e-3)


def integrated(name: str, numbers: tuple[float, ...], times: np.ndarray) -> np.ndarray:
    """The cart's own equations with the law's, by an adaptive method of high order."""
    held = push(times)

    def memory_rate(t: float, x: float, v: float, s: float) -> float:
        if name == "hysteresis":
            return (v - 0.5 * (abs(v) * s + v * abs(s))) / numbers[1]
        if name == "slip":
            return v / numbers[1] if abs(s) < 1 or s * v < 0 else 0.0
        return (x - s) / numbers[1] if name == "relaxation" else 1.0

    def force(x: float, s: float) -> float:
        if name in ("hysteresis", "slip"):
            return numbers[0] * min(max(s, -1.0), 1.0)
        if name == "relaxation":
            return numbers[0] * (x - s)
        return numbers[0] * numbers[1] * (1.0 - np.exp(-s / numbers[1])) * x

    def rates(t: float, y: np.ndarray) -> list[float]:
        x, v, s = y
        total = np.interp(t, times, held) - STIFFNESS * x - DAMPING * v - force(x, s)
        return [v, total / MASS, memory_rate(t, x, v, s)]

    loaded = 1 - np.exp(-START[0] / numbers[1]) if name == "hysteresis" else 0.0
    begin = {"hysteresis": loaded, "relaxation": START[0], "slip": 1.0, "stiffness_drift": 0.0}[
        name
    ]
    found, y = [START[0]], [*START, begin]
    for low, high in pairwise(times):
        y = solve_ivp(rates, (low, high), y, method="DOP853", rtol=1e-10, atol=1e-13).y[:, -1]
        found.append(y[0])
    return np.array(found)


@pytest.mark.parametrize("name", CASES)
def test_a_law_that_remembers_follows_its_own_equations(name):
    times = STEP * np.arange(200)
    wanted, found = integrated(name, CASES[name], times), marched(vector(name, CASES[name]), times)
    plain = marched(vector(name, (0.0, *CASES[name][1:])), times)[:, 0]
    size = np.max(np.abs(wanted))
    assert np.max(np.abs(plain - wanted)) > 0.03 * size, "the law matters here"
    assert np.max(np.abs(found[:, 0] - wanted)) < 2e-5 * size
    assert np.max(found[:, 1]) < 1e-6, "Newton has settled"


@pytest.mark.parametrize(
    "name",
    [pytest.param(n, marks=pytest.mark.slow) if n != "stiffness_drift" else n for n in CASES],
)
def test_derivatives_by_strength_and_shape_are_those_of_differences(name):
    times = STEP * np.arange(120)
    z, inputs = vector(name, CASES[name]), jnp.asarray(push(times)[:, None])
    own = np.flatnonzero(z[PLANT.slots["strengths"]]) + PLANT.slots["strengths"].start
    varied = [*own, PLANT.slots["start"].start, 0]
    directions = np.zeros((len(varied), PLANT.size))
    directions[np.arange(len(varied)), varied] = 1.0
    found = np.asarray(tangents(PLANT, 2, z, directions, inputs, jnp.asarray(STEP), CORNERS))
    for row, at in enumerate(varied):
        move = 1e-6 * abs(z[at])
        up, down = z.copy(), z.copy()
        up[at] += move
        down[at] -= move
        wanted = (marched(up, times, 2) - marched(down, times, 2))[:, 0] / (2 * move)
        np.testing.assert_allclose(found[row, :, 0], wanted, atol=1e-6 * np.max(np.abs(wanted)))


@pytest.mark.parametrize("name", CASES)
def test_a_motion_marched_in_two_parts_is_the_whole_motion(name):
    times = STEP * np.arange(101)
    z, inputs = jnp.asarray(vector(name, CASES[name])), jnp.asarray(push(times)[:, None])
    whole = state_history(PLANT, 2, z, inputs, STEP, CORNERS)
    first = state_history(PLANT, 2, z, inputs[:51], STEP, CORNERS)
    later = z.at[PLANT.slots["start"]].set(first[0][-1])
    second = state_history(PLANT, 2, later, inputs[50:], STEP, CORNERS, first[2])
    for part in (0, 1):
        joined = np.concatenate([first[part], second[part][1:]])
        np.testing.assert_allclose(joined, whole[part], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(second[2], whole[2], rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("name", LASTING)
def test_a_law_that_remembers_says_what_it_is(name):
    law = LASTING[name]
    own = name in CASES or name in ("extra_mode", "support_flexibility")  # with files of their own
    assert own and law.force is None and law.acts and law.memory is not None
    for shape in law.shapes:
        values = shape.trials(SCALES)
        assert all(value > 0 for value in values)
        assert unit_of(shape.dimension, False) in ("m", "s", "1/s", "1")
    assert all(len(shape.trials(SCALES)) >= 2 for shape in law.shapes[:1])
    shapes = [np.float64(shape.trials(SCALES)[0]) for shape in law.shapes]
    shapes = law.memory.shapes_at(shapes, 0.0, Place(STIFFNESS, DAMPING, 0.0, 0.0))
    begun = law.memory.begin(shapes, np.array([0.05, -0.02]), np.zeros(2))
    assert np.shape(begun) == (law.memory.size, 2)
    null = law.memory.force(0.0, shapes, begun, np.array([0.05, -0.02]), np.zeros(2))
    np.testing.assert_array_equal(null, 0.0)


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(n, marks=pytest.mark.slow) if n == "relaxation" else n
        for n, law in LASTING.items()
        if law.dissipative
    ],
)
def test_a_closed_path_never_gives_energy(name):
    law, rng = LASTING[name], np.random.default_rng(3)
    memory_law = law.memory
    assert memory_law is not None
    spent = []
    for _ in range(20):
        shapes = [np.float64(shape.trials(SCALES)[1] * rng.uniform(0.3, 3)) for shape in law.shapes]
        waves = rng.normal(size=3) * 0.05
        phase = np.linspace(0, 2 * np.pi, 120)
        path = np.sin(np.outer(phase, [1, 2, 3]) + waves) @ waves
        memory = memory_law.begin(shapes, path[:1] * 0, path[:1] * 0)
        work = np.zeros(3)
        for lap in range(3):  # the first laps still settle
            for now, then in pairwise(path):
                before, after = (np.array([now]), 0), (np.array([then]), 0)
                old = memory_law.force(1.0, shapes, memory, before[0], 0)
                memory = memory_law.advance(shapes, memory, before, after, 1e-3)
                new = memory_law.force(1.0, shapes, memory, after[0], 0)
                work[lap] += 0.5 * float(old[0] + new[0]) * (then - now)
        spent.append(work[2])
    # a short path may stay where slip is elastic: nothing is lost there, and nothing gained
    assert min(spent) > -1e-12 and sorted(spent)[5] > 1e-6


@pytest.mark.parametrize("name", CASES)
def test_a_motion_from_the_door_is_marched_over_its_pieces_as_one(name):
    """A hammer's blow cuts the motion into pieces of odd lengths; what is remembered goes on."""
    law, times = library()[name], STEP * np.arange(700)
    given = dict(zip([law.symbol, *(s.symbol for s in law.shapes)], CASES[name], strict=True))
    tables = ({"law": name, "place": "spring", "parameters": given},)
    blow = impact("cart", 3.0, 0.237, 0.091)
    found = respond(CHAIN, NUMBERS, blow, times, (Port("cart", "position"),), tables)
    assert found.status == CONVERGED

    memory = law.memory
    assert memory is not None
    shapes = CASES[name][1:]

    def rates(t, y, push):
        x, v, s = y
        force = memory.force(CASES[name][0], shapes, [s], x, v)
        rate = {"hysteresis": lambda: (v - 0.5 * (abs(v) * s + v * abs(s))) / shapes[0],
                "slip": lambda: v / shapes[0] if abs(s) < 1 or s * v < 0 else 0.0,
                "relaxation": lambda: (x - s) / shapes[0],
                "stiffness_drift": lambda: 1.0}[name]()  # fmt: skip
        return [v, (push - STIFFNESS * x - DAMPING * v - force) / MASS, rate]

    y, wanted = np.zeros(3), []
    for begin, end, push in ((0.0, 0.237, 0.0), (0.237, 0.328, 3.0), (0.328, times[-1], 0.0)):
        inside = times[(times >= begin) & ((times < end) | (end == times[-1]))]
        run = solve_ivp(
            rates, (begin, end), y, "DOP853", np.union1d(inside, end), args=(push,), rtol=1e-10,
            atol=1e-13, max_step=0.01,
        )  # fmt: skip
        wanted.append(run.y[0][: len(inside)])
        y = run.y[:, -1]
    gap = found.samples[:, 0] - np.concatenate(wanted)
    assert np.max(np.abs(gap)) < 1e-4 * np.max(np.abs(found.samples))


@pytest.mark.parametrize("name", ["relaxation", "hysteresis"])
def test_after_a_blow_nothing_has_been_loaded_slowly(name):
    times, late = np.arange(300) * 1e-3, 25
    still, brief = jnp.zeros((len(times), 1)), jnp.asarray(1e-3)
    z = vector(name, CASES[name])
    z[PLANT.slots["start"]] = (0.0, 0.5)
    whole = np.asarray(simulate(PLANT, 8, z, still, brief, CORNERS))[:, 0]
    states = np.asarray(state_history(PLANT, 8, jnp.asarray(z), still, brief, CORNERS)[0])
    z[PLANT.slots["start"]] = states[late]
    slow = np.asarray(simulate(PLANT, 8, z, still[late:], brief, CORNERS))[:, 0]
    z[PLANT.slots["since"]] = late * 1e-3
    struck = np.asarray(simulate(PLANT, 8, z, still[late:], brief, CORNERS))[:, 0]
    size = np.abs(whole).max()
    assert struck == pytest.approx(whole[late:], abs=2e-3 * size)
    if name == "relaxation":  # a slow load would have let the dashpot follow
        assert np.abs(slow - whole[late:]).max() > 0.04 * size
