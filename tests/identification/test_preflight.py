"""Pre-flight: constructed faults are all refused in words before any fit, clean sets never."""

import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from supple.identification.preflight import preflight, require_ready, stuck_run
from supple.identification.problem import make_problem
from supple.identification.records import read_record
from supple.model.rig import read_rig
from supple.studies.cli import main
from tests.identification.benches import make_bench, multisine
from tests.lab.bodies import ROBO_V
from tests.lab.draw import Case, draw_case, write_case
from tests.lab.effects import NOTHING
from tests.lab.plants import club, club_sensor
from tests.lab.trials import decay

RATE = 50.0


def cart(folder: Path, seed: int) -> Path:
    """Two decays of a cart of 2 Hz."""
    make_bench(folder, held=(), seed=seed)
    return folder


def pushed(folder: Path, seed: int) -> Path:
    """The cart, twice driven by a recorded force from rest."""
    make_bench(folder, held=(), driven=True, seed=seed)
    return folder


def made(folder: Path, seed: int, bench: str, seen: tuple[tuple[str, str], ...]) -> Path:
    """Two releases of a club."""
    truth = dict(ROBO_V) | {"wrist_damping": 5.0}
    free = ("sleeve_stiffness", "sleeve_damping")
    free = free if bench == "fixed_collet" else ("wrist_stiffness", "wrist_damping")
    told = {name: 0.9 * truth[name] for name in free}
    sensors = tuple(club_sensor(bench, truth, *one) for one in seen)
    plant = club(bench, truth, free, told, sensors, rate=512.0, count=1000)
    trials = [decay(plant, 0.15), decay(plant, 0.06)]
    named = [type(t)(**{**vars(t), "name": f"train_{i}"}) for i, t in enumerate(trials, 1)]
    chance = np.random.default_rng(seed)
    folder.mkdir(parents=True, exist_ok=True)
    write_case(folder, plant, named, NOTHING, "white", 34.0, {}, chance, sealed=False)
    return folder


def fixed(folder: Path, seed: int) -> Path:
    """The club in a fixed collet, with an accelerometer."""
    return made(folder, seed, "fixed_collet", (("head", "m/s^2"),))


def wristed(folder: Path, seed: int) -> Path:
    """The club on a wrist, with an accelerometer and the wrist's angle."""
    return made(folder, seed, "pinned_wrist", (("head", "m/s^2"), ("wrist", "deg")))


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert re.search(old, text), (old, text)
    path.write_text(re.sub(old, new, text))


def in_rig(old: str, new: str) -> Callable[[Path], None]:
    return lambda folder: edit(folder / "rig.toml", old, new)


def in_sidecars(old: str, new: str) -> Callable[[Path], None]:
    def change(folder: Path) -> None:
        for path in folder.glob("train_*.toml"):
            edit(path, old, new)

    return change


def more(text: str, where: str = "rig.toml") -> Callable[[Path], None]:
    def change(folder: Path) -> None:
        for path in folder.glob(where):
            path.write_text(path.read_text() + text)

    return change


def freed(name: str, value: float) -> Callable[[Path], None]:
    """One more number of the robot that is free."""
    return in_rig(
        r"\[parameters\]\n", f"[parameters]\n{name} = {{ value = {value}, free = true }}\n"
    )


def column(
    change: Callable[[np.ndarray, np.random.Generator], np.ndarray], index: int = -1
) -> Callable[[Path], None]:
    """Change one column of every record."""

    def changed(folder: Path) -> None:
        for path in sorted(folder.glob("train_*.csv")):
            head, *_ = path.read_text().splitlines()
            table = np.loadtxt(path, delimiter=",", skiprows=1)
            table = np.atleast_2d(table)
            table[:, index] = change(table[:, index], np.random.default_rng(len(table)))
            np.savetxt(path, table, fmt="%.9g", delimiter=",", header=head, comments="")

    return changed


def rows(step: int = 1, stop: int | None = None) -> Callable[[Path], None]:
    """Keep a row of so many, up to one."""

    def changed(folder: Path) -> None:
        for path in sorted(folder.glob("train_*.csv")):
            head, *body = path.read_text().splitlines()
            path.write_text("\n".join([head, *body[:stop:step]]) + "\n")
        in_sidecars(r"sample_rate = .*\n", "")(folder)

    return changed


def clock(factor: float) -> Callable[[Path], None]:
    """Times that are off by a factor, and no rate that would tell."""

    def changed(folder: Path) -> None:
        column(lambda t, _: t * factor, 0)(folder)
        in_sidecars(r"sample_rate = .*\n", "")(folder)

    return changed


def cart_of(
    force: Callable[[np.ndarray], np.ndarray], loud: float = 0.01
) -> Callable[[Path], None]:
    """Another force on the cart, with the motion that it makes, by steps of a hundredth."""

    def changed(folder: Path) -> None:
        for path in sorted(folder.glob("train_*.csv")):
            head, *_ = path.read_text().splitlines()
            names = head.split(",")
            table = np.loadtxt(path, delimiter=",", skiprows=1)
            times, fine = table[:, 0], 100
            x, v, seen = 0.0, 0.0, []
            push = force(np.arange(len(times) * fine) / (RATE * fine))
            for k, f in enumerate(push):
                if k % fine == 0:
                    seen.append(x)
                v += (f - 80.0 * x - 0.126 * v) / 0.5 / (RATE * fine)
                x += v / (RATE * fine)
            moved = np.array(seen)
            noise = np.random.default_rng(5).standard_normal(len(moved))
            at = next(i for i, n in enumerate(names) if n.startswith("see"))
            told = next(i for i in range(1, len(names)) if i != at)
            table[:, at] = moved + loud * np.std(moved) * noise
            table[:, told] = push[::fine]
            np.savetxt(path, table, fmt="%.9g", delimiter=",", header=head, comments="")

    return changed


OTHER = """
[masses.block]
mass = 0.4
[links.other]
between = ["ground", "block"]
stiffness = { value = 50.0, free = true }
damping = 0.1
"""
DAY = '\n[parameters]\n"links.spring.stiffness" = 70.0\n'
SPRING = r"stiffness = \{ value = 70\.0[^}]*\}"
FAULTS: dict[str, tuple[Callable[[Path, int], Path], Callable[[Path], None], str]] = {
    "damping starts at 0": (cart, in_rig(r"value = 0\.2, min = 0\.0", "value = 0.0, min = 0.0"),
                            "on the lower bound 0"),
    "stiffness starts at its maximum": (
        cart, in_rig(SPRING, "stiffness = { value = 70.0, max = 70.0, free = true }"),
        "on the upper bound 70"),
    "wrist starts at its minimum": (
        wristed, in_rig(r"wrist_stiffness = \{[^}]*\}",
                        "wrist_stiffness = { value = 50.0, min = 50.0, free = true }"),
        "on the lower bound 50"),
    "a wrist in a fixed collet": (fixed, freed("wrist_stiffness", 300.0), "no response that moves"),
    "a collet that cannot move": (fixed, freed("collet_inertia", 0.028), "no response that moves"),
    "an arm that is not there": (wristed, freed("arm_length", 0.65), "no response that moves"),
    "a mass behind no sensor": (cart, more(OTHER), "no response that moves"),
    "stated for every day": (cart, more(DAY, "train_*.toml"), "one that every record states"),
    "a grip's mass in a decay": (fixed, freed("grip_mass", 0.1), "by noise alone"),
    "a slow ramp": (pushed, cart_of(lambda t: 0.5 - 0.5 * np.cos(0.3 * t), 0.1), "by noise alone"),
    "a fast tone": (pushed, cart_of(lambda t: np.sin(0.3 * t) ** 2 * np.sin(145.0 * t), 0.3),
                    "by noise alone"),
    "three quarters of a period": (pushed, rows(stop=20), "periods"),
    "clock in ms": (cart, in_sidecars(r'(column = "time"\nunit = )"s"', r'\1"ms"'), "Hz"),
    "clock ten times fast": (cart, clock(0.1), "times higher"),
    "clock in minutes": (fixed, clock(60.0), "Hz"),
    "clock in turns": (pushed, clock(2 * np.pi), "times lower"),
    "a force in kN": (pushed, column(lambda f, _: f / 1000, 1), "times"),
    "a motion in mm": (pushed, column(lambda x, _: 1000 * x, 2), "times"),
    "an acceleration in g": (wristed, column(lambda a, _: a / 9.80665, 1), "times"),
    "an angle in rad called deg": (wristed, column(lambda a, _: np.radians(a), 2), "times"),
    "a head's travel in mm": (fixed, column(lambda a, _: 1000 * a), "times more"),
    "a clipped channel": (cart, column(lambda x, _: np.clip(x, -0.3 * x.max(), 0.3 * x.max())),
                          "clipped"),
    "a dead channel": (cart, column(lambda x, _: 0 * x + 1e-3), "all the same"),
    "noise alone": (cart, column(lambda x, rng: 1e-3 * rng.standard_normal(len(x))), "noise"),
    "two levels": (cart, column(lambda x, _: np.where(x > 0, 1e-3, 0.0)), "different values"),
    "stuck": (cart, column(lambda x, _: np.where(np.arange(len(x)) > 56, x[56], x)), "held for"),
    "sampled below its mode": (cart, rows(step=14), "samples a period"),
    "a release of 150 m": (fixed, more("\n[start]\nclubhead_deflection = 150.0\n", "train_*.toml"),
                           "times less"),
}  # fmt: skip


def judged(folder: Path) -> str:
    """What a user reads before any fit; empty where nothing is refused."""
    paths = sorted(folder.glob("train_*.toml"))
    try:
        records = [read_record(path) for path in paths]
        rig = read_rig(folder / "rig.toml")
        require_ready(preflight(make_problem(records, rig)))
    except ValueError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("name", FAULTS)
def test_every_constructed_fault_is_refused_in_words(name, tmp_path):
    build, break_it, words = FAULTS[name]
    folder = build(tmp_path / "bench", list(FAULTS).index(name))
    break_it(folder)
    said = judged(folder)
    assert words in said and "Mend: " in said and "\n" not in said, said


def test_the_table_holds_more_than_25_faults():
    assert len(FAULTS) > 25


@pytest.mark.parametrize("build", [cart, pushed, fixed, wristed])
@pytest.mark.parametrize("seed", [1, 2])
def test_what_the_faults_were_put_into_passes(build, seed, tmp_path):
    assert judged(build(tmp_path / "bench", seed)) == ""


def told_by(case: Case) -> str:
    try:
        records = [read_record(path) for path in case.train]
        require_ready(preflight(make_problem(records, read_rig(case.rig))))
    except ValueError as error:
        return str(error)
    return ""


@pytest.mark.slow
@pytest.mark.parametrize("bench", ["chain", "fixed_collet", "pinned_wrist"])
@pytest.mark.parametrize("noise", ["white", "ar1", "outliers", "quantised", "heavy_tailed"])
def test_clean_sets_are_never_refused(bench, noise, tmp_path):
    for seed in range(100, 106):
        case = draw_case(tmp_path / f"{seed}", seed, bench, noise=noise, records=2)
        assert told_by(case) == "", seed


@pytest.mark.slow
def test_real_records_are_not_refused(real_records):
    for rig in sorted(real_records.glob("*/rig*.toml")):
        for path in sorted(rig.parent.glob("*.toml"))[:12]:
            if path.name.startswith("rig") or "[record]" not in path.read_text():
                continue
            record = read_record(path)
            if record.rig_path is None:
                continue
            problem = make_problem([record], read_rig(record.rig_path))
            refused = [remark.text for remark in preflight(problem) if remark.refuses]
            assert refused == [], refused


def test_a_decay_that_fades_into_its_steps_is_not_stuck():
    times = np.arange(2000) / 100.0
    ring = np.exp(-times) * np.cos(12 * times)
    coarse = np.round(ring / 0.02) * 0.02
    assert stuck_run(coarse) == 0
    held = np.where(times > 0.45, ring[45], ring)
    assert stuck_run(held) > 1900


def test_a_slow_force_still_tells_a_spring_but_a_multisine_tells_all(tmp_path):
    folder = pushed(tmp_path / "bench", 3)
    cart_of(lambda t: multisine(len(t), 3)[: len(t)] * 0.05)(folder)
    assert judged(folder) == ""


def test_identify_refuses_before_it_fits_and_check_says_it(tmp_path, monkeypatch, capsys):
    folder = cart(tmp_path / "bench", 1)
    clock(0.1)(folder)
    paths = [str(path) for path in sorted(folder.glob("train_*.toml"))]

    def never(*_: object) -> None:
        raise AssertionError("a fit was begun")

    monkeypatch.setattr("supple.identification.base.fit_base", never)
    assert main(["identify", *paths, "--quiet"]) == 2
    said = capsys.readouterr()
    assert "times higher" in said.err and said.out == ""
    assert main(["check", *paths, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert any(one["refuses"] and one["check"] == "timing" for one in told["preflight"])
    assert main(["check", *paths]) == 0
    assert "A fit would be refused" in " ".join(capsys.readouterr().out.split())
