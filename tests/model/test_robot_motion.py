"""The motion of each model against the thesis's own rows, mended and integrated by scipy."""

from itertools import pairwise

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from supple.model.drives import Drive, impact, release, torque
from supple.model.exact import exact_outputs, plan_of
from supple.model.linear import Port
from supple.model.motion import respond, respond_batch
from supple.model.plant import Plant, numbers_vector
from supple.model.prescribed import Prescribed, shaped, through
from supple.model.respond import simulate
from supple.model.robot import MODELS, PRESETS, Robot
from tests.model.test_robot import printed_club
from tests.reference.thesis_models import equation_36, equations_8_to_10

ROBO_V = PRESETS["robo_v"]
SOFT = ROBO_V | {"sleeve_stiffness": 400e3, "sleeve_damping": 5.0}  # line 1176
TIMES = np.arange(110) / 256
HEAD = Port("clubhead", "acceleration", "collet")
SEEN = (HEAD, Port("clubhead", "acceleration"), Port("wrist", "angular_velocity"))

KNOTS = np.array([0.0, 0.0613, 0.13, 0.201, 0.3037, 0.44])
ARM = -1.0 + 2.0 * (KNOTS / 0.44) ** 2 * (3 - 2 * KNOTS / 0.44)
WRIST = -0.7 + 1.3 * np.sin(3 * KNOTS)
ARM_JOINT = through("arm", KNOTS.tolist(), ARM.tolist(), 0.44)
WRIST_JOINT = through("wrist", KNOTS.tolist(), WRIST.tolist(), 0.44)
BLOW = impact("clubhead", -300.0, 0.1013, 0.02)
DRIVES = {
    "fixed_collet": BLOW,
    "driven_collet": torque("wrist", (0.0, 0.1501, 0.3), (3.0, -3.0, 0.0)),
    "pinned_wrist": BLOW,
    "driven_wrist": Drive(joints=(WRIST_JOINT,)),
    "passive_wrist": Drive(joints=(ARM_JOINT,)),
    "driven_arm": Drive(BLOW.port, BLOW.edges, BLOW.levels, joints=(ARM_JOINT, WRIST_JOINT)),
}
REPEATED = ("fixed_collet", "pinned_wrist", "driven_wrist", "passive_wrist")
"""Their forces, arm and wrist also act, all at once, in the driven arm; the quick tests do that."""


def newton_euler(model: str, p: dict[str, float]):
    """M, C, K, columns of (force, torque) and of (theta_a'', drive', drive), rows as printed."""
    t = printed_club(p)
    if model == "fixed_collet":  # x_G, x_cl, theta_G
        none = np.zeros(3)
        return *equations_8_to_10(t), (np.array([0.0, 1.0, 0.0]), none), np.zeros((3, 3))
    mass, damping, stiffness, force = equation_36(t)
    moved = np.zeros((4, 3))
    if model == "driven_collet":
        damping[0, 0] = stiffness[0, 0] = 0.0
    elif model != "pinned_wrist":
        moved[0, 1:] = t.c_w, t.k_w
    if model in ("passive_wrist", "driven_arm"):
        moved[:, 0] = -t.l_arm * np.array([t.m_col * t.l_col, 0.0, t.m_G, t.m_cl])
    return mass, damping, stiffness, (force, np.eye(4)[0]), moved


def reference(model: str, p: dict[str, float], drive: Drive) -> tuple[np.ndarray, np.ndarray]:
    """States and accelerations of the coordinates in our order, by solve_ivp."""
    mass, damping, stiffness, pushes, moved = newton_euler(model, p)
    n = len(mass)
    arm = CubicSpline(KNOTS, ARM)
    curves = {"arm": [arm], "wrist": [CubicSpline(KNOTS, WRIST)]}
    angles = [curves[joint.joint][0] for joint in drive.joints]
    push = pushes[0 if drive.port and drive.port.place == "clubhead" else 1]

    def bend(t: float, x: np.ndarray, level: float) -> np.ndarray:
        told = [arm(t, 2) if "arm" in [j.joint for j in drive.joints] else 0.0]
        told += [sum(float(angle(t, order)) for angle in angles) for order in (1, 0)]
        right = push * level + moved @ told - stiffness @ x[:n] - damping @ x[n:]
        return np.linalg.solve(mass, right)

    def slope(t: float, x: np.ndarray, level: float) -> np.ndarray:
        return np.concatenate([x[n:], bend(t, x, level)])

    x = np.zeros(2 * n)
    if angles:
        x[0], x[n] = (sum(float(angle(0.0, order)) for angle in angles) for order in (0, 1))
    inner = [*TIMES, *drive.edges, *(KNOTS if angles else ())]
    knots = sorted({each for each in inner if each <= TIMES[-1]})
    states, bends = np.zeros((len(TIMES), 2 * n)), np.zeros((len(TIMES), n))
    for begin, end in pairwise([*knots, TIMES[-1]]):
        level = drive.level(np.array([begin]))[0]
        if begin in TIMES:
            row = int(np.searchsorted(TIMES, begin))
            states[row], bends[row] = x, bend(begin, x, level)
        # ends on samples: what is interpolated inside a step has fewer digits
        options = {"rtol": 1e-13, "atol": 1e-18, "args": (level,)}
        x = solve_ivp(slope, (begin, end), x, "DOP853", **options).y[:, -1]
    order = [0, 2, 1] if n == 3 else [0, 1, 2, 3]
    whole = np.array([*order, *(n + i for i in order)])
    return states[:, whole], bends[:, order]


def gap(found: np.ndarray, wanted: np.ndarray) -> float:
    size = np.max(np.abs(wanted), axis=0)
    return float(np.max(np.abs(found - wanted) / np.where(size > 0, size, 1.0)))


@pytest.mark.parametrize(
    "model", [pytest.param(m, marks=pytest.mark.slow) if m in REPEATED else m for m in MODELS]
)
def test_each_model_moves_as_the_mended_rows_of_the_thesis(model):
    motion = respond(Robot(model), SOFT, DRIVES[model], TIMES, (HEAD,))
    states, bends = reference(model, SOFT, DRIVES[model])
    found = np.concatenate([motion.positions, motion.velocities], axis=1)
    assert np.max(np.abs(states)) > 0.05, "it moves"
    assert gap(found, states) < 1e-9
    assert gap(motion.accelerations, bends) < 5e-8  # differences of large forces on a light grip
    np.testing.assert_array_equal(motion.samples[:, 0], motion.accelerations[:, -1])
    assert motion.status == "converged" and motion.error == 0.0


def test_a_swing_of_a_stiff_sleeve_keeps_its_digits_beside_its_large_angles():
    """Turned half a circle further, nothing but the angles changes: equations know differences."""
    joints = ARM_JOINT, WRIST_JOINT
    far = through("arm", KNOTS.tolist(), (ARM + np.pi).tolist(), 0.44), WRIST_JOINT
    near_, far_ = (
        respond(Robot("driven_arm"), ROBO_V, Drive(joints=j), TIMES, (HEAD,)) for j in (joints, far)
    )
    assert gap(far_.positions[:, 1:], near_.positions[:, 1:]) < 1e-9
    np.testing.assert_allclose(far_.positions[:, 0], near_.positions[:, 0] + np.pi, atol=1e-11)
    assert gap(far_.samples, near_.samples) < 1e-7


@pytest.mark.slow
def test_a_leap_of_the_wrist_is_the_limit_of_a_fast_turn():
    model, p, found = "driven_wrist", SOFT | {"wrist_damping": 2.0}, []
    for width in (1e-3, 1e-4, 1e-5):
        ramp = through("wrist", [0.1 - width, 0.1, 0.1 + width], [0.0, 0.15, 0.3], 0.44)
        joint = Drive(joints=(ramp,))
        found.append(respond(Robot(model), p, joint, TIMES).positions)
    leap = Drive(joints=(shaped("wrist", "square", 0.3, 9.0, 0.1, 0.44, 0.44),))
    limit = respond(Robot(model), p, leap, TIMES).positions
    errors = [gap(each[40:], limit[40:]) for each in found]
    assert errors[0] > errors[1] > errors[2] and errors[2] < 2e-4


@pytest.mark.slow
def test_a_sine_of_the_wrist_is_what_a_dense_profile_of_it_gives():
    wave = shaped("wrist", "sine", 0.3, 0.2, 0.05, 0.25, 0.44)
    dense = np.linspace(0.05, 0.25, 801)
    profile = through("wrist", dense.tolist(), (0.3 * np.sin((dense - 0.05) * 10 * np.pi)).tolist(),
                      0.44)  # fmt: skip
    both = [respond(Robot("driven_wrist"), ROBO_V, Drive(joints=(j,)), TIMES, SEEN[:1])
            for j in (wave, profile)]  # fmt: skip
    assert gap(both[1].positions, both[0].positions) < 1e-8


@pytest.mark.slow
def test_many_designs_on_an_arm_are_each_as_alone():
    wrist = np.array([100.0, 300.0, 900.0])
    table = ROBO_V | {"wrist_stiffness": wrist}
    found = respond_batch(Robot("driven_arm"), table, DRIVES["driven_arm"], TIMES, SEEN)
    for index, k in enumerate(wrist):
        alone = ROBO_V | {"wrist_stiffness": k}
        motion = respond(Robot("driven_arm"), alone, DRIVES["driven_arm"], TIMES, SEEN)
        assert gap(found[index], motion.samples) < 1e-10


def test_a_release_on_a_still_arm_is_that_of_a_pinned_wrist():
    hold = release("clubhead", 0.15, "collet")
    pinned = respond(Robot("pinned_wrist"), ROBO_V, hold, TIMES).positions
    for model in ("driven_wrist", "driven_arm"):
        assert gap(respond(Robot(model), ROBO_V, hold, TIMES).positions, pinned) < 1e-12
    with pytest.raises(ValueError, match="a stiffness is zero"):
        respond(Robot("driven_collet"), ROBO_V, hold, TIMES)


FRICTION = {"law": "coulomb_friction", "place": "wrist", "parameters": {"torque": 0.0}}


@pytest.mark.parametrize(
    "model", ["driven_collet", pytest.param("driven_arm", marks=pytest.mark.slow)]
)
def test_a_law_at_its_null_leaves_every_model_as_it_was(model):
    """The implicit march, cut at every knot that is no sample, against the exact motion."""
    drive = DRIVES[model]
    bare = respond(Robot(model), SOFT, drive, TIMES, SEEN)
    lawful = respond(Robot(model), SOFT, drive, TIMES, SEEN, [FRICTION])
    assert lawful.status == "converged"
    assert gap(lawful.positions, bare.positions) < 1e-9
    assert gap(lawful.velocities, bare.velocities) < 1e-9
    assert gap(lawful.samples, bare.samples) < 1e-7


@pytest.mark.slow
def test_friction_holds_a_driven_wrist_back():
    law = [FRICTION | {"parameters": {"torque": 20.0, "rate_width": 0.05}}]
    drive, times = DRIVES["driven_wrist"], np.arange(220) / 512
    bare = respond(Robot("driven_wrist"), SOFT, drive, times)
    lawful = respond(Robot("driven_wrist"), SOFT, drive, times, (), law)
    rate = WRIST_JOINT.at(times)[:, 1]
    slip = [np.sqrt(np.mean((m.velocities[:, 0] - rate) ** 2)) for m in (bare, lawful)]
    assert lawful.status == "converged" and slip[1] < 0.9 * slip[0], "the wrist slips less"
    square = Drive(joints=(shaped("wrist", "square", 0.3, 0.2, 0.0, 0.44, 0.44),))
    with pytest.raises(ValueError, match=r"without leaps .* Mend: "):
        respond(Robot("driven_wrist"), SOFT, square, times, (), law)


QUANTITIES = ("angle", "angular_velocity", "angular_acceleration")


def sampled(model: str, order: int, drive: Drive, step: float, sensors=SEEN) -> np.ndarray:
    """The same swing from sampled records of its joints, as a fit simulates it."""
    mechanism = Robot(model)
    ports = tuple(Port(joint.joint, QUANTITIES[order]) for joint in drive.joints)
    plant = Plant(mechanism, ports, sensors)
    times = np.arange(0.0, 0.4, step)
    inputs = np.stack([joint.at(times)[:, order] for joint in drive.joints], axis=1)
    z = numbers_vector(plant, ROBO_V)
    for joint, along in zip(drive.joints, mechanism.carried):
        if order == 2:  # neither an angle nor a velocity is told
            start = z[plant.slots["start"]]
            start[:8] += np.outer(joint.begin, along).ravel()
            start[8 + 2 * drive.joints.index(joint) :][:2] += joint.begin
    widths = np.zeros((0, 2))
    return np.asarray(simulate(plant, 1, z, jnp.asarray(inputs), jnp.asarray(step), widths))[:, :-1]


@pytest.mark.parametrize(
    ("model", "order"),
    [
        ("driven_arm", 0),
        *(pytest.param("driven_arm", order, marks=pytest.mark.slow) for order in (1, 2)),
        *(pytest.param("driven_wrist", order, marks=pytest.mark.slow) for order in range(3)),
    ],
)
def test_sampled_angles_rates_and_accelerations_give_the_same_swing(model, order):
    """A spline through sampled angles is the swing itself; so are its sampled accelerations."""
    half, steep = 0.2, 60.0  # s, rad/s^3
    then = (steep * half**3 / 6, steep * half**2 / 2, steep * half, -steep)
    joints = tuple(
        Prescribed(
            joint,
            edges=(0.0, half),
            pieces=(
                (0.0, 0.0, 0.0, s * steep),
                (s * then[0], s * then[1], s * then[2], s * then[3]),
            ),
        )
        for joint, s in (("arm", 1.0), ("wrist", -0.6))
        if joint in Robot(model).grounds
    )
    drive = Drive(joints=joints)
    errors = []
    for rate in (1000, 2000) if order == 1 else (1000,):
        times = np.arange(0.0, 0.4, 1 / rate)
        wanted = respond(Robot(model), ROBO_V, drive, times, SEEN).samples
        errors.append(gap(sampled(model, order, drive, 1 / rate), wanted))
    if order == 1:  # a spline through the rates rounds the jump of the acceleration's slope
        assert errors[0] < 1e-2 and errors[1] < errors[0] / 1.6
    else:
        assert errors[0] < 5e-9


@pytest.mark.slow
def test_a_constant_acceleration_of_the_arm_is_exact_from_its_samples():
    """A spline knows a line and a parabola, whatever the sleeve does."""
    times = np.linspace(0.0, 0.44, 5)
    joint = through("arm", times.tolist(), (2.0 * times**2).tolist(), 0.44)
    for order in range(3):
        found = sampled("passive_wrist", order, Drive(joints=(joint,)), 1e-3)
        at = np.arange(0.0, 0.4, 1e-3)
        wanted = respond(Robot("passive_wrist"), ROBO_V, Drive(joints=(joint,)), at, SEEN).samples
        assert gap(found, wanted) < 1e-9


def test_whole_outputs_hold_the_joints_as_states():
    drive = DRIVES["driven_arm"]
    plan = plan_of(Robot("driven_arm"), drive, (), whole=True)
    table = {name: np.array([value]) for name, value in ROBO_V.items()}
    states = exact_outputs(plan, table, drive, TIMES)[0]
    assert states.shape == (len(TIMES), 8 + 4 + 4)
    for index, joint in enumerate(drive.joints):
        own = states[:, 8 + 2 * index : 10 + 2 * index]
        np.testing.assert_allclose(own, joint.at(TIMES)[:, :2], atol=1e-11)


def test_a_drive_that_jumps_at_nearly_every_sample_moves_as_on_a_finer_clock():
    """Dense jumps are carried in short blocks, others in long ones: two roads to one motion."""
    points = np.linspace(0.0, 0.8, 161)
    angle = through("wrist", points.tolist(), np.sin(7 * points).tolist(), 0.8)
    drive = Drive(BLOW.port, BLOW.edges, BLOW.levels, joints=(angle,))
    coarse, fine = np.arange(401) / 400, np.arange(16 * 400 + 1) / 6400
    told = [
        np.asarray(respond(Robot("driven_wrist"), SOFT, drive, times, SEEN).samples)
        for times in (coarse, fine)
    ]
    size = np.abs(told[1]).max(axis=0)
    assert np.all(np.abs(told[0] - told[1][::16]) < 1e-9 * size)
