"""`supple sweep --posterior`: the optimum over draws, in words, in the picture, and refused."""

import json
from pathlib import Path

import h5netcdf
import numpy as np
import pytest

from supple.model.robot import PRESETS
from supple.studies import cli
from tests.studies.test_cli_sweep import DRIVE, ONE_SCORE, RIG

AXES = (
    "wrist_stiffness = { start = 20.0, step = 40.0, count = 9 }\n"
    "wrist_damping = { start = 1.0, step = 2.0, count = 9 }\n"
)
NUMBERS = PRESETS["robo_v_sleeve_50"]


def posterior(path: Path, names: tuple[str, ...], sign: float = 1.0) -> Path:
    """Draws of some numbers, spread by a factor of two, as `supple identify` writes them."""
    generator = np.random.default_rng(3)
    with h5netcdf.File(path, "w") as file:
        group = file.create_group("posterior")
        group.dimensions = {"chain": 4, "draw": 300}
        for name in names:
            values = sign * NUMBERS[name] * np.exp(generator.normal(0.0, 0.7, (4, 300)))
            group.create_variable(name, ("chain", "draw"), data=values)
        group.create_variable("offset[one]", ("chain", "draw"), data=np.ones((4, 300)))
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("spread")
    for name, text in (("rig", RIG), ("impact", DRIVE), ("spec", ONE_SCORE + AXES)):
        (found / f"{name}.toml").write_text(text)
    return found


def test_the_optimum_over_draws_in_numbers_words_and_picture(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = posterior(folder / "posterior.nc", ("sleeve_stiffness", "shaft_stiffness"))
    called = ["sweep", str(folder / "spec.toml"), "--posterior", str(file), "--out", str(folder)]
    assert cli.main(called) == 0
    result = json.loads((folder / "map.json").read_text())
    told = result["spread"]["scores"]["rms"]
    assert result["spread"]["draws"] == 100
    assert told["unknown"] == ["sleeve_stiffness", "shaft_stiffness"]
    for name in ("wrist_stiffness", "wrist_damping"):
        cloud = np.array(told["optima"][name])
        low, high = told["interval"][name]
        assert len(cloud) == 100 and 0.85 <= np.mean((cloud >= low) & (cloud <= high)) <= 0.95
        assert cloud.std() > 0
    assert 0 < told["price"]["mean"] <= told["price_of_nominal"]["mean"] + 1e-9
    assert str(file) in result["provenance"]["inputs"]
    said = " ".join(capsys.readouterr().out.split())
    assert told["sentence"] in said and "Given what is not known of sleeve stiffness" in said
    page = (folder / "report.html").read_text()
    assert told["sentence"] in page and "diamond: the best for all" in page
    drawn = (folder / "surface_rms.svg").read_text()
    assert "best of a draw" in drawn and "best for all draws" in drawn


@pytest.mark.parametrize(
    ("names", "sign", "words"),
    [
        (("wrist_stiffness", "wrist_damping"), 1.0, "other numbers than the map's axes"),
        ((), 1.0, "expected draws of the numbers of rig.toml, found offset[one]"),
        (("sleeve_stiffness",), -1.0, "draws above 0"),
    ],
)
def test_draws_that_cannot_be_used_are_refused_before_anything_is_simulated(
    names: tuple[str, ...], sign: float, words: str, folder: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    file = posterior(folder / "bad.nc", names, sign)
    out = folder / "bad"
    called = ["sweep", str(folder / "spec.toml"), "--posterior", str(file), "--out", str(out)]
    assert cli.main(called) == 2
    said = capsys.readouterr().err
    assert words in said and "Mend:" in said and len(said.splitlines()) == 1
    assert not out.exists()


@pytest.mark.parametrize("content", [None, b"no netCDF"])
def test_what_is_no_posterior_is_refused(
    content: bytes | None, folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "other.nc"
    if content is not None:
        file.write_bytes(content)
    assert cli.main(["sweep", str(folder / "spec.toml"), "--posterior", str(file)]) == 2
    assert "name the posterior.nc" in capsys.readouterr().err


def test_a_planar_rig_is_refused(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    planar = RIG.replace("[rig]", '[rig]\nfidelity = "planar"')
    for name, text in (("rig", planar), ("impact", DRIVE), ("spec", ONE_SCORE + AXES)):
        (tmp_path / f"{name}.toml").write_text(text)
    file = posterior(tmp_path / "posterior.nc", ("sleeve_stiffness",))
    assert cli.main(["sweep", str(tmp_path / "spec.toml"), "--posterior", str(file)]) == 2
    assert "small motions for --posterior" in capsys.readouterr().err
