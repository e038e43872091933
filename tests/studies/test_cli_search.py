"""`supple search`: its files, its bytes, a kill and what comes after, and bad storages."""

import json
import os
import signal
import sqlite3
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import pytest

from supple.studies import cli

RIG = '[rig]\nkind = "robot"\nmodel = "pinned_wrist"\npreset = "robo_v_sleeve_50"\n'
DRIVE = (
    '[drive]\nkind = "impact"\nforce = -1600.0\nduration = 0.005\n'
    "[times]\nduration = 2.0\nsample_rate = 1000.0\n"
)
SPEC = (
    '[sweep]\nrig = "rig.toml"\ndrive = "impact.toml"\n'
    'of = "clubhead:acceleration:collet"\nwindow = [0.005, 2.0]\n'
    '[axes]\nwrist_stiffness = { low = 20.0, high = 2000.0, scale = "log" }\n'
    "wrist_damping = { low = 0.5, high = 100.0, scale = 'log' }\n"
    "[search]\ntrials = 96\nbatch = 32\n"
)


def write(folder: Path, more: str = "") -> list[str]:
    folder.mkdir(exist_ok=True)
    (folder / "rig.toml").write_text(RIG)
    (folder / "impact.toml").write_text(DRIVE)
    (folder / "spec.toml").write_text(SPEC + more)
    return ["search", str(folder / "spec.toml"), "--out", str(folder / "out")]


def told(folder: Path) -> dict:
    """What a search says, without what may differ from run to run."""
    result = json.loads((folder / "out" / "search.json").read_text())
    for key in ("resumed", "seconds"):
        del result["provenance"][key]
    result["provenance"]["inputs"] = list(result["provenance"]["inputs"].values())
    return result


def test_a_search_and_its_files(tmp_path, capsys):
    assert cli.main([*write(tmp_path), "--json"]) == 0
    said = capsys.readouterr()
    result = json.loads(said.out)
    assert said.err == ""
    names = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert names == ["report.html", "search.db", "search.json"]
    assert result == json.loads((tmp_path / "out" / "search.json").read_text())
    assert result["trials"] == {
        "done": 96, "usable": 96, "beyond_limits": 0, "without_score": 0,
    }  # fmt: skip
    best = result["best"]
    assert best == result["front"][0] and len(result["front"]) == 1
    assert 20.0 <= best["design"]["wrist_stiffness"] <= 2000.0
    assert result["scores"]["rms"]["unit"] == "m/s^2"
    assert sum(result["importances"]["rms"].values()) == pytest.approx(1.0)
    page = (tmp_path / "out" / "report.html").read_text()
    assert "Of 96 designs the best is wrist stiffness" in page and "<script" not in page
    assert page.count("data:image/svg+xml;base64,") == 3 and "http://" not in page


def test_the_same_seed_gives_the_same_bytes(tmp_path, capsys):
    folders = [tmp_path / name for name in "abc"]
    for folder, seed in zip(folders, ("4", "4", "5")):
        assert cli.main([*write(folder), "--seed", seed, "--quiet"]) == 0
    assert capsys.readouterr().out == ""
    first, again, other = (json.dumps(told(folder)).encode() for folder in folders)
    assert first == again != other


def test_several_objectives_make_a_front_within_the_limits(tmp_path, capsys):
    more = (
        'sampler = "nsga2"\nobjectives = { rms = "minimize", peak = "minimize" }\n'
        "constraints = { grip_displacement_peak = { max = 4e-4 } }\n"
        'storage = "journal:kept.log"\n'
    )
    assert cli.main(write(tmp_path, more)) == 0
    said = capsys.readouterr().out
    assert "96 designs of rig.toml by 'nsga2'" in said
    assert max(map(len, said.splitlines())) <= 80
    result = told(tmp_path)
    front = [one["scores"] for one in result["front"]]
    assert result["best"] is None and len(front) > 2
    for one, after in pairwise(front):
        assert one["rms"] < after["rms"] and one["peak"] > after["peak"]
    assert all(one["grip_displacement_peak"] <= 4e-4 for one in front)
    assert result["trials"]["beyond_limits"] > 0
    assert (tmp_path / "out" / "kept.log").is_file()
    page = (tmp_path / "out" / "report.html").read_text()
    assert "Pareto front" in page and "at most 0.0004" in page.replace("4·10⁻⁴", "0.0004")


def test_a_catalogue_is_searched_and_named(tmp_path):
    parts = "part,sleeve_stiffness\nsoft,50000\nfirm,100000\nhard,200000\n"
    called = write(tmp_path, 'catalogue = "sleeves.csv"\n')
    (tmp_path / "sleeves.csv").write_text(parts)
    assert cli.main([*called, "--quiet"]) == 0
    result = told(tmp_path)
    best = result["best"]
    assert best["parts"]["sleeves"] in ("soft", "firm", "hard")
    known = dict(zip(("soft", "firm", "hard"), (5e4, 1e5, 2e5)))
    assert best["design"]["sleeve_stiffness"] == known[best["parts"]["sleeves"]]
    assert len(result["provenance"]["inputs"]) == 4


def test_no_usable_design_is_told_and_not_trusted(tmp_path, capsys):
    more = "constraints = { peak = { max = 1e-3 } }\n"
    assert cli.main(write(tmp_path, more)) == 3
    assert "No design keeps all limits" in capsys.readouterr().out
    result = told(tmp_path)
    assert result["status"] == "infeasible" and result["front"] == []
    assert "None of 96 designs" in (tmp_path / "out" / "report.html").read_text()


KILLED = """
import os, signal, sys
from supple.optimize.search_storage import _Database
from supple.studies import cli

write, written = _Database._write, []

def until_killed(self, connection, trials, first):
    write(self, connection, trials, first)
    written.append(first)
    if len(written) == 4:
        os.kill(os.getpid(), signal.SIGKILL)

_Database._write = until_killed
sys.exit(cli.main(sys.argv[1:]))
"""
"""A search whose process is killed with its fourth batch written and not yet kept."""


@pytest.mark.slow
def test_a_killed_search_is_taken_up_and_ends_the_same(tmp_path):
    folders = [tmp_path / "whole", tmp_path / "killed"]
    environment = os.environ | {"XDG_CACHE_HOME": str(tmp_path / "cache")}

    def run(folder: Path, *program: str) -> int:
        words = [*write(folder), "--trials", "640", "--quiet"]
        return subprocess.run([sys.executable, *program, *words], env=environment).returncode

    assert run(folders[0], "-m", "supple.studies.cli") == 0
    assert run(folders[1], "-c", KILLED) == -signal.SIGKILL
    with sqlite3.connect(folders[1] / "out" / "search.db") as database:
        left = database.execute("select state, count(*) from trials group by state").fetchall()
    assert left == [("COMPLETE", 96)]
    assert run(folders[1], "-m", "supple.studies.cli") == 0
    assert told(folders[1]) == told(folders[0])
    resumed = json.loads((folders[1] / "out" / "search.json").read_text())["provenance"]["resumed"]
    assert resumed == 96


@pytest.mark.parametrize(
    ("storage", "words"),
    [
        ("nonsense", "expected one that can be opened"),
        ("postgresql://nobody@127.0.0.1:1/none", "expected one that can be opened"),
        ("sqlite:////proc/none/search.db", "expected one that can be opened"),
    ],
)
def test_a_storage_that_cannot_be_opened_is_refused_in_one_line(storage, words, tmp_path, capsys):
    assert cli.main([*write(tmp_path), "--storage", storage]) == 2
    said = capsys.readouterr()
    assert said.out == "" and len(said.err.splitlines()) == 1
    assert words in said.err and "Mend:" in said.err and "spec.toml" in said.err


def test_a_gaussian_process_says_what_it_lacks(tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "torch", None)
    assert cli.main(write(tmp_path, 'sampler = "gp"\n')) == 2
    assert "pip install 'supple[gp]'" in capsys.readouterr().err
