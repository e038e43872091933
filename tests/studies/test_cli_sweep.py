"""`supple sweep`: its files, every form of an axis, kills and resumption, and bad specs."""

import io
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from scipy.io import netcdf_file

from supple.studies import cli

RIG = '[rig]\nkind = "robot"\nmodel = "pinned_wrist"\npreset = "robo_v_sleeve_50"\n'
DRIVE = (
    '[drive]\nkind = "impact"\nforce = -1600.0\nduration = 0.005\n'
    "[times]\nduration = 2.0\nsample_rate = 1000.0\n"
)
SWEEP = (
    '[sweep]\nrig = "rig.toml"\ndrive = "impact.toml"\n'
    'scores = ["rms", "log_decrement", "peak"]\n'
    'of = "clubhead:acceleration:collet"\nwindow = [0.005, 2.0]\n[axes]\n'
)
ONE_SCORE = SWEEP.replace('["rms", "log_decrement", "peak"]', '["rms"]')
AXES = (
    "wrist_stiffness = { start = 50.0, step = 75.0, count = 4 }\n"
    "wrist_damping = { low = 2.0, high = 32.0, count = 5, scale = 'log' }\n"
    "sleeve_damping_upper = { low = 1000.0, high = 2000.0, count = 3 }\n"
    "collet_inertia = { values = [0.02, 0.01] }\n"
)
CHAIN = (
    '[rig]\nkind = "chain"\n[masses.cart]\nmass = 0.5\n'
    '[links.spring]\nbetween = ["ground", "cart"]\nstiffness = 50.0\ndamping = 0.3\n'
)
RELEASE = (
    '[drive]\nkind = "release"\nplace = "cart"\ndisplacement = 0.1\n'
    "[times]\nduration = 2.0\nsample_rate = 100.0\n"
)


def write(folder: Path, spec: str = SWEEP + AXES, rig: str = RIG, drive: str = DRIVE) -> list[str]:
    (folder / "rig.toml").write_text(rig)
    (folder / "impact.toml").write_text(drive)
    (folder / "spec.toml").write_text(spec)
    return ["sweep", str(folder / "spec.toml")]


def read(path: Path) -> dict[str, np.ndarray]:
    with netcdf_file(io.BytesIO(path.read_bytes())) as file:
        return {name: np.array(one[:]) for name, one in file.variables.items()}


def test_a_map_and_its_summary(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    called = write(tmp_path)
    assert cli.main([*called, "--out", str(tmp_path / "out"), "--json"]) == 0
    said = capsys.readouterr()
    result = json.loads(said.out)
    assert result == json.loads((tmp_path / "out" / "map.json").read_text())
    pictures = [
        f"surface_{s}.{kind}" for s in ("log_decrement", "peak", "rms") for kind in ("png", "svg")
    ]
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        "map.json", "map.nc", "report.html", "surface.html", *pictures,
    ]  # fmt: skip
    assert result["files"] == ["report.html", "surface.html", *pictures]
    held = read(tmp_path / "out" / "map.nc")
    assert held["rms"].shape == (4, 5, 3, 2)
    np.testing.assert_allclose(held["wrist_stiffness"], [50.0, 125.0, 200.0, 275.0])
    np.testing.assert_allclose(held["wrist_damping"], [2.0, 4.0, 8.0, 16.0, 32.0])
    np.testing.assert_allclose(held["sleeve_damping_upper"], [1000.0, 1500.0, 2000.0])
    np.testing.assert_allclose(held["collet_inertia"], [0.02, 0.01])
    lowest = result["scores"]["rms"]["lowest"]
    assert lowest["value"] == held["rms"].min()
    at = np.unravel_index(np.argmin(held["rms"]), held["rms"].shape)
    assert list(lowest["design"].values()) == [held[n][i] for n, i in zip(result["axes"], at)]
    assert np.ptp(held["rms"], axis=2).min() > 0  # the upper damping alone is felt
    named = {Path(name).name for name in result["provenance"]["inputs"]}
    assert named == {"spec.toml", "rig.toml", "impact.toml"}
    assert result["regions"]["overdamped"] == held["overdamped"].sum()


def test_one_design_is_the_motion_that_simulate_writes(tmp_path: Path) -> None:
    called = write(tmp_path, SWEEP + "wrist_stiffness = { values = [300.0] }\n")
    assert cli.main([*called, "--out", str(tmp_path), "--quiet"]) == 0
    drive, rig = str(tmp_path / "impact.toml"), str(tmp_path / "rig.toml")
    asked = ["--sensor", "clubhead:acceleration:collet", "--out", str(tmp_path), "--quiet"]
    assert cli.main(["simulate", "--rig", rig, "--drive", drive, *asked]) == 0
    table = np.genfromtxt(tmp_path / "motion.csv", delimiter=",", names=True)
    inside = table["time"] >= 0.005
    curve = table["clubheadaccelerationcollet"][inside]
    found = read(tmp_path / "map.nc")
    assert found["rms"][0] == pytest.approx(np.sqrt(np.mean(curve**2)), rel=1e-9)
    assert found["peak"][0] == pytest.approx(np.abs(curve).max(), rel=1e-9)


def test_where_the_grip_goes_too_far_is_marked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    limited = ONE_SCORE.replace("[axes]", "grip_limit = 4e-4\n[axes]")
    axes = (
        "wrist_stiffness = { start = 50.0, step = 75.0, count = 4 }\n"
        "sleeve_damping = { low = 100.0, high = 4000.0, count = 9 }\n"
    )
    called = write(tmp_path, limited + axes)
    assert cli.main([*called, "--out", str(tmp_path)]) == 0
    held, result = read(tmp_path / "map.nc"), json.loads((tmp_path / "map.json").read_text())
    beyond = held["grip_displacement_peak"] > 4e-4
    assert 0 < beyond.sum() < beyond.size
    np.testing.assert_array_equal(held["grip_beyond"] > 0, beyond)
    assert result["regions"]["grip_beyond"] == beyond.sum() and result["grip_limit"] == 4e-4
    told = f"The grip moves more than 4·10⁻⁴ m in {beyond.sum()} designs."
    assert told in " ".join(capsys.readouterr().out.split()), told
    assert "grip beyond its limit" in (tmp_path / "surface_rms.svg").read_text()


@pytest.mark.parametrize("dotted", ["'links.spring.damping'", "links.spring.damping"])
def test_a_chain_in_words(dotted: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    spec = SWEEP.replace("clubhead:acceleration:collet", "cart:position:absolute")
    axis = f"{dotted} = {{ start = 0.1, step = 2.0, count = 8 }}\n"
    called = write(tmp_path, spec + axis, CHAIN, RELEASE)
    assert cli.main(called) == 0
    said = capsys.readouterr().out
    assert "8 designs of rig.toml" in said and "overdamped in 3 designs" in said
    assert max(map(len, said.splitlines())) <= 80


def test_a_killed_sweep_is_taken_up_and_ends_the_same(tmp_path: Path) -> None:
    grid = (
        "wrist_stiffness = { start = 50.0, step = 25.0, count = 100 }\n"
        "wrist_damping = { start = 2.0, step = 2.0, count = 75 }\n"
        "collet_inertia = { values = [0.01, 0.02, 0.03, 0.04] }\n"
    )
    spec = write(tmp_path, ONE_SCORE + grid)[1]
    environment = os.environ | {"XDG_CACHE_HOME": str(tmp_path / "cache")}

    def begin(out: str, *more: str) -> subprocess.Popen[str]:
        words = [sys.executable, "-m", "supple.studies.cli", "sweep", spec, "--out", out, *more]
        return subprocess.Popen(
            words, cwd=tmp_path, env=environment, stdout=subprocess.PIPE, text=True
        )

    with begin("whole", "--quiet") as whole_run:
        assert whole_run.wait() == 0
    held, unfinished = -1, tmp_path / "killed" / "map.unfinished.nc"
    with begin("killed", "--quiet") as killed:
        while held < 3:
            assert killed.poll() is None, "it ended before it could be killed"
            time.sleep(0.005)
            try:
                held = int(read(unfinished)["tile_done"].sum())
            except (OSError, TypeError, ValueError, IndexError):
                held = -1  # not made yet
        killed.send_signal(signal.SIGKILL)
        assert killed.wait() == -signal.SIGKILL
    assert not (tmp_path / "killed" / "map.nc").exists()
    with begin("killed", "--json") as again:
        result = json.loads(again.communicate()[0])
    assert again.returncode == 0
    assert 3 <= result["tiles"]["resumed"] < result["tiles"]["all"]
    whole = (tmp_path / "whole" / "map.nc").read_bytes()
    assert (tmp_path / "killed" / "map.nc").read_bytes() == whole
    assert not unfinished.exists()


def test_a_changed_input_begins_anew(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    called = [*write(tmp_path, ONE_SCORE + AXES), "--out", str(tmp_path), "--json"]
    assert cli.main(called) == 0
    # as a kill between the last tile and the renaming leaves it
    (tmp_path / "map.nc").rename(tmp_path / "map.unfinished.nc")
    assert cli.main(called) == 0
    first, again = (json.loads(text) for text in _documents(capsys.readouterr().out))
    assert (first["tiles"]["resumed"], again["tiles"]["resumed"]) == (0, 1)
    (tmp_path / "map.nc").rename(tmp_path / "map.unfinished.nc")
    (tmp_path / "rig.toml").write_text(RIG + "[parameters]\nclubhead_mass = 0.25\n")
    assert cli.main(called) == 0
    changed = json.loads(capsys.readouterr().out)
    assert changed["tiles"]["resumed"] == 0
    assert changed["scores"]["rms"]["mean"] != first["scores"]["rms"]["mean"]


def _documents(text: str) -> list[str]:
    first, second = text.split("\n}\n", 1)
    return [first + "\n}", second]


LAW = '[[laws]]\nlaw = "coulomb_friction"\nplace = "wrist"\n[laws.parameters]\ntorque = 0.4\n'
WRIST = "wrist_damping = { values = [2.0] }\n"
BAD = {
    "no [sweep]": ("[axes]\n" + WRIST, RIG, "spec.toml: [sweep]"),
    "no axes": (SWEEP, RIG, "spec.toml: [axes]"),
    "no rig": (SWEEP.replace("rig.toml", "rug.toml") + WRIST, RIG, "rug.toml"),
    "no drive": (SWEEP.replace("impact.toml", "blow.toml") + WRIST, RIG, "blow.toml"),
    "an unknown key": (SWEEP.replace("window", "windows") + WRIST, RIG, "[sweep] windows"),
    "an unknown score": (SWEEP.replace("rms", "rsm") + WRIST, RIG, "Mend: write 'rms'"),
    "a score twice": (SWEEP.replace('"peak"', '"rms"') + WRIST, RIG, "[sweep] scores"),
    "an unknown parameter": (SWEEP + WRIST.replace("wrist", "waist"), RIG, "'wrist_damping'"),
    "an unknown place": (SWEEP.replace("clubhead:", "knee:") + WRIST, RIG, "[sweep] of"),
    "a window upside down": (SWEEP.replace("[0.005, 2.0]", "[2.0, 1.0]") + WRIST, RIG, "window"),
    "a window without samples": (
        SWEEP.replace("[0.005, 2.0]", "[5.0, 6.0]") + WRIST,
        RIG,
        "spec.toml: [sweep] window",
    ),
    "half a form": (SWEEP + "wrist_damping = { start = 2.0, count = 3 }\n", RIG, "these forms"),
    "two forms": (
        SWEEP + "wrist_damping = { start = 2.0, step = 1.0, count = 3, high = 4.0 }\n",
        RIG,
        "[axes] wrist_damping",
    ),
    "no values": (SWEEP + "wrist_damping = { values = [] }\n", RIG, "at least one value"),
    "a count of 0": (
        SWEEP + "wrist_damping = { start = 2.0, step = 1.0, count = 0 }\n",
        RIG,
        "[axes.wrist_damping] count",
    ),
    "text for a value": (SWEEP + 'wrist_damping = { values = ["a"] }\n', RIG, "a number"),
    "a logarithm of nothing": (
        SWEEP + "wrist_damping = { low = 0.0, high = 3.0, count = 3, scale = 'log' }\n",
        RIG,
        "above 0",
    ),
    "a mass of nothing": (SWEEP + "clubhead_mass = { values = [0.0] }\n", RIG, "above 0 kg"),
    "a stiffness below 0": (
        SWEEP + "wrist_stiffness = { start = 50.0, step = -75.0, count = 3 }\n",
        RIG,
        "at least 0 N m/rad",
    ),
    "too many designs": (
        SWEEP
        + "wrist_stiffness = { start = 1.0, step = 1.0, count = 100000 }\n"
        + "wrist_damping = { start = 1.0, step = 1.0, count = 100000 }\n",
        RIG,
        "spec.toml: [axes]",
    ),
    "a law that acts": (SWEEP + WRIST, RIG + LAW, "rig.toml: [[laws]]"),
    "a limit of no grip": (
        ONE_SCORE.replace("clubhead:acceleration:collet", "cart:position:absolute").replace(
            "[axes]", "grip_limit = 1e-3\n[axes]"
        )
        + "'masses.cart.mass' = { values = [0.5] }\n",
        CHAIN,
        "[sweep] grip_limit",
    ),
    "a limit of nothing": (
        ONE_SCORE.replace("[axes]", "grip_limit = 0.0\n[axes]") + WRIST,
        RIG,
        "[sweep] grip_limit: expected a number greater than 0",
    ),
    "no grip": (
        SWEEP.replace("rms", "grip_displacement_peak").replace(
            "clubhead:acceleration:collet", "cart:position:absolute"
        )
        + "'masses.cart.mass' = { values = [0.5] }\n",
        CHAIN,
        "a chain, which has no grip",
    ),
}


@pytest.mark.parametrize("case", list(BAD))
def test_a_bad_spec_is_refused_in_one_line(
    case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spec, rig, told = BAD[case]
    called = write(tmp_path, spec, rig, RELEASE if rig is CHAIN else DRIVE)
    assert cli.main([*called, "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr()
    assert said.out == "" and len(said.err.splitlines()) == 1
    assert told in said.err and "Mend:" in said.err
    assert not (tmp_path / "out").exists()


PEAK = """
import resource, subprocess, sys
subprocess.run(sys.argv[1:], check=True)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
"""


@pytest.mark.slow
def test_a_map_of_75_by_75_by_75_with_its_figures_stays_below_600_mb(tmp_path: Path) -> None:
    """With its code compiled on disk, by a smaller map before it."""
    environment = os.environ | {"XDG_CACHE_HOME": str(tmp_path / "cache")}
    environment.pop("JAX_COMPILATION_CACHE_DIR", None)
    most, out = 0.0, str(tmp_path / "out")
    for count in (9, 75):
        grid = (
            f"wrist_stiffness = {{ start = 50.0, step = 75.0, count = {count} }}\n"
            f"wrist_damping = {{ start = 2.0, step = 2.0, count = {count} }}\n"
            f"collet_inertia = {{ start = 0.002, step = 0.001, count = {count} }}\n"
        )
        spec = write(tmp_path, SWEEP + grid)[1]
        words = [sys.executable, "-m", "supple.studies.cli", "sweep", spec, "--out", out, "--quiet"]
        # asked of a small process between, since a child's peak counts its parent's at the fork
        asked = [sys.executable, "-c", PEAK, *words]
        run = subprocess.run(asked, env=environment, capture_output=True, text=True, check=True)
        most = float(run.stdout.split()[-1]) * (1 if sys.platform == "darwin" else 1024)
    assert most < 600e6, f"{most / 1e6:.0f} MB"
    assert (tmp_path / "out" / "surface.html").stat().st_size < 8_000_000
