"""Benches A and B against closed forms, energy, order of convergence, and their own twins."""

import json
import tomllib
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.lab import march as marching
from tests.lab.__main__ import main
from tests.lab.carries import REST, Carry, blank
from tests.lab.causes import (
    ALSO,
    CAUSES,
    PLACES,
    RANGE,
    WEAKEST,
    Hidden,
    draw_cause,
    lagged,
    possible,
)
from tests.lab.clubs import MODELS, as_lumped, clamped_check, draw_scattered_club
from tests.lab.finite import CLUB, STATIONS, clamped, finite_club, line
from tests.lab.gauges import Fault, faulty
from tests.lab.march import Loads, Start, exact, held_start, march
from tests.lab.runs import SUBSTEPS, carry_out, channels, draw_run
from tests.lab.sealed import draw_sealed, sampled
from tests.lab.structure import Springs, Structure

RATE = 2048.0
PHYSICS = {"linear_stiffness": 30.0, "linear_damping": 0.5, "cubic_stiffness": 4e3}
PHYSICS |= {"asymmetric_stiffness": 30.0, "quadratic_damping": 2.0, "clearance": 0.02}
PHYSICS |= {"coulomb_friction": 1.0, "slip": 2.0, "hysteresis": 40.0, "relaxation": 40.0}
PHYSICS |= {"stiffness_drift": 30.0}
OTHER = {"clearance": 100.0, "coulomb_friction": 3e4, "slip": 50.0, "hysteresis": 0.02}
OTHER |= {"relaxation": 0.05, "stiffness_drift": 2.0}


def single(stiffness: float = 100.0, damping: float = 0.0, mass: float = 1.0) -> Structure:
    """One mass on one spring, which is its place, its point and its sensor."""
    one = np.ones(1)
    spring = Springs(np.ones((1, 1)), stiffness * one, damping * one, one, 0 * one)
    m, c, k = (np.full((1, 1), value) for value in (mass, damping, stiffness))
    return Structure(m, c, k, {"spring": spring}, {"clubhead": one})


def carried(kind: str, size: float | None = None) -> Carry:
    size = PHYSICS[kind] if size is None else size
    return Carry(kind, "spring", np.array([size]), np.array([OTHER.get(kind, 0.0)]))


def swing(structure: Structure, laws=(), reach=0.1, seconds=2.0, substeps=4, radius=0.9):
    start = held_start(structure, laws, "clubhead", reach)
    loads = Loads.none(round(seconds * RATE) * substeps + 1)
    return march(structure, laws, start, loads, RATE, substeps, radius)


def test_an_even_cantilever_has_the_closed_frequencies():
    bending, line_mass, length = 40.0, 0.055, 0.84
    edges = np.linspace(0.0, length, 13)
    stiffness, mass = line(edges, lambda x: bending, lambda x: line_mass, 0.0)
    squares = np.linalg.eigvals(np.linalg.solve(mass[2:, 2:], stiffness[2:, 2:])).real
    found = np.sort(np.sqrt(squares))[:3]
    roots = np.array([1.8751040687, 4.6940911330, 7.8547574382])
    closed = roots**2 * np.sqrt(bending / (line_mass * length**4))
    assert found == pytest.approx(closed, rel=4e-4)
    assert found[0] == pytest.approx(closed[0], rel=1e-6)


def test_rotary_inertia_lowers_the_high_modes_as_rayleigh_says():
    bending, line_mass, rotary, length = 40.0, 0.055, 2e-4, 0.84
    edges = np.linspace(0.0, length, 41)
    tones = []
    for turning in (0.0, rotary):
        stiffness, mass = line(edges, lambda x: bending, lambda x: line_mass, turning)
        held = [0, len(mass) - 2]  # a beam on two pins has sines for its modes
        keep = [index for index in range(len(mass)) if index not in held]
        cut = np.ix_(keep, keep)
        squares = np.linalg.eigvals(np.linalg.solve(mass[cut], stiffness[cut])).real
        tones.append(np.sort(np.sqrt(squares))[:3])
    waves = np.arange(1, 4) * np.pi / length
    assert tones[1] / tones[0] == pytest.approx(
        1 / np.sqrt(1 + rotary * waves**2 / line_mass), rel=1e-6
    )


def test_a_tapered_shaft_bends_under_its_load_as_the_integral_says():
    def bending(x):
        return 60.0 - 45.0 * x / 0.84

    edges = np.linspace(0.0, 0.84, 49)
    stiffness, _ = line(edges, bending, lambda x: 0.05, 0.0)
    tip = np.linalg.solve(stiffness[2:, 2:], np.eye(len(stiffness) - 2)[-2])[-2]
    x = np.linspace(0.0, 0.84, 20001)
    closed = np.trapezoid((0.84 - x) ** 2 / bending(x), x)
    assert tip == pytest.approx(closed, rel=2e-4)


def test_the_clamped_club_is_the_thesis_shaft():
    stiffness, mass, head = clamped(CLUB)
    assert 1 / (head @ np.linalg.solve(stiffness, head)) == pytest.approx(139.0, rel=1e-9)
    tones = np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(mass, stiffness)).real))
    assert tones[0] / (2 * np.pi) == pytest.approx(4.167, rel=1e-6)
    assert 45 < tones[1] / (2 * np.pi) < 75, "the second bending mode that no lumped club has"


def test_a_stiff_sleeve_is_a_clamp_and_a_stiff_wrist_a_fixed_collet():
    rigid = {**CLUB, "sleeve_stiffness": 1e9, "sleeve_damping": 0.0}
    held = finite_club(rigid, "fixed_collet").tones()[0]
    assert 0.97 < held / CLUB["clamped_hertz"] < 1.0, "it bends a little between its last stations"
    stiff = finite_club({**rigid, "wrist_stiffness": 1e8}, "pinned_wrist").tones()[0]
    assert stiff == pytest.approx(held, rel=1e-3)


def test_the_sleeve_of_elements_turns_as_the_lumped_one():
    for tilt in (0.0, 0.4):
        club = finite_club({**CLUB, "sleeve_tilt": tilt}, "fixed_collet", np.full(STATIONS, 0.1))
        sleeve = club.places["sleeve"]
        places = np.linspace(0.0, CLUB["grip_length"], STATIONS)
        turning = sleeve.stiffness @ (places - places.mean()) ** 2
        assert turning == pytest.approx(CLUB["sleeve_stiffness"] * CLUB["sleeve_spacing"] ** 2)


def test_the_sleeves_bring_the_frequencies_of_the_thesis():
    from tests.lab.clubs import SLEEVES

    wanted = ((3.64, 0.02), (3.55, 0.08), (3.08, 0.11))
    for (stiffness, damping), (tone, ratio) in zip(SLEEVES["B"], wanted):
        numbers = {**CLUB, "sleeve_stiffness": stiffness, "sleeve_damping": damping}
        tones, ratios = finite_club(numbers, "fixed_collet").poles()
        assert tones[0] == pytest.approx(tone, rel=0.05)
        assert 0.5 * ratio < ratios[0] < 2.0 * ratio


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("bench", ["A", "B"])
def test_drawn_clubs_are_sound(bench, model):
    for seed in range(4):
        club = draw_scattered_club(np.random.default_rng(seed), bench, model)
        whole = club.structure()
        for matrix in (whole.mass, whole.stiffness, whole.damping):
            assert matrix == pytest.approx(matrix.T, abs=1e-9 * np.abs(matrix).max())
        assert np.linalg.eigvalsh(whole.mass).min() > 0
        assert np.linalg.eigvalsh(whole.stiffness).min() > 0
        assert np.linalg.eigvalsh(whole.damping).min() > -1e-9 * np.abs(whole.damping).max()
        tones, ratios = whole.poles()
        assert 1.5 < tones[0] < 5.0 and 0.001 < ratios[0] < 0.5
        lumped = as_lumped(club)
        for name in club.free:
            assert 0.8 < club.told[name] / lumped[name] < 1.21
        for name, std in club.known.items():
            assert abs(club.told[name] - lumped[name]) <= 2.001 * std
        if bench == "B":
            pull, tone = clamped_check(club)
            assert pull == pytest.approx(club.truth["shaft_stiffness"], rel=1e-6)
            assert tone == pytest.approx(club.truth["clamped_hertz"], rel=1e-5)
    with pytest.raises(ValueError, match="expected A or B"):
        draw_scattered_club(np.random.default_rng(0), "C", model)


@pytest.mark.parametrize("model", ["fixed_collet", "pinned_wrist"])
def test_undamped_elements_keep_their_energy(model):
    club = finite_club(CLUB, model).without_damping()
    moved = swing(club, seconds=0.5, radius=1.0)
    energy = club.energy(moved.position, moved.velocity)
    assert np.ptp(energy) < 1e-8 * energy[0]


def test_damped_elements_only_lose_energy():
    club = finite_club(CLUB, "pinned_wrist")
    energy = club.energy(*swing(club, seconds=0.5).orders()[:2])
    assert np.all(np.diff(energy) < 1e-9 * energy[0]) and energy[-1] < 0.5 * energy[0]


def test_the_march_converges_with_second_order():
    club = finite_club(CLUB, "driven_wrist")
    errors = []
    for substeps in (2, 4, 8):
        count = 512 * substeps + 1
        times = np.arange(count) / (RATE * substeps)
        angle = 0.1 * np.sin(20 * times) ** 2
        loads = Loads(np.zeros(count), angle, 0.1 * 20 * np.sin(40 * times))
        rest = Start(np.zeros(club.size), np.zeros(club.size))
        ours = march(club, (), rest, loads, RATE, substeps)
        fine = 32 * 512 + 1
        times = np.arange(fine) / (RATE * 32)
        dense = Loads(0 * times, 0.1 * np.sin(20 * times) ** 2, 2.0 * np.sin(40 * times))
        found = exact(club, rest, dense, RATE * 32)
        head = club.points["clubhead"]
        true = found.acceleration[::32] @ head
        errors.append(np.abs(ours.acceleration @ head - true).max() / np.abs(true).max())
    assert errors[-1] < 1e-4
    for coarse, fine in pairwise(errors):
        assert 3.0 < coarse / fine < 5.5, errors


def test_a_blow_between_two_samples_keeps_its_momentum():
    """Seen at the samples alone it would never have been."""
    club = finite_club(CLUB, "pinned_wrist")
    force = np.zeros(256 * SUBSTEPS + 1)
    force[5 * SUBSTEPS + 1 : 6 * SUBSTEPS] = 200.0
    loads = Loads(force, 0 * force, 0 * force)
    rest = Start(np.zeros(club.size), np.zeros(club.size))
    found = exact(club, rest, loads, RATE, SUBSTEPS)
    dense = exact(club, rest, loads, RATE * SUBSTEPS)
    assert found.position == pytest.approx(dense.position[::SUBSTEPS], rel=1e-9, abs=1e-12)
    speed = found.velocity @ club.points["clubhead"]
    assert speed == pytest.approx(dense.velocity[::SUBSTEPS] @ club.points["clubhead"], abs=1e-9)
    assert np.abs(speed).max() > 0.1
    assert not exact(club, rest, loads.every(SUBSTEPS), RATE).position.any()


@pytest.mark.parametrize("kind", ["cubic_stiffness", "quadratic_damping", "relaxation"])
def test_curved_laws_agree_with_an_independent_integration(kind):
    structure, law = single(damping=0.3), carried(kind)
    ours = swing(structure, (law,), seconds=1.0, substeps=8)

    def rates(time, state):
        d, v, x = state
        pull = {
            "cubic_stiffness": law.size[0] * d**3,
            "quadratic_damping": law.size[0] * abs(v) * v,
            "relaxation": law.size[0] * (d - x),
        }[kind]
        return [v, -(100.0 * d + 0.3 * v + pull), (d - x) / 0.05]

    times = np.arange(len(ours.position)) / RATE
    found = solve_ivp(rates, (0, times[-1]), [0.1, 0.0, 0.1], t_eval=times, rtol=1e-10, atol=1e-12)
    assert np.abs(ours.position[:, 0] - found.y[0]).max() < 3e-6


def test_friction_and_play_obey_their_closed_forms():
    friction, reach = 1.0, 0.105
    moved = swing(single(), (carried("coulomb_friction"),), reach, substeps=4)
    turns = np.flatnonzero(np.diff(np.sign(moved.velocity[:, 0]))) + 1
    tops = np.abs(moved.position[turns[turns > 10], 0])
    steps = -np.diff(np.concatenate([[reach], tops]))
    assert steps[:4] == pytest.approx(2 * friction / 100.0, rel=0.02)
    free = swing(single(), (carried("clearance"),), 0.07, substeps=8)
    crossings = np.flatnonzero((free.position[:-1, 0] > 0) & (free.position[1:, 0] <= 0)) / RATE
    period = 2 * np.pi / 10.0 + 4 * 0.02 / (10.0 * 0.05)
    assert np.diff(crossings) == pytest.approx(period, abs=1.5 / RATE)


@pytest.mark.parametrize("kind", ["coulomb_friction", "slip", "hysteresis", "relaxation"])
def test_a_closed_loop_of_a_law_with_memory_costs_work(kind):
    law = carried(kind)
    path = 0.06 * np.sin(2 * np.pi * np.linspace(0, 3, 6001))
    memory, forces = blank(law), []
    for before, now in pairwise(path):
        step = 5e-4
        force, _, _, memory = law.reply(
            np.array([now]), np.array([(now - before) / step]), memory, 0.0, step
        )
        forces.append(force[0])
    last = slice(-2000, None)
    work = np.trapezoid(np.array(forces)[last], path[1:][last])
    assert work > 1e-4
    smooth = carried("cubic_stiffness")
    held = [smooth.reply(np.array([d]), np.zeros(1), blank(smooth), 0.0, 1.0)[0][0] for d in path]
    assert abs(np.trapezoid(np.array(held)[last], path[last])) < 1e-6


@pytest.mark.parametrize("kind", sorted(PHYSICS))
def test_the_slopes_of_the_laws_are_their_derivatives(kind):
    law, memory = carried(kind), None
    memory = law.reply(np.array([0.03]), np.array([0.4]), blank(law), 0.1, 1e-3)[3]
    place = np.array([0.0345]), np.array([0.7])
    force, by_d, by_v, _ = law.reply(*place, memory, 0.1, 1e-3)
    small = 1e-7
    further = law.reply(place[0] + small, place[1], memory, 0.1, 1e-3)[0]
    faster = law.reply(place[0], place[1] + small, memory, 0.1, 1e-3)[0]
    assert (further - force) / small == pytest.approx(by_d, rel=1e-4, abs=1e-5)
    assert (faster - force) / small == pytest.approx(by_v, rel=1e-4, abs=1e-5)


@pytest.mark.parametrize("kind", sorted(PHYSICS))
def test_a_law_of_no_size_is_the_twin(kind):
    size = 1e9 if kind == "slip" else 0.0
    with_law = swing(single(damping=0.3), (carried(kind, size),), seconds=0.5)
    twin = swing(single(damping=0.3), (), seconds=0.5)
    assert np.abs(with_law.acceleration - twin.acceleration).max() < 1e-12 * 10.0


def test_a_hand_that_holds_is_in_balance():
    club = finite_club(CLUB, "pinned_wrist")
    stations = np.ones(STATIONS)
    law = Carry("cubic_stiffness", "sleeve", 3e9 * stations, 0 * stations)
    start = held_start(club, (law,), "clubhead", 0.15)
    d = club.places["sleeve"].rows @ start.position
    pull = club.stiffness @ start.position + club.places["sleeve"].rows.T @ (law.size * d**3)
    head = club.points["clubhead"]
    assert head @ start.position == pytest.approx(0.15, rel=1e-9)
    hand = (head @ pull) / (head @ head)
    assert np.abs(pull - hand * head).max() < 1e-6 * abs(hand)
    assert law.reply(d, 0 * d, blank(law), 0.0, REST)[0] == pytest.approx(law.size * d**3)


@pytest.mark.parametrize("whole_steps", [True, False])
def test_stations_at_their_corners_come_to_rest(monkeypatch, whole_steps):
    """Whole steps may go round in circles there, as rounding has it; shorter ones arrive too."""
    rng = np.random.default_rng(19)
    club = draw_scattered_club(rng, "B", "driven_wrist").structure()
    stiffness = club.places["sleeve"].stiffness
    gaps = 2e-3 * rng.uniform(0.8, 1.3, (3, len(stiffness)))[2]
    law = Carry("clearance", "sleeve", gaps, stiffness)
    if not whole_steps:
        monkeypatch.setattr(marching, "MOST_ITERATIONS", 3)
    start = held_start(club, (law,), "clubhead", 0.03)
    d = club.places["sleeve"].rows @ start.position
    assert np.any(np.abs(d) > gaps) and np.any(np.abs(d) < gaps)
    pull = club.stiffness @ start.position
    pull += club.places["sleeve"].rows.T @ law.reply(d, 0 * d, blank(law), 0.0, REST)[0]
    head = club.points["clubhead"]
    hand = (head @ pull) / (head @ head)
    assert np.abs(pull - hand * head).max() < 1e-5 * abs(hand)
    if not whole_steps:
        monkeypatch.setattr(marching, "_damped", lambda *given: None)
        with pytest.raises(RuntimeError, match="did not close"):
            held_start(club, (law,), "clubhead", 0.03)


def test_support_rider_and_lag_do_what_they_say():
    club = draw_scattered_club(np.random.default_rng(5), "B", "pinned_wrist")
    rng = np.random.default_rng(1)
    soft = draw_cause(club, "support_flexibility", "base", 0.1, [], rng)
    whole = club.structure()
    assert soft.reshape is not None
    row = whole.points["clubhead"]
    before = row @ np.linalg.solve(whole.stiffness, row)
    given = soft.reshape(whole)
    row = given.points["clubhead"]
    after = row @ np.linalg.solve(given.stiffness, row)
    assert after - before == pytest.approx(0.1 / club.truth["shaft_stiffness"], rel=1e-6)
    rider = whole.with_rider("clubhead", 0.01, 12.0, 0.02)
    assert rider.points["clubhead"] @ np.linalg.solve(
        rider.stiffness, rider.points["clubhead"]
    ) == pytest.approx(before, rel=1e-9)
    assert np.min(np.abs(rider.tones() - 12.0)) < 1.0
    times = np.arange(4000) / 1000.0
    ramp = lagged(Loads(0 * times, times, 1 + 0 * times), 0.05, 1000.0)
    assert ramp.angle[-1] == pytest.approx(times[-1] - 0.05, abs=1e-9)
    assert ramp.rate[-1] == pytest.approx(1.0, abs=1e-9)


def test_filters_of_the_channels_have_their_corners():
    times = np.arange(8192) / RATE
    tone, last = np.sin(2 * np.pi * 4.0 * times), slice(4096, None)
    corner = 1 / (2 * np.pi * 4.0)
    for law in ("sensor_highpass", "sensor_lowpass"):
        shown = faulty(Fault(law, "", corner), tone, RATE, 0.0)
        ratio = np.std(shown[last]) / np.std(tone[last])
        assert ratio == pytest.approx(np.sqrt(0.5), rel=2e-3)
    still = faulty(Fault("sensor_lowpass", "", corner), np.ones(100), RATE, 0.0)
    assert still == pytest.approx(1.0)
    assert np.abs(faulty(Fault("sensor_saturation", "", 0.6), tone, RATE, 0.0)).max() == 0.6
    assert faulty(Fault("sensor_rectified", "", 0.1), -tone, RATE, 0.0) == pytest.approx(
        -tone + 0.1 * np.abs(tone)
    )


def test_the_library_is_wide_and_every_pair_has_a_strength():
    laws = {law for law, _ in CAUSES}
    assert len(laws) >= 20 and laws == set(WEAKEST)
    assert RANGE >= 30
    assert set(ALSO) <= set(PLACES)


@pytest.mark.parametrize("bench", ["A", "B"])
def test_every_cause_can_be_hidden_and_none_of_no_strength_changes_a_thing(bench):
    rng = np.random.default_rng(2)
    met = set()
    for model in ("driven_wrist", "fixed_collet"):
        club = draw_scattered_club(np.random.default_rng(9), bench, model, 300)
        kind = "driven" if model == "driven_wrist" else "decay"
        run = draw_run(club, kind, 0.8, rng)
        structure, twin = carry_out(club, run)
        clean = channels(club, run, structure, twin)
        for law, place in possible(club):
            if (law, place) in met:
                continue
            met.add((law, place))
            cause = draw_cause(club, law, place, 0.0, [twin], rng)
            if law in ("sensor_saturation", "sensor_highpass"):
                assert cause.faults[0].law == law
            seen = channels(club, run, *carry_out(club, run, [cause]), [cause])
            for name, values in clean.items():
                gap = np.abs(seen[name] - values).max()
                assert gap <= (1e-5 if law == "slip" else 1e-9) * np.abs(values).max(), (
                    law,
                    place,
                    name,
                )
    assert met == set(CAUSES)


def test_a_sealed_case_is_its_seed_and_keeps_its_truth_apart(tmp_path):
    for name in "ab":
        words = ["draw", "--bench", "B", "--seed", "11", "--out", str(tmp_path / name)]
        assert main([*words, "--train", "1", "--held-out", "1", "--samples", "512"]) == 0
    one, two = (sorted((tmp_path / name).rglob("*.*")) for name in "ab")
    assert [path.name for path in one] == [path.name for path in two]
    assert all(a.read_bytes() == b.read_bytes() for a, b in zip(one, two))
    truth = json.loads((tmp_path / "a" / "truth.json").read_text())
    told = "".join(path.read_text() for path in (tmp_path / "a" / "records").glob("*.toml"))
    assert "truth" not in told
    for cause in truth["causes"]:
        assert cause["law"] not in told
    rig = tomllib.loads((tmp_path / "a" / "records" / "rig.toml").read_text())
    for name, entry in rig["parameters"].items():
        assert entry["value"] != pytest.approx(truth["lumped"][name], rel=1e-6)
        assert entry.get("free") or entry["std"] > 0


def test_a_test_made_again_is_as_much_further_and_leaves_the_others(tmp_path):
    case = {"bench": "A", "seed": 4, "law": "cubic_stiffness", "train": 2, "held_out": 1}
    first = draw_sealed(tmp_path / "a", **case, place="shaft", samples=512)
    name = first["records"][0]["name"]
    more = draw_sealed(tmp_path / "b", **case, place="shaft", samples=512, again=f"{name}:2")
    before, after = ([dict(c) for c in told["causes"]] for told in (first, more))
    less, greater = (c[0].pop("power")["projected_norm"] for c in (before, after))
    assert after == before and more["constants"] == first["constants"]
    assert greater > less > 0.0  # what a cause changes is of the records, and one more came
    assert more["records"][:3] == first["records"]
    last = more["records"][3]
    assert last["split"] == "train" and last["kind"] == first["records"][0]["kind"]
    assert last["amplitude"] == pytest.approx(2 * first["records"][0]["amplitude"])
    old, new = (
        {p.name: p.read_bytes() for p in (tmp_path / n / "records").iterdir()} for n in "ab"
    )
    assert {key: new[key] for key in old} == old and len(new) > len(old)

    def size(part, which):
        table = np.loadtxt(tmp_path / part / "records" / f"{which}.csv", delimiter=",", skiprows=1)
        return float(np.ptp(table[:, 1]))

    assert 1.7 < size("b", last["name"]) / size("a", name) < 2.4
    for words in ("train_09_decay:2", f"{name}:0", name):
        with pytest.raises(ValueError, match="expected NAME:FACTOR"):
            draw_sealed(tmp_path / "c", **case, samples=512, again=words)


def test_a_recorded_blow_has_the_impulse_of_the_true_one():
    club = draw_scattered_club(np.random.default_rng(3), "A", "fixed_collet")
    blows = (draw_run(club, "impact", 1.0, np.random.default_rng(seed)) for seed in range(20))
    fine = next(blow for blow in blows if blow.told_force).loads.force
    told = sampled(fine, SUBSTEPS)
    true = float(np.sum(fine)) / SUBSTEPS
    assert len(told) == club.count and abs(np.sum(told) / true - 1) < 2e-4
    assert abs(np.sum(fine[::SUBSTEPS]) / true - 1) > 4e-3  # bare samples lose some of it


@pytest.mark.parametrize("model", MODELS)
def test_sealed_files_obey_the_contract(model, tmp_path):
    draw_sealed(tmp_path, "B", 12, effects=0, model=model, train=3, held_out=1, samples=512)
    sidecars = [p for p in (tmp_path / "records").glob("*.toml") if p.name != "rig.toml"]
    assert len(sidecars) == 4
    splits = []
    for path in sidecars:
        told = tomllib.loads(path.read_text())
        splits.append(told["record"]["split"])
        assert told["record"]["test"] in ("decay", "impact", "driven")
        for name, channel in told["channels"].items():
            file = path.parent / channel.get("file", f"{path.stem}.csv")
            table = np.genfromtxt(file, delimiter=",", names=True)
            assert channel["column"] in (table.dtype.names or ())
            if "file" in channel:
                steps = np.diff(table[channel["time"]])
                assert steps == pytest.approx(1 / 250.0, abs=1e-6)
                assert isinstance(channel["clock_offset"], float)
                ticks = table[name] / 0.01
                assert ticks == pytest.approx(np.round(ticks), abs=1e-4)
            assert np.all(np.isfinite(table[channel["column"]]))
    assert sorted(splits) == ["held_out", "train", "train", "train"]


def test_unknown_words_are_refused_in_one_line(tmp_path, capsys):
    words = ["draw", "--bench", "A", "--seed", "1", "--out", str(tmp_path)]
    assert main([*words, "--law", "magic"]) == 2
    assert "expected one of" in capsys.readouterr().err
    assert main([*words, "--law", "servo_lag", "--model", "pinned_wrist"]) == 2
    assert "expected a pair" in capsys.readouterr().err
    assert list(Path(tmp_path).iterdir()) == []
    club = draw_scattered_club(np.random.default_rng(1), "A", "fixed_collet")
    with pytest.raises(ValueError, match="expected one of"):
        draw_cause(club, "clearance", "wrist", 0.1, [], np.random.default_rng(1))
    assert Hidden("a", "b", 0.0).carries == ()
