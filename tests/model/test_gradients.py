"""Gradients of every public function that has one, against central differences."""

import ast
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from supple.model import (
    campbell,
    energies,
    planar,
    planar_march,
    planar_release,
    radau,
    shaft,
)
from supple.model.acting import space_of
from supple.model.balance import held_force
from supple.model.delay import shift
from supple.model.drives import Drive, Hold, equilibrium, hold_rows, impact, release, wave
from supple.model.exact import plan_of, traced_outputs
from supple.model.extended import Acting as Placed
from supple.model.lagrange import Acting, bent_shaft, trace
from supple.model.law import Place, library
from supple.model.linear import Port, discretize, make_step, state_space
from supple.model.plant import Plant, numbers_vector
from supple.model.prescribed import through
from supple.model.respond import force_responses, forced_motion, law_geometry, simulate
from supple.model.ringdown import after_impulse, after_release, energy, free_samples, transition
from supple.model.robot import PRESETS, Robot
from supple.model.score import closed_rms, log_decrement, modal_decrement, peak, rms, settling
from supple.model.sensors import loaded
from supple.model.swing import signals_of
from supple.model.told import accelerated, second_derivatives

NUMBERS = PRESETS["robo_v_sleeve_50"]
VARIED = ("wrist_stiffness", "wrist_damping", "shaft_stiffness", "clubhead_mass", "grip_length")
AT = np.array([NUMBERS[name] for name in VARIED])
HEAD = Port("clubhead", "acceleration", "collet")
TIMES = np.arange(257) / 512.0
RNG = np.random.default_rng(11)
Q, V, A = (jnp.asarray(RNG.normal(size=4) * [0.5, 0.002, 0.02, 0.05] * k) for k in (1, 10, 200))
D, D_RATE = jnp.asarray([0.3, -0.2]), jnp.asarray([2.0, 1.0])


def robot(model: str) -> Robot:
    return Robot(model, tuple(NUMBERS))


def table(x: Any) -> dict[str, Any]:
    return {**NUMBERS, **dict(zip(VARIED, x, strict=True))}


def flat(*parts: Any) -> jax.Array:
    return jnp.concatenate([jnp.ravel(jnp.asarray(part)) for part in jax.tree.leaves(parts)])


def states(function: Callable[..., Any]) -> tuple[Callable[[Any], Any], np.ndarray]:
    """A function of the numbers and of q, v, a, drive and its rate, in one vector."""
    at = np.concatenate([AT, Q, V, A, D, D_RATE])

    def whole(x: Any) -> Any:
        p, rest = table(x[:5]), x[5:]
        q, v, a, d, rate = (rest[i:j] for i, j in ((0, 4), (4, 8), (8, 12), (12, 14), (14, 16)))
        return flat(function(p, q, v, a, d, rate))

    return whole, at


def numbers(function: Callable[..., Any]) -> tuple[Callable[[Any], Any], np.ndarray]:
    return lambda x: flat(function(table(x))), AT


def response(drive: Drive, model: str) -> tuple[Callable[[Any], Any], np.ndarray]:
    plan = plan_of(robot(model), drive, (HEAD,), whole=True)

    def outputs(p: dict[str, Any]) -> Any:
        many = {name: jnp.reshape(jnp.asarray(value, float), 1) for name, value in p.items()}
        # the grip's own accelerations are no more than the difference of large forces
        return traced_outputs(plan, many, drive, TIMES)[0][0]

    return numbers(outputs)


ARM = through("arm", TIMES.tolist(), (np.sin(4 * TIMES) - 4 * TIMES).tolist(), 0.5)
FLICK = through("wrist", TIMES.tolist(), (0.3 * np.sin(9 * TIMES)).tolist(), 0.5)
BLOW, HELD = Port("clubhead", "force"), Hold("clubhead", "absolute", 0.1)


def free(p: dict[str, Any]) -> Any:
    return after_impulse(robot("pinned_wrist"), p, BLOW, -2.0, HEAD)


def scores(p: dict[str, Any]) -> Any:
    samples = free_samples(free(p), 1e-3, 4001)
    times = np.arange(4001) * 1e-3
    each = (rms, peak, settling, log_decrement)
    return [score(samples, times, (0.0, 3.9)) for score in each]


PLANT = Plant(
    robot("driven_arm"),
    (Port("arm", "angle"), Port("wrist", "angular_velocity"), BLOW),
    (HEAD, Port("wrist", "angle")),
    ("wrist",),
)
ON_SHAFT = replace(PLANT, law_places=("shaft",))
STEP = TIMES[1]
INPUTS = jnp.stack(
    [jnp.sin(4 * TIMES), jnp.cos(9 * TIMES), 3 * jnp.exp(-TIMES) * jnp.sin(7 * TIMES)], axis=1
)


def z_of(x: Any) -> Any:
    z = jnp.asarray(numbers_vector(PLANT, NUMBERS))
    at = [PLANT.mechanism.names.index(name) for name in VARIED]
    z = z.at[PLANT.slots["numbers"].start + np.array(at)].set(x[:5])
    low = PLANT.slots["strengths"].start
    names = [law.name for _, law, _ in PLANT.law_numbers]
    for value, name in zip(x[5:], ("coulomb_friction", "cubic_stiffness", "quadratic_damping")):
        z = z.at[low + names.index(name)].set(value)
    for index, (_, _, symbol) in enumerate(PLANT.law_numbers):
        z = z if not symbol else z.at[low + index].set(0.1)
    return z


WITH_LAWS = np.append(AT, [0.8, 900.0, 0.5])
WIDTHS = np.array([[0.01, 0.3]])


def with_laws(x: Any) -> Any:
    return simulate(PLANT, 4, z_of(x), INPUTS, jnp.asarray(STEP), WIDTHS)[:, :-1]


LIFT = signals_of(np.arange(121) / 1000.0, arm=6.0 * (np.arange(121) / 1000.0) ** 3 / 0.1)


def planar_swing(acting: tuple[Acting, ...], x: Any) -> Any:
    many = {name: jnp.reshape(jnp.asarray(value, float), 1) for name, value in table(x[:5]).items()}
    found = trace(
        "passive_wrist", acting, True, 12, many, jnp.asarray(LIFT.values[..., None]),
        jnp.asarray(LIFT.start[..., None]), jnp.zeros(8), 1e-3, 9.8, x[5:], WIDTHS[0],
    )  # fmt: skip
    return flat(*(found[i][0, -1] for i in (0, 1, 3, 4, 5)))


PLANAR_LAWS = (Acting("wrist", "coulomb_friction"), Acting("shaft", "cubic_stiffness"))
STEPS = 60
LEGS = planar_march.Legs(
    jnp.full(STEPS, 1e-3),
    jnp.asarray(RNG.normal(size=(1, 9))[:, :8, None])
    * jnp.ones((STEPS, 8, 4))
    * jnp.asarray([0.1, 0.1, 1.0, 1.0, 20.0, 3.0, 5.0, 1.0])[:, None],
    jnp.zeros((STEPS, 2)).at[0].set(jnp.array([0.3, 0.02])).at[30].set(jnp.array([0.0, -0.02])),
)


def marched(x: Any) -> Any:
    acting = (Acting("wrist", "coulomb_friction"), Acting("sleeve", "relaxation"))
    plane = planar_march.Plane(
        table(x[:5]), 5.0, x[5:7], jnp.asarray([[1e-3, 0.3], [1e-3, 0.3]]), ((), (0.02,))
    )
    first = LEGS.signals[0, :, 0]
    course = planar_march.begin("driven_arm", acting, plane, Q, V, first)
    _, (q, v, a, _) = planar_march.legs("driven_arm", acting, plane, course, LEGS)
    return flat(q[-1], v[-1], a[-1])


def one_step(x: Any) -> Any:
    """A step of a pendulum with a mass of its own."""
    mass, k = jnp.diag(x[:2]), jnp.array([[3.0, -1.0], [-1.0, 2.0]]) * x[2]
    inverse = radau.iteration_matrix(mass, 0.1 * mass, k, 0.02)

    def imbalance(q: Any, v: Any, a: Any) -> Any:
        return mass @ (a + 0.1 * v) + k @ jnp.sin(q)

    guess = radau.continued(jnp.asarray([[1.0, 2.0, 3.0], [0.5, 0.4, 0.2]]) * x[2], 0.7)
    found = radau.one_step(
        imbalance, jnp.array([0.3, -0.2]) * x[0], jnp.array([1.0, 2.0]), guess, 0.02, inverse,
        jnp.ones(2),
    )  # fmt: skip
    free = radau.inverted(
        jnp.stack([jnp.stack([x[0], x[1]]), jnp.stack([-x[1], x[2]])])[:, :, None]
    )
    return flat(found[:3], inverse, free, radau.at_stages(x[:2], x[1:], guess, 0.02))


def bent_club(x: Any) -> Any:
    """Whatever the shaft tells, of its length, stiffness, bend, place of the head and motion."""
    lever, k, bend, across, tilt, *moves = x
    head = shaft.head_at(lever, across, tilt, shaft.bend_of(lever, across, tilt))
    rates = shaft.rates(head, moves[0], moves[1])
    return flat(
        shaft.force(lever, k, bend), shaft.energy(lever, k, bend), shaft.shortening(lever, bend),
        shaft.slope_at_head(lever, bend), head, bent_shaft(lever, across, tilt), rates,
        shaft.near_head(lever, across, tilt),
        shaft.head_moved(lever, head, tilt, (moves[0], moves[1], moves[2])),
        shaft.acceleration(head, rates[0], *moves[1:]),
    )  # fmt: skip


def plane_of(x: Any) -> planar_march.Plane:
    return planar_march.Plane(table(x[:5]), 5.0, jnp.zeros(0), jnp.zeros((0, 2)), ())


def at_rest(x: Any) -> Any:
    return planar_release._rest("passive_wrist", (), plane_of(x), jnp.asarray([0.8, -0.3]))


def held_displaced(x: Any) -> Any:
    hold = Hold("clubhead", "absolute", 1.0)
    return planar_release._released("pinned_wrist", (), plane_of(x), hold, 0.3)[0]


def held_law(x: Any) -> Any:
    here = Place(x[1], 1.0, 0.01, 0.3)
    names = ("cubic_stiffness", "coulomb_friction", "relaxation")
    laws = [Placed("wrist", library()[name], x[0], shapes=(0.02,)) for name in names]
    return flat([held_force(law, x[2], here) for law in laws])


CURVE = np.cumsum(RNG.normal(size=40))


def rows_of(p: dict[str, Any]) -> Any:
    return robot("driven_arm").rows(p)


def told(x: Any) -> Any:
    _, z, inputs = accelerated(PLANT.bare, _bare(x), INPUTS * x[0], jnp.asarray(STEP))
    return flat(z, inputs)


def _bare(x: Any) -> Any:
    z, own = z_of(jnp.concatenate([x, jnp.zeros(3)])), PLANT.slots["strengths"]
    return jnp.concatenate([z[: own.start], z[own.stop :]])


CASES: dict[str, tuple[Callable[[Any], Any], np.ndarray]] = {
    "kinetic_energy": states(lambda p, q, v, a, d, r: planar.kinetic_energy(p, q, v, d, r, jnp)),
    "weight_energy": states(lambda p, q, v, a, d, r: planar.weight_energy(p, q, d, 5.0, jnp)),
    "spring_energy": states(lambda p, q, v, a, d, r: planar.spring_energy(p, q, d, True)),
    "dissipation": states(lambda p, q, v, a, d, r: planar.dissipation(p, q, v, r, True)),
    "clubhead_velocity": states(
        lambda p, q, v, a, d, r: planar.clubhead_velocity(p, q, v, d, r, jnp)
    ),
    "inertia_forces": states(
        lambda p, q, v, a, d, r: planar.inertia_forces(
            p, q, v, a, planar.pivot_acceleration(p, (d[0], r[0], d[1]), 5.0, jnp),
            (jnp.cos(q[0]), jnp.sin(q[0])),
        )
    ),
    "pivot_acceleration": states(
        lambda p, q, v, a, d, r: planar.pivot_acceleration(p, (d[0], r[0], d[1]), 5.0, jnp)
    ),
    "foreshortening": states(
        lambda p, q, v, a, d, r: [
            planar.bend(p, q), planar.foreshortening(p, q), planar.most_bend(p),
            planar.head_rates(planar.head_of(p, q), v),
            [(one.stretch, one.rate, one.force) for one in planar.springs(p, q, v, d, r, True)],
            vars(planar.points_of(p)),
        ]
    ),
    "the shaft": (bent_club, np.array([0.965, 139.0, 0.3, 0.4, 0.15, 7.0, 3.0, 40.0, 90.0])),
    "rest under weight": (at_rest, AT),
    "held by a hand": (held_displaced, AT),
    "held laws": (held_law, np.array([900.0, 300.0, 0.05])),
    "a steady rotation": numbers(lambda p: campbell._linearised(False, p, 15.0, 0.6)[:4]),
    "loaded by sensors": numbers(lambda p: loaded(p, {"clubhead": 1e-3 * p["clubhead_mass"]})),
    "the space that is marched": (lambda x: flat(vars(space_of(PLANT, z_of(x)))), WITH_LAWS),
    "rows' energies": numbers(
        lambda p: [
            energies.kinetic_energy(rows_of(p), jnp.append(V, D)),
            energies.potential_energy(rows_of(p), jnp.append(Q, D)),
            energies.dissipation(rows_of(p), jnp.append(V, D)),
            energies.mass_matrix(rows_of(p)),
            energies.stiffness_matrix(rows_of(p)),
            energies.damping_matrix(rows_of(p)),
        ]
    ),
    "state_space": numbers(
        lambda p: vars(state_space(robot("driven_arm"), p, PLANT.marched, (HEAD,), ("wrist",)))
    ),
    "make_step": numbers(
        lambda p: vars(make_step(state_space(robot("pinned_wrist"), p, (BLOW,)), 0.01))
    ),
    "discretize": numbers(
        lambda p: discretize(
            state_space(robot("pinned_wrist"), p, (BLOW,)).a,
            state_space(robot("pinned_wrist"), p, (BLOW,)).b,
            0.01,
        )
    ),
    "transition": numbers(lambda p: transition(free(p).a, 0.3)),
    "hold_rows": numbers(lambda p: hold_rows(robot("pinned_wrist"), p, HELD)),
    "equilibrium": numbers(lambda p: equilibrium(robot("pinned_wrist"), p, HELD)),
    "after_impulse": numbers(lambda p: free_samples(free(p), 2e-3, 200)),
    "after_release": numbers(
        lambda p: free_samples(
            after_release(robot("pinned_wrist"), p, HELD, HEAD), 2e-3, 200
        )
    ),
    "energy": numbers(lambda p: [energy(free(p)), energy(free(p), 0.4)]),
    "closed_rms": numbers(lambda p: closed_rms(free(p), (0.1, 0.8))),
    "modal_decrement": numbers(lambda p: modal_decrement(free(p))),
    "sampled scores": numbers(scores),
    "response to a blow": response(impact("clubhead", -100.0, 0.011, 0.005), "pinned_wrist"),
    "response to a release": response(release("clubhead", 0.1), "fixed_collet"),
    "response to a wave": response(wave("wrist", "sine", 2.0, 0.1, 0.0, 0.4), "driven_collet"),
    "response to arm and wrist": response(Drive(joints=(ARM, FLICK)), "driven_arm"),
    "law_geometry": (lambda x: flat(law_geometry(ON_SHAFT, z_of(x))), WITH_LAWS),
    "force_responses": (
        lambda x: force_responses(
            PLANT, z_of(x), jnp.asarray(RNG_FORCES), jnp.asarray(STEP)
        ),
        WITH_LAWS,
    ),
    "forced_motion": (
        lambda x: flat(
            forced_motion(PLANT, z_of(x), jnp.asarray(RNG_FORCES), jnp.asarray(STEP))
        ),
        WITH_LAWS,
    ),
    "simulate with laws": (with_laws, WITH_LAWS),
    "planar swing": (partial(planar_swing, ()), AT),
    "planar swing with laws": (partial(planar_swing, PLANAR_LAWS), np.append(AT, [0.8, 4000.0])),
    "planar march with laws": (marched, np.append(AT, [0.8, 2000.0])),
    "radau": (one_step, np.array([1.2, 0.7, 30.0])),
    "second_derivatives": (
        lambda x: second_derivatives(jnp.asarray(CURVE) * x[0] + x[1] ** 3, x[2]),
        np.array([1.0, 2.0, 0.1]),
    ),
    "accelerated": (told, AT),
    "shift": (
        lambda x: shift(jnp.asarray(CURVE)[:, None] * x[:1], x[1:]),
        np.array([1.3, 2.4]),
    ),
}  # fmt: skip
RNG_FORCES = RNG.normal(size=(2, len(TIMES), 1))
SLOW = {
    *("rest under weight", "held by a hand", "a steady rotation"),
    *("simulate with laws", "planar swing", "planar swing with laws", "planar march with laws"),
    *("sampled scores", "response to a wave", "response to a blow", "discretize", "energy"),
}
STEPS_TRIED = (0.1, 1e-2, 3e-3, 1e-3, 1e-4, 2e-5)
"""Moves as shares of a number: wide ones for what is smooth, narrow ones where corners are near."""


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.slow) if n in SLOW else n for n in CASES]
)
def test_a_gradient_is_that_of_central_differences(name):
    function, at = CASES[name]
    quick, at = jax.jit(function), jnp.asarray(at)
    found = np.asarray(jax.jit(jax.jacfwd(function))(at)).reshape(-1, len(at))
    assert np.all(np.isfinite(found)) and np.any(found)
    for index, size in enumerate(np.abs(np.asarray(at))):

        def slope(h: float, index: int = index) -> np.ndarray:
            up, down = (np.ravel(quick(at.at[index].add(sign * h))) for sign in (1, -1))
            return (up - down) / (2 * h)

        worst = np.inf
        for part in STEPS_TRIED:
            wanted = (4 * slope(part * size) - slope(2 * part * size)) / 3  # Richardson
            # what is far smaller than the largest is told by that
            scale = np.maximum(np.abs(wanted), 0.01 * np.max(np.abs(wanted)))
            off = np.abs(found[:, index] - wanted)
            worst = min(worst, np.max(np.where(off > 0, off / np.maximum(scale, 1e-300), 0.0)))
        assert worst < 1e-6, (index, worst)


FILES = (
    *("energies", "planar", "linear", "drives", "exact", "ringdown", "score", "respond", "told"),
    *("delay", "radau", "lagrange", "planar_march", "slopes", "shaft", "balance", "march"),
    *("acting", "extended", "planar_release", "planar_sensors", "sensors", "campbell"),
)
WITHOUT = {
    "plans, ports and drives, which hold no traced number": {
        *("plan_of", "release", "impact", "torque", "wave", "drive_of", "drive_places"),
        *("moved_grounds", "plant_of", "check_balance"),
    },
    "numpy at the end of a traced function that is here": {
        *("exact_outputs", "state_history", "modes", "rest", "released", "modes_at", "campbell"),
    },
    "a balance iterated in numpy until it is settled: its forces are here": {"law_equilibrium"},
    "tables that are read, and sensors that are described": {
        *("acting_laws", "refusal", "stated", "law_places", "strengths", "widths"),
        *("plain_sensor", "accelerometer", "strain_gauge", "encoder", "with_laws", "carrier"),
        *("seen_ports",),
    },
    "numpy from end to end: what a record shows, rounded and cut off as a sensor does": {
        *("readings", "read", "planar_samples", "felt_accelerations", "track_of"),
    },
    "steps that are halved in numpy until their error is small: one step is here": {
        *("march", "carried_start"),
    },
    "derivatives themselves": {
        *("tangents", "still_tangents", "pushed_tangents", "mode_slopes", "critical_slopes"),
        *("step_matrices", "varied_motion"),
    },
    "whole numbers": {"cycles"},
    "inside the motions with laws that are here": {
        "acting_space",
        "begin",
        "begun",
        "driven",
        "interval_values",
        "inverse",
        "law_step",
        "linear_part",
        "march_rows",
        "offset_mask",
    },
    "inside the motions without laws that are here": {"linear_pushes", "march_linear"},
    "yes or no": {"is_zero", "is_varied", "rate_jumps"},
}


def test_no_public_function_is_left_out():
    """Of the files whose functions jax traces."""
    folder = Path(planar.__file__).parent
    mine = ast.walk(ast.parse(Path(__file__).read_text(encoding="utf-8")))
    used = {getattr(node, "id", getattr(node, "attr", "")) for node in mine}
    used |= set().union(*WITHOUT.values())
    for name in FILES:
        body = ast.parse((folder / f"{name}.py").read_text(encoding="utf-8")).body
        public = {n.name for n in body if isinstance(n, ast.FunctionDef) and n.name[0] != "_"}
        assert public <= used, f"{name}: {sorted(public - used)} have no gradient tested"
