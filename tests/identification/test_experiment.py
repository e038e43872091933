"""The next test: what is foretold of it is what it brings when it is made on the bench."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from supple.identification.base import fit_base
from supple.identification.causes import possible_causes
from supple.identification.experiment import CLEAR, Rival, propose
from supple.identification.extend import extend
from supple.identification.fit import Fit, solve
from supple.identification.noise import Noise
from supple.identification.possible_tests import NAME, planned_tests
from supple.identification.problem import make_problem
from supple.identification.screen import screen
from supple.studies import cli
from tests.identification.benches import Bench, make_bench

LAWS = ("coulomb_friction", "quadratic_damping")
FIRST = 0.3
FRICTION = (("coulomb_friction", 0.004),)


def with_law(base: Fit, name: str) -> Fit:
    causes = [
        cause for cause in possible_causes(base) if (cause[0], cause[1].name) == ("spring", name)
    ]
    return extend(base, screen(base, causes)[0], 40)


def fitted(bench: Bench) -> list[Rival]:
    base = fit_base(make_problem(bench.records, bench.rig))
    return [Rival(f"spring/{name}", with_law(base, name)) for name in LAWS]


@pytest.fixture(scope="module")
def known(tmp_path_factory) -> Bench:
    return make_bench(
        tmp_path_factory.mktemp("known"), FRICTION, (FIRST, 0.9 * FIRST), (), snr_db=30.0
    )


@pytest.fixture(scope="module")
def rivals(known: Bench) -> list[Rival]:
    return fitted(known)


def test_what_a_test_is_expected_to_tell_is_what_it_tells_when_it_is_made(
    rivals: list[Rival], known: Bench, tmp_path: Path
) -> None:
    told = [one for one in propose(rivals, most=3.0) if not one.planned.prepared.numbers]
    found = {one.planned.factor: one for one in told}
    assert set(found) == {0.5, 1.0, 3.0}
    noise = rivals[0].fit.problem.floor["train_01", "see_cart"]
    before = [cost(rival.fit, noise) for rival in rivals]
    made = {}
    for factor in found:
        # the bench's noise goes with a record's size; an instrument's does not
        loud = 30.0 + 20.0 * np.log10(factor)
        new = make_bench(
            tmp_path / f"{factor:g}", FRICTION, (factor * FIRST,), (), snr_db=loud, prefix="next_"
        )
        base = fit_base(make_problem([*known.records, *new.records], known.rig))
        right, wrong = (cost(with_law(base, name), noise) for name in LAWS)
        made[factor] = wrong - right - (before[1] - before[0])
    assert max(made, key=lambda factor: made[factor]) == 3.0
    for factor, one in found.items():
        ((first, second, told, _),) = one.all_pairs
        assert (first, second) == tuple(rival.name for rival in rivals)
        assert 0.5 < made[factor] / told < 2.0, (factor, made, told)
        assert one.evidence <= told and one.evidence > CLEAR


def cost(fit: Fit, noise: Noise) -> float:
    """What is left of a fit in units of the instrument's own noise."""
    return solve(replace(fit.model, noises=dict.fromkeys(fit.keys, noise)), fit.x, 60).cost


def test_tests_are_made_after_what_the_lab_has_and_carry_no_values(rivals: list[Rival]) -> None:
    planned = planned_tests(rivals[0].fit, 2.0)
    assert [one.factor for one in planned] == [0.5, 1.0, 2.0, 1.0]
    assert planned[3].prepared.numbers == {"masses.cart.mass": pytest.approx(0.6)}
    assert "0.1 kg more at cart" in planned[3].words
    for one in planned:
        assert one.prepared.name == NAME and one.template == "train_01"
        assert all(np.ptp(sensor.values) == 0 for sensor in one.prepared.sensors)
        assert one.template in one.words


def test_one_explanation_alone_cannot_be_separated(rivals: list[Rival]) -> None:
    with pytest.raises(ValueError, match="two at least, found 1"):
        propose(rivals[:1])


def diagnosed(folder: Path, bench: Bench) -> Path:
    """A diagnosis of the bench's records as the command writes it, made by hand."""
    files = {}
    for record in bench.records:
        files |= record.files
    inputs = {**files, str(bench.rig.path): bench.rig.sha256}
    pair = [{"law": name, "place": "spring", "delta_bic": 100.0} for name in LAWS]
    told = {
        "status": "ambiguous",
        "cannot_tell": [],
        "causes": pair,
        "best_guess": [],
        "candidates": pair,
        "records": [{"name": record.name, "split": "train"} for record in bench.records],
        "history": [{}, {}],
        "provenance": {"inputs": inputs},
    }
    path = folder / "diagnosis.json"
    path.write_text(json.dumps(told))
    return path


def test_the_command_ranks_tests_and_writes_them(known: Bench, tmp_path: Path) -> None:
    path = diagnosed(tmp_path, known)
    assert cli.main(["experiment", str(path), "--out", str(tmp_path / "out"), "--quiet"]) == 0
    told = json.loads((tmp_path / "out" / "experiment.json").read_text())
    assert told["causes"] == [f"spring/{name}" for name in LAWS]
    evidence = [one["expected_evidence"] for one in told["tests"]]
    assert evidence == sorted(evidence, reverse=True) and len(evidence) == 4
    assert told["status"] == ("separable" if evidence[0] >= CLEAR else "not_separable")
    assert told["tests"][0]["test"] in told["sentence"]
    assert str(known.rig.path) in told["provenance"]["inputs"]


BROKEN = {
    "not JSON": (lambda text: text[:-5], "expected JSON"),
    "no diagnosis": (lambda text: "{}", "causes: expected a list"),
    "a cause without a place": (
        lambda text: text.replace('"place"', '"spot"'),
        "a law and a place",
    ),
    "records that are gone": (
        lambda text: text.replace("train_01.toml", "gone.toml"),
        "sidecars of 2",
    ),
    "a changed file": (lambda text: text.replace('.csv": "', '.csv": "0'), "changed"),
}


@pytest.mark.parametrize("case", list(BROKEN))
def test_a_broken_diagnosis_is_refused_in_one_line(
    case: str, known: Bench, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spoil, told = BROKEN[case]
    path = diagnosed(tmp_path, known)
    path.write_text(spoil(path.read_text()))
    assert cli.main(["experiment", str(path), "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr()
    assert said.out == "" and len(said.err.splitlines()) == 1
    assert told in said.err and "Mend:" in said.err
    assert not (tmp_path / "out").exists()
