"""supple identify --posterior: exit codes, files, taking up, and the real springs' stiffness."""

import json
import time
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from supple.identification.convergence import CONVERGED
from supple.studies.cli import main
from supple.studies.posterior import CHECKPOINT
from tests.identification.benches import DAMPING, STIFFNESS, Bench, make_bench

FILES = ["fit.json", "posterior.nc", "report.html", "rig.toml"]
NAMES = ("links.spring.stiffness", "links.spring.damping")


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    return make_bench(tmp_path_factory.mktemp("bench"), reaches=(1.0,), held=())


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("out")


@pytest.fixture(scope="module")
def short(bench: Bench, folder: Path) -> tuple[int, dict[str, Any], list[str]]:
    """A run that is cut off: its exit code, its result, and the files that it leaves."""
    arguments = [str(path) for path in bench.paths]
    arguments += ["--posterior", "--steps", "200", "--out", str(folder), "--quiet"]
    code = main(["identify", *arguments])
    left = sorted(file.name for file in folder.iterdir())
    return code, json.loads((folder / "fit.json").read_text()), left


def test_what_has_not_converged_is_written_and_ends_with_3(short):
    code, result, left = short
    told = result["posterior"]
    assert code == 3 and left == sorted([*FILES, CHECKPOINT])
    assert not told["converged"]
    assert told["status"] == f"not converged: run longer (estimated {told['wanted_steps']} steps)"
    assert set(told["parameters"]) == set(NAMES)


def test_a_run_as_long_as_advised_takes_it_up_and_converges(short, bench, folder, capsys):
    with h5py.File(folder / CHECKPOINT) as file:
        assert np.asarray(file["points"]).shape[0] == 200
    arguments = [str(path) for path in bench.paths]
    advice = str(short[1]["posterior"]["wanted_steps"])
    arguments += ["--posterior", "--steps", advice, "--json", "--out", str(folder)]
    code = main(["identify", *arguments])
    said = capsys.readouterr()
    assert code == 0 and said.err == ""
    result = json.loads(said.out)
    assert result == json.loads((folder / "fit.json").read_text())
    assert sorted(file.name for file in folder.iterdir()) == FILES
    told = result["posterior"]
    assert told["status"] == CONVERGED and told["laplace"]["agrees"], told["laplace"]
    for name, truth in zip(NAMES, (STIFFNESS, DAMPING)):
        one = told["parameters"][name]
        keys = {"mean", "std", "low", "high", "unit", "r_hat", "ess_bulk", "ess_tail"}
        assert keys <= set(one)
        assert abs(one["mean"] - truth) < 4 * one["std"]
        assert one["r_hat"] <= 1.01 and min(one["ess_bulk"], one["ess_tail"]) >= 400
        least = result["parameters"][name]
        assert abs(one["mean"] - least["value"]) < 0.1 * least["std"]
        assert one["std"] == pytest.approx(least["std"], rel=0.1)
    with h5py.File(folder / "posterior.nc") as file:
        assert file.attrs["seed"] == "0"
        chains = told["ensembles"] * told["walkers"]
        drawn = np.asarray(file[f"posterior/{NAMES[0]}"])
        assert drawn.shape == (chains, told["steps"])
    page = (folder / "report.html").read_text()
    for words in ("Posterior", "Corner", "Traces", "The posterior has converged", "R-hat"):
        assert words in page


def test_the_table_says_what_the_gate_says(bench, capsys):
    arguments = [str(path) for path in bench.paths]
    assert main(["identify", *arguments, "--posterior", "--steps", "200"]) == 3
    said = " ".join(capsys.readouterr().out.split())
    assert "Not converged: run longer (estimated" in said and "R-hat" in said


def test_without_the_option_there_is_no_posterior(bench, tmp_path, capsys):
    arguments = [str(path) for path in bench.paths]
    assert main(["identify", *arguments, "--json", "--out", str(tmp_path)]) == 0
    assert "posterior" not in json.loads(capsys.readouterr().out)
    assert not (tmp_path / "posterior.nc").exists()


@pytest.mark.slow
def test_the_static_stiffness_of_the_real_springs(real_records, tmp_path):
    """Four decays of the stiff spring together: 24.25 ± 0.14 N/m hung on it at rest."""
    paths = sorted((real_records / "spring_mass").glob("stiff_*_run*.toml"))
    assert len(paths) == 4
    began = time.process_time()
    arguments = ["identify", *map(str, paths), "--posterior", "--out", str(tmp_path), "--quiet"]
    assert main(arguments) == 0
    assert time.process_time() - began < 60
    told = json.loads((tmp_path / "fit.json").read_text())["posterior"]
    one = told["parameters"][NAMES[0]]
    assert one["low"] <= 24.25 <= one["high"]
    assert 0.02 < one["std"] < 0.14
    assert told["converged"] and "misfit that is not noise" in told["laplace"]["sentence"]
