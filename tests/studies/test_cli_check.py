"""`supple check` and what all commands share: JSON alone, quiet, folders, exit codes, lightness."""

import json
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

import supple
from supple.studies import cli, terminal

SIDECAR = """\
[record]
rig = "rig.toml"
sample_rate = 200.0
split = "train"
[channels.push]
column = "f"
unit = "lbf"
role = "input"
quantity = "force"
place = "cart"
[channels.cart]
column = "x"
unit = "mm"
role = "response"
quantity = "position"
place = "cart"
noise = 0.01
[parameters]
"masses.cart.mass" = 0.2
"""

RIG = """\
[rig]
kind = "chain"
[masses.cart]
mass = 0.17
[links.spring]
between = ["ground", "cart"]
stiffness = 24.0
"""


@pytest.fixture
def bench(tmp_path: Path) -> Path:
    rng = np.random.default_rng(4)
    t = np.arange(2000) / 200.0
    moved = 5.0 * np.sin(2 * np.pi * 3.0 * t) + rng.normal(0.0, 0.2, len(t))
    push = np.sin(2 * np.pi * 3.0 * t + 0.3)
    rows = [f"{f:.5f},{x:.5f}" for f, x in zip(push, moved, strict=True)]
    (tmp_path / "bench.csv").write_text("\n".join(["f,x", *rows]))
    (tmp_path / "bench.toml").write_text(SIDECAR)
    (tmp_path / "rig.toml").write_text(RIG)
    return tmp_path / "bench.toml"


def test_json_and_nothing_else(bench: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["check", str(bench), "--json", "--seed", "7"]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    result = json.loads(said.out)
    (record,) = result["records"]
    assert (record["name"], record["test"], record["split"]) == ("bench", "driven", "train")
    assert (record["n_samples"], record["sample_rate"]) == (2000, 200.0)
    assert record["duration"] == pytest.approx(9.995)
    assert record["parameters"] == {"masses.cart.mass": 0.2}
    cart = record["channels"]["cart"]
    assert cart["unit"] == "m"
    assert cart["dominant_frequency"] == pytest.approx(3.0, abs=0.01)
    assert cart["noise_estimate"] == pytest.approx(2e-4, rel=0.2)
    assert cart["quantization_step"] is None
    assert cart["clipping"] is None
    assert record["channels"]["push"]["span"] == pytest.approx(2 * 4.4482216, rel=1e-3)
    assert any("states 1e-05" in sentence for sentence in record["warnings"])
    provenance = result["provenance"]
    assert provenance["seed"] == 7
    assert provenance["version"] == supple.__version__
    assert sorted(Path(name).name for name in provenance["inputs"]) == [
        "bench.csv", "bench.toml", "rig.toml",
    ]  # fmt: skip


def test_a_table_and_sentences(bench: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["check", str(bench), str(bench)]) == 0
    said = capsys.readouterr()
    assert said.out.count("position of cart") == 2
    assert "! cart has noise of about" in said.out
    assert max(map(len, said.out.splitlines())) <= 80


def test_quiet_writes_the_file_only(bench: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = bench.parent / "deep" / "out"
    assert cli.main(["check", str(bench), "--quiet", "--out", str(out)]) == 0
    assert capsys.readouterr().out == ""
    assert [file.name for file in out.iterdir()] == ["check.json"]
    assert json.loads((out / "check.json").read_text())["records"][0]["name"] == "bench"


def test_a_rig_overrides(bench: Path, capsys: pytest.CaptureFixture[str]) -> None:
    other = bench.parent / "other.toml"
    other.write_text(RIG.replace("cart", "trolley"))
    assert cli.main(["check", str(bench), "--rig", str(other)]) == 2
    assert "a place of other.toml" in capsys.readouterr().err


def test_no_rig_is_a_warning(bench: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bench.write_text(SIDECAR.replace('rig = "rig.toml"\n', ""))
    assert cli.main(["check", str(bench)]) == 0
    assert "No rig is named" in capsys.readouterr().out


def test_version_and_help(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["--version"]) == 0
    assert capsys.readouterr().out.strip() == supple.__version__
    assert cli.main([]) == 0
    assert "check" in capsys.readouterr().out
    assert CliRunner().invoke(terminal.app, ["check", "--help"]).exit_code == 0


@pytest.mark.parametrize(
    "arguments",
    [["chekc"], ["check"], ["check", "x.toml", "--sed", "1"], ["check", "x", "--seed", "a"]],
)
def test_a_wrong_call_is_one_line(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(arguments) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert len(said.err.splitlines()) == 1
    assert "Mend: " in said.err


def test_exit_codes_of_results(capsys: pytest.CaptureFixture[str]) -> None:
    session = terminal.Session(out=None, seed=0, json=True, quiet=False)

    def show(result: Mapping[str, Any]) -> None:
        raise AssertionError("JSON is printed alone")

    terminal.finish(session, {"status": "good"}, "a.json", show)
    assert json.loads(capsys.readouterr().out) == {"status": "good"}
    with pytest.raises(typer.Exit) as raised:
        terminal.finish(session, {"status": "flat"}, "a.json", show, trusted=False)
    assert raised.value.exit_code == terminal.NOT_TRUSTED
    assert json.loads(capsys.readouterr().out) == {"status": "flat"}


def test_a_defect_of_ours_is_not_hidden(bench: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise RuntimeError("a defect")

    monkeypatch.setattr("supple.studies.check.check_records", broken)
    with pytest.raises(RuntimeError):
        cli.main(["check", str(bench)])


def test_help_is_light() -> None:
    """Help loads the two libraries of the command line, with what they need, and no numerics."""
    code = (
        "import sys; before = set(sys.modules); from supple.studies.cli import main; "
        "code = main(['--help']); print(*set(sys.modules) - before, file=sys.stderr); "
        "sys.exit(code)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    loaded = {name.partition(".")[0] for name in done.stderr.split()} - sys.stdlib_module_names
    theirs = "annotated_doc click markdown_it mdurl pygments shellingham typing_extensions"
    strangers = loaded - {"supple", "typer", "rich", *theirs.split()}
    assert {"supple", "typer", "rich"} <= loaded
    assert {name for name in strangers if not name.startswith("_")} == set()
