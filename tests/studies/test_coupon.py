"""`supple coupon`: a made-up sweep to a law and a sleeve, doubts, and exit codes."""

import json
from pathlib import Path

import numpy as np
import pytest

from supple.studies import cli

REST, BRANCH, TAU = 230e3, 120e3, 0.03  # Pa, Pa, s
HEIGHT, DIAMETER = 0.008, 0.019
SIZES = """\
[sample]
height = 0.008
diameter = 0.019
[sleeve]
inner_diameter = 0.015
outer_diameter = 0.035
length = 0.250
compression = 0.33
"""


def modulus(frequency: float) -> complex:
    turns = 2j * np.pi * frequency * TAU
    return REST + BRANCH * turns / (1 + turns)


def write_run(path: Path, frequency: float, seed: int = 0, load_cut: float = np.inf) -> Path:
    """Steady state of the solid in closed form, with noise, in the manner of a machine."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(10 / frequency * 60 * frequency)) / (60 * frequency)
    turn = np.exp(2j * np.pi * frequency * t)
    stiffness = modulus(frequency) * np.pi / 4 * DIAMETER**2 / HEIGHT
    moved = 2e-3 * np.real(turn) - 2e-3 + rng.normal(0.0, 1e-6, len(t))
    load = 2e-3 * np.real(stiffness * turn) - stiffness.real * 2e-3 + rng.normal(0.0, 0.05, len(t))
    load = np.minimum(load, load_cut)
    rows = [f"{a:.7f},{1e3 * b:.6f},{c:.4f}" for a, b, c in zip(t, moved, load)]
    path.write_text("\n".join(["Time (s),Extension (mm),Load (N)", *rows]) + "\n")
    return path


@pytest.fixture
def sizes(tmp_path: Path) -> Path:
    (tmp_path / "sizes.toml").write_text(SIZES)
    return tmp_path / "sizes.toml"


def test_a_sweep_becomes_a_law_and_a_sleeve(
    tmp_path: Path, sizes: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    runs = [str(write_run(tmp_path / f"{f:g}.csv", f, i)) for i, f in enumerate((1, 2, 4, 8, 20))]
    out = tmp_path / "out"
    arguments = ["coupon", *runs, "--sizes", str(sizes), "--out", str(out), "--json"]
    assert cli.main(arguments) == 0
    said = capsys.readouterr()
    result = json.loads(said.out)
    assert said.err == "" and json.loads((out / "sleeve.json").read_text()) == result
    assert result["status"] == "good" and result["warnings"] == []
    law = result["law"]
    assert law["name"] == "zener"
    found = [law["rest"], law["branches"][0]["modulus"], law["branches"][0]["relaxation_time"]]
    for one, truth in zip(found, (REST, BRANCH, TAU)):
        assert abs(one["value"] - truth) < 4 * one["std"] < 0.3 * truth
    expected = modulus(4.0)
    sleeve, material = result["sleeve"], result["material"]
    assert material["storage"]["value"] == pytest.approx(expected.real, rel=0.01)
    width = np.pi / 2 * 0.0125 * 0.25 / 0.0067
    assert sleeve["stiffness"]["value"] == pytest.approx(expected.real * width, rel=0.01)
    omega = 2 * np.pi * 4.0
    assert sleeve["damping"]["value"] == pytest.approx(expected.imag * width / omega, rel=0.02)
    each = sleeve["parameters"]["sleeve_stiffness"]
    assert 4 * each["value"] == pytest.approx(sleeve["stiffness"]["value"])
    assert sleeve["factor"] == pytest.approx(20.7, abs=0.1)
    assert len(result["provenance"]["inputs"]) == 6
    run = result["files"][2]
    assert run["storage_modulus"]["value"] == pytest.approx(expected.real, rel=0.01)
    assert run["loss_modulus"]["value"] == pytest.approx(expected.imag, rel=0.03)


def test_one_run_speaks_for_its_own_frequency(
    tmp_path: Path, sizes: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = write_run(tmp_path / "run.csv", 4.0)
    assert cli.main(["coupon", str(run), "--sizes", str(sizes)]) == 0
    said = capsys.readouterr().out
    assert "the sleeve has" in said and "!" not in said
    far = ["coupon", str(run), "--sizes", str(sizes), "--frequency", "12"]
    assert cli.main(far) == 0
    assert "silicone depends on frequency" in " ".join(capsys.readouterr().out.split())


def test_without_sizes_there_is_a_stiffness_and_no_sleeve(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = write_run(tmp_path / "run.csv", 4.0)
    assert cli.main(["coupon", str(run), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["sleeve"] is None and result["law"] is None
    assert "sizes are not stated" in result["warnings"][0]
    assert result["material"]["storage"]["unit"] == "N/m"
    expected = modulus(4.0).real * np.pi / 4 * DIAMETER**2 / HEIGHT
    assert result["files"][0]["stiffness"]["value"] == pytest.approx(expected, rel=0.01)


def test_a_saturated_run_is_written_and_not_trusted(
    tmp_path: Path, sizes: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = write_run(tmp_path / "run.csv", 4.0, load_cut=-10.0)
    out = tmp_path / "out"
    assert cli.main(["coupon", str(run), "--sizes", str(sizes), "--out", str(out)]) == 3
    assert "flat tops" in " ".join(capsys.readouterr().out.split())
    result = json.loads((out / "sleeve.json").read_text())
    assert result["status"] == "in_doubt"
    assert result["files"][0]["status"] == "saturated"


@pytest.mark.parametrize(
    "text",
    [
        "",
        "Time (s),Load (N)\n0,1\n1,2\n",
        "Time (s),Extension (mm),Load (N)\n0,1,2\n",
        "Time (s),Extension (mm),Load (N)\n" + "".join(f"{i},{i},x\n" for i in range(20)),
        "Time (s),Extension (mm),Load (N)\n" + "".join(f"{i},1,{i}\n" for i in range(20)),
        "Time (s),Extension (mm),Load (N)\n" + "".join(f"{i * i},{i},{i}\n" for i in range(20)),
        "Time (s),Extension (kg),Load (N)\n" + "".join(f"{i},{i},{i}\n" for i in range(20)),
        "Time (s),Extension (mm),Load (N)\n0,0,0\n" + "".join(f"{i},9,9\n" for i in range(1, 20)),
    ],
)  # fmt: skip
def test_a_bad_file_is_one_line_and_exit_code_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str
) -> None:
    (tmp_path / "bad.csv").write_text(text)
    assert cli.main(["coupon", str(tmp_path / "bad.csv"), "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr()
    assert said.out == "" and len(said.err.splitlines()) == 1
    assert "bad.csv" in said.err and "Mend: " in said.err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "arguments", [["none.csv"], ["."], ["none.toml"], ["run.csv", "--frequency", "0"],
                  ["run.csv", "--sizes", "none.toml"]],
)  # fmt: skip
def test_a_wrong_call_is_one_line(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    write_run(tmp_path / "run.csv", 4.0)
    assert cli.main(["coupon", *arguments]) == 2
    said = capsys.readouterr()
    assert said.out == "" and len(said.err.splitlines()) == 1 and "Mend: " in said.err
