"""The bench against closed forms, independent integration and the contract's file formats."""

import json
import tomllib
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.lab import BENCHES, CLUB_CAUSES, LAWS, draw_case
from tests.lab.bodies import ROBO_V, SLEEVES, Element, Machine, fixed_collet, pinned_wrist
from tests.lab.demo import DEFAULT, make_demo
from tests.lab.motion import Law, hold_and_release, simulate
from tests.lab.noise import KINDS, draw_noise
from tests.lab.plants import draw_chain, draw_club
from tests.lab.trials import decay, draw_trials, run_trial

LABORATORY = Path(__file__).parent / "lab"


def single(stiffness: float = 100.0, damping: float = 0.0, mass: float = 1.0) -> Machine:
    return Machine(
        ("body",), np.array([mass]), (Element("spring", np.array([1.0]), stiffness, damping),)
    )


def free(machine: Machine, laws: tuple[Law, ...], start: list[float], count=4000, rate=1000.0):
    loads = np.zeros((count, len(machine.bodies)))
    return simulate(machine, laws, np.array(start), loads, rate)


def columns(sidecar: Path) -> np.ndarray:
    return np.genfromtxt(sidecar.with_suffix(".csv"), delimiter=",", names=True)


def values(table: np.ndarray) -> np.ndarray:
    return np.array([list(row) for row in table])


# Frequencies and damping ratios of the thesis's club, from the digest of the thesis: rigid grip,
# the 0 and 50 % sleeves of Table 4 (damped frequency), and the three lumped equivalents.
@pytest.mark.parametrize(
    ("stiffness", "damping", "tone", "ratio", "within"),
    [
        (500e3, 0.0, 3.959, 0.0065, 0.001),
        (290e3, 6000.0, 3.876, 0.040, 0.001),
        (130e3, 12000.0, 4.014, 0.081, 0.001),
        (*SLEEVES["0 %"], 3.64, 0.02, 0.02),
        (*SLEEVES["25 %"], 3.55, 0.08, 0.02),
        (*SLEEVES["50 %"], 3.08, 0.11, 0.02),
    ],
)
def test_club_has_the_frequencies_of_the_thesis(stiffness, damping, tone, ratio, within):
    machine = fixed_collet({**ROBO_V, "sleeve_stiffness": stiffness, "sleeve_damping": damping})
    tones, ratios = machine.modes()
    damped = tones[0] * np.sqrt(1 - ratios[0] ** 2)
    assert damped == pytest.approx(tone, rel=within)
    assert ratios[0] == pytest.approx(ratio, rel=0.03)


def test_stiff_wrist_is_the_fixed_collet():
    rigid = {"sleeve_stiffness": 500e3, "sleeve_damping": 0.0}
    club = {**ROBO_V, **rigid, "wrist_stiffness": 1e5, "wrist_damping": 2.0}
    assert pinned_wrist(club).modes()[0][0] == pytest.approx(3.956, abs=0.001)


def test_static_deflection_of_the_clubhead():
    machine = fixed_collet(ROBO_V)
    reach = ROBO_V["club_length"] - ROBO_V["grip_length"] / 2
    sleeve, spacing = ROBO_V["sleeve_stiffness"], ROBO_V["sleeve_spacing"]
    compliance = 1 / ROBO_V["shaft_stiffness"] + 1 / (4 * sleeve) + reach**2 / (sleeve * spacing**2)
    shape = machine.hang(machine.body("clubhead"), 0.1)
    held = -machine.forces(shape, 0 * shape)
    assert held[:2] == pytest.approx([0.0, 0.0], abs=1e-9)
    assert 0.1 / held[2] == pytest.approx(compliance, rel=1e-12)


@pytest.mark.parametrize("build", [fixed_collet, pinned_wrist])
def test_energy_is_kept_without_damping(build):
    still = {name: 0.0 for name in ROBO_V if name.endswith("damping")}
    machine = build({**ROBO_V, **still})
    size = len(machine.bodies)
    start = hold_and_release(machine, (), machine.body("clubhead"), 0.1)
    moved = free(machine, (), list(start), rate=2048.0)
    energy = machine.energy(moved.position, moved.velocity)
    assert np.ptp(energy) < 1e-9 * energy[0]
    assert moved.position.shape == (4000, size)


@pytest.mark.parametrize("seed", [3, 5])
def test_linear_motion_is_that_of_an_independent_integration(seed):
    rng = np.random.default_rng(seed)
    plant = replace(draw_chain(rng), count=300)
    trial = next(t for t in draw_trials(plant, rng, 3, 0) if t.test == "driven")
    machine, size = plant.machine(), len(plant.machine().bodies)
    ours = run_trial(plant, trial, machine)

    def rates(time, state):
        place = time * plant.rate
        low = min(int(place), plant.count - 2)
        load = trial.loads[low] + (place - low) * (trial.loads[low + 1] - trial.loads[low])
        force = machine.forces(state[:size], state[size:]) + load
        return np.concatenate([state[size:], force / machine.inertia])

    times = np.arange(plant.count) / plant.rate
    state, found = np.zeros(2 * size), [np.zeros(2 * size)]
    for begin, end in pairwise(times):  # the load bends at samples
        state = solve_ivp(rates, (begin, end), state, rtol=1e-10, atol=1e-14).y[:, -1]
        found.append(state)
    found = np.array(found)
    assert np.abs(ours.position - found[:, :size]).max() < 1e-7 * np.abs(found[:, :size]).max()
    assert np.abs(ours.velocity - found[:, size:]).max() < 1e-7 * np.abs(found[:, size:]).max()


@pytest.mark.parametrize("bench", BENCHES)
def test_three_roads_to_one_motion(bench):
    rng = np.random.default_rng(4)
    plant = draw_chain(rng) if bench == "chain" else draw_club(rng, bench)
    machine = plant.machine()
    for trial in draw_trials(plant, rng, 3, 0):
        plain = run_trial(plant, trial, machine)
        for law in (Law("cubic_stiffness", 0, 1e-30), Law("asymmetric_stiffness", 0, 1e-9)):
            other = run_trial(plant, trial, machine, (law,))
            for mine, theirs in (
                (plain.position, other.position),
                (plain.velocity, other.velocity),
            ):
                assert np.all(np.abs(mine - theirs).max(axis=0) < 3e-6 * np.abs(mine).max(axis=0))


def test_dry_friction_takes_its_step_each_half_cycle_and_then_sticks():
    stiffness, friction = 100.0, 1.0
    moved = free(single(stiffness), (Law("coulomb_friction", 0, friction),), [0.105, 0.0])
    half = round(1000 * np.pi / np.sqrt(stiffness))
    for turn in range(5):
        expected = (-1) ** turn * (0.105 - 2 * turn * friction / stiffness)
        assert moved.position[turn * half, 0] == pytest.approx(expected, abs=1e-5)
    rest = moved.position[-1000:, 0]
    assert np.ptp(rest) == 0.0
    assert abs(rest[0]) * stiffness < friction
    assert np.all(moved.acceleration[-1000:] == 0.0)


def test_friction_holds_what_is_below_it():
    moved = free(single(), (Law("coulomb_friction", 0, 1.0),), [0.009, 0.0])
    assert np.ptp(moved.position) == 0.0


def test_friction_of_two_sets_agrees_with_a_fine_smoothing():
    machine = fixed_collet(ROBO_V)
    laws = tuple(Law("coulomb_friction", index, 10.0) for index in (0, 1))
    start = hold_and_release(machine, laws, 2, 0.1)
    ours = free(machine, laws, list(start), count=600, rate=2048.0)

    def rates(_, state):
        force = machine.forces(state[:3], state[3:])
        for index in (0, 1):
            item = machine.elements[index]
            force -= item.count * 10.0 * np.tanh(item.stretch(state[3:]) / 2e-5) * item.ends
        return np.concatenate([state[3:], force / machine.inertia])

    times = np.arange(600) / 2048.0
    found = solve_ivp(
        rates, (0, times[-1]), start, method="Radau", t_eval=times, rtol=1e-7, atol=1e-10
    )
    assert np.abs(ours.position[:, 2] - found.y[2]).max() < 2e-3 * 0.1


def test_play_lengthens_the_period_by_its_crossing():
    stiffness, gap, reach = 100.0, 0.01, 0.05
    moved = free(single(stiffness), (Law("clearance", 0, gap),), [reach + gap, 0.0])
    beat = np.sqrt(stiffness)
    period = 2 * np.pi / beat + 4 * gap / (beat * reach)
    times = np.arange(4000) / 1000.0
    falls = np.flatnonzero((moved.position[:-1, 0] > 0) & (moved.position[1:, 0] <= 0))
    crossings = (
        times[falls]
        + moved.position[falls, 0]
        / (moved.position[falls, 0] - moved.position[falls + 1, 0])
        / 1000.0
    )
    assert np.diff(crossings) == pytest.approx(period, rel=1e-6)
    carried = np.maximum(np.abs(moved.position) - gap, 0)
    energy = 0.5 * moved.velocity**2 + 0.5 * stiffness * carried**2
    assert np.ptp(energy) < 1e-9 * energy[0, 0]


def test_two_slopes_give_two_half_periods():
    moved = free(single(100.0), (Law("asymmetric_stiffness", 0, 30.0),), [0.05, 0.0])
    crossings = np.flatnonzero(np.diff(np.sign(moved.position[:, 0]))) / 1000.0
    halves = np.diff(crossings)
    assert halves[1::2] == pytest.approx(np.pi / np.sqrt(130.0), abs=2e-3)
    assert halves[::2] == pytest.approx(np.pi / np.sqrt(70.0), abs=2e-3)


def test_cubic_spring_and_pendulum_keep_their_energy():
    moved = free(single(100.0), (Law("cubic_stiffness", 0, 2e4),), [0.05, 0.0])
    position = moved.position[:, 0]
    energy = 0.5 * moved.velocity[:, 0] ** 2 + 50 * position**2 + 5e3 * position**4
    assert np.ptp(energy) < 1e-6 * energy[0]
    swing = free(single(100.0), (Law("gravity", 0, 100.0),), [2.0, 0.0])
    energy = 0.5 * swing.velocity[:, 0] ** 2 - 100 * np.cos(swing.position[:, 0])
    assert np.ptp(energy) < 1e-6 * 200


def test_laws_that_cannot_be_mixed_are_refused():
    with pytest.raises(ValueError, match="mix"):
        free(single(), (Law("clearance", 0, 0.1), Law("gravity", 0, 1.0)), [0.1, 0.0])


@pytest.mark.parametrize("kind", KINDS)
def test_noise_has_the_spread_it_states(kind):
    rng = np.random.default_rng(1)
    signal = np.sin(np.arange(40000) / 50)
    law = {"ar1": {"rho": 0.9}, "ar2": {"phi_1": 1.0, "phi_2": -0.5}}.get(kind)
    noise = draw_noise(kind, 0.03, signal, rng, law)
    expected = 0.03 * np.sqrt(1 + 0.01 * (100 + 4 / 3)) if kind == "outliers" else 0.03
    assert noise.std() == pytest.approx(expected, rel=0.06)
    lag = [np.corrcoef(noise[:-k], noise[k:])[0, 1] for k in (1, 2)]
    first = {"ar1": 0.9, "ar2": 1.0 / 1.5}.get(kind, 0.0)
    second = {"ar1": 0.81, "ar2": 1.0 / 1.5 - 0.5}.get(kind, 0.0)
    assert lag == pytest.approx([first, second], abs=0.03)
    if kind == "heavy_tailed":
        assert np.mean(noise**4) / np.mean(noise**2) ** 2 > 5
    if kind == "heteroscedastic":
        calm, loud = np.abs(signal) < 0.3, np.abs(signal) > 0.9
        assert noise[loud].std() > 1.5 * noise[calm].std()
    if kind == "quantised":
        assert len(np.unique(np.round(signal + noise, 9))) < 50


@pytest.mark.parametrize("bench", BENCHES)
def test_a_case_is_its_seed(bench, tmp_path):
    one, two = (draw_case(tmp_path / name, 11, bench, noise="ar1") for name in "ab")
    other = draw_case(tmp_path / "c", 12, bench, noise="ar1")
    for mine, theirs in zip(one.train + one.held_out, two.train + two.held_out, strict=True):
        assert mine.read_bytes() == theirs.read_bytes()
        assert mine.with_suffix(".csv").read_bytes() == theirs.with_suffix(".csv").read_bytes()
    assert one.rig.read_bytes() == two.rig.read_bytes()
    assert one.rig.read_bytes() != other.rig.read_bytes()


@pytest.mark.parametrize("law", LAWS)
def test_each_effect_of_a_chain_changes_the_records(law, tmp_path):
    case = draw_case(tmp_path, 21, "chain", law)
    seen = case.truth["visibility"]
    assert case.truth["law"] == law
    assert seen["norm"] > 3
    assert 0 < seen["projected_norm"] <= seen["norm"] * (1 + 1e-9)
    assert json.loads((tmp_path / "sealed" / "truth.json").read_text()) == case.truth


@pytest.mark.parametrize(("law", "place"), CLUB_CAUSES["pinned_wrist"])
def test_each_effect_of_the_club_changes_the_records(law, place, tmp_path):
    case = draw_case(tmp_path, 22, "pinned_wrist", law, place, records=2, held_out=0)
    assert case.truth["visibility"]["norm"] > 1
    assert case.truth["place"] == place


def test_a_stronger_effect_is_seen_better(tmp_path):
    weak, strong = (
        draw_case(tmp_path / str(size), 5, "chain", "clearance", strength=size).truth["visibility"]
        for size in (0.01, 0.1)
    )
    assert strong["projected_norm"] > 3 * weak["projected_norm"]


def test_an_unknown_effect_or_place_is_refused(tmp_path):
    with pytest.raises(ValueError, match="expected one of"):
        draw_case(tmp_path, 1, "fixed_collet", "coulomb_friction", "wrist")
    with pytest.raises(ValueError, match="expected one of"):
        draw_case(tmp_path, 1, "bridge")


@pytest.mark.parametrize("bench", BENCHES)
@pytest.mark.parametrize("seed", [31, 32, 33])
def test_files_obey_the_contract(bench, seed, tmp_path):
    case = draw_case(tmp_path, seed, bench)
    rig = tomllib.loads(case.rig.read_text())
    assert rig["rig"]["kind"] == ("chain" if bench == "chain" else "robot")
    assert len(case.train) == 3
    assert len(case.held_out) == 1
    for sidecar in case.train + case.held_out:
        told, table = tomllib.loads(sidecar.read_text()), columns(sidecar)
        record = told["record"]
        assert record["test"] in ("decay", "impact", "driven")
        assert record["split"] == ("train" if sidecar in case.train else "held_out")
        assert (sidecar.parent / record["rig"]) == case.rig
        steps = np.diff(table["time"]) * record["sample_rate"]
        assert steps == pytest.approx(1.0, abs=1e-5)
        assert set(table.dtype.names or ()) == {
            item["column"] for item in told["channels"].values()
        }
        assert np.all(np.isfinite(values(table)))
        for name, channel in told["channels"].items():
            if name != "time":
                assert channel["role"] in ("response", "input")
                assert {"unit", "quantity", "place"} <= set(channel)
        level = {item["name"]: item["noise_std"] for item in case.truth["records"]}[sidecar.stem]
        assert all(np.std(table[name]) > 5 * std for name, std in level.items())


def test_the_decibels_are_what_is_asked(tmp_path):
    quiet, loud = (draw_case(tmp_path / str(db), 8, "chain", snr_db=db) for db in (120.0, 20.0))
    name = next(iter(loud.truth["records"][0]["noise_std"]))
    for first, second, row in zip(quiet.train, loud.train, loud.truth["records"], strict=False):
        noise = columns(second)[name] - columns(first)[name]
        assert noise.std() == pytest.approx(row["noise_std"][name], rel=0.1)


def test_a_throw_and_a_hold_start_as_told():
    plant = draw_chain(np.random.default_rng(2), masses=2)
    held = run_trial(plant, decay(plant, 0.01, first=50), plant.machine())
    head = plant.machine().body(plant.head)
    assert np.all(held.position[:51, head] == held.position[50, head])
    assert held.position[50, head] == pytest.approx(0.01)
    assert np.ptp(held.position[50:, head]) > 0.01


def test_the_bench_shares_nothing_with_the_package():
    for path in [*LABORATORY.glob("*.py"), Path(__file__)]:
        lines = path.read_text().splitlines()
        met = [line for line in lines if line.startswith(("import", "from")) and "supple" in line]
        assert not met, path


def test_the_demo_records_are_made_again(tmp_path):
    case = make_demo(tmp_path)
    made = sorted(path.name for path in tmp_path.iterdir())
    kept = sorted(path.name for path in DEFAULT.iterdir())
    assert kept == sorted([*made, "RECIPE.md"])
    for sidecar in case.train + case.held_out:
        new, old = values(columns(sidecar)), values(columns(DEFAULT / sidecar.name))
        assert np.all(np.abs(new - old) <= 1.01e-5 * np.abs(old))  # one unit of the last digit
        assert sidecar.read_text() == (DEFAULT / sidecar.name).read_text()
    assert case.rig.read_text() == (DEFAULT / "rig.toml").read_text()
    assert case.truth["visibility"]["projected_norm"] > 100
