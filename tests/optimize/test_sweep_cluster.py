"""A map by a real cluster: a scheduler and workers of their own on loopback, one of them killed."""

import json
import os
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from supple.model.chain import Chain
from supple.model.drives import release
from supple.model.linear import Port
from supple.optimize import sweep_cluster
from supple.optimize.sweep import TILE, Axis, SweepTask, blank_sheet, sweep
from supple.optimize.sweep_cluster import cluster_at
from supple.optimize.sweep_file import open_sheet
from supple.studies import cli

pytest.importorskip("distributed")
NUMBERS = {
    "masses.cart.mass": 0.5,
    "links.spring.stiffness": 200.0,
    "links.spring.damping": 0.3,
}
AXES = (
    Axis("links.spring.stiffness", np.linspace(50.0, 400.0, 192), "N/m"),
    Axis("links.spring.damping", np.linspace(0.1, 40.0, 176), "N s/m"),
)
TASK = SweepTask(
    Chain(("cart",), (("spring", "ground", "cart"),)), NUMBERS, release("cart", 0.1),
    np.arange(1000) / 500.0, (0.0, 2.0), Port("cart", "position"),
    ("rms", "log_decrement", "peak"), AXES,
)  # fmt: skip
WORKER = ("dask_worker", "--no-nanny", "--nthreads", "1", "--no-dashboard")


def begin(what: tuple[str, ...], folder: Path) -> subprocess.Popen[bytes]:
    words = [sys.executable, "-m", f"distributed.cli.{what[0]}", *what[1:]]
    words += ["--host", "127.0.0.1", "--scheduler-file", str(folder / "scheduler.json")]
    told = os.environ | {
        "DASK_DISTRIBUTED__WORKER__MEMORY__TERMINATE": "False",
        "DASK_TEMPORARY_DIRECTORY": str(folder),
    }
    with (folder / "said.txt").open("ab") as said:
        return subprocess.Popen(words, cwd=folder, env=told, stdout=said, stderr=said)


@pytest.fixture(scope="module")
def cluster(tmp_path_factory) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """The address of a scheduler, and its two workers, each a process."""
    from distributed import Client

    folder = tmp_path_factory.mktemp("cluster")
    scheduler = begin(("dask_scheduler", "--port", "0", "--no-dashboard"), folder)
    workers = [begin(WORKER, folder) for _ in range(2)]
    try:
        with Client(scheduler_file=str(folder / "scheduler.json"), timeout=60) as client:
            client.wait_for_workers(2, timeout=60)
        address = address_of(folder)
        assert "127.0.0.1" in address
        yield address, workers
    finally:
        for one in (*workers, scheduler):
            one.kill()
            one.wait()


def test_a_killed_worker_loses_nothing_and_doubles_nothing(cluster, tmp_path):
    address, processes = cluster
    alone, path = open_sheet(tmp_path / "alone" / "map.nc", TASK, "m", {})
    sweep(TASK, alone)
    together, other = open_sheet(tmp_path / "together" / "map.nc", TASK, "m", {})
    seen = Counter()

    def tell(done, tiles):
        if done == 4:
            processes[0].send_signal(signal.SIGKILL)
            assert processes[0].wait() == -signal.SIGKILL

    with cluster_at(address) as workers:

        def counted(work, tiles):
            for tile, result in workers(work, tiles):
                seen[tile] += 1
                yield tile, result

        found = sweep(TASK, together, tell, counted)
        assert found.resumed == 0 and TASK.tiles == 24
        assert seen == Counter(range(24))
        assert processes[1].poll() is None
    assert path.read_bytes() == other.read_bytes()


def test_a_map_that_was_left_is_taken_up_by_the_cluster(cluster):
    """Only the tiles that are missing are sent."""
    address, _ = cluster
    whole, sheet, asked = sweep(TASK), blank_sheet(TASK), []

    class Left(Exception):
        pass

    def stop(done, tiles):
        if done == 20:
            raise Left

    with pytest.raises(Left):
        sweep(TASK, sheet, stop)
    with cluster_at(address) as workers:
        rest = sweep(
            TASK, sheet, None, lambda work, tiles: asked.extend(tiles) or workers(work, tiles)
        )
    assert asked == [20, 21, 22, 23] and rest.resumed == 20
    np.testing.assert_array_equal(rest.scores["rms"], whole.scores["rms"])


def test_what_a_worker_refuses_is_told_in_its_words(cluster):
    address, _ = cluster
    loose = replace(
        TASK,
        mechanism=Chain(("cart", "loose"), (("spring", "ground", "cart"),)),
        numbers=NUMBERS | {"masses.loose.mass": 1.0, "links.spring.stiffness": 0.0},
        axes=(Axis("masses.cart.mass", np.ones(2)),),
    )
    with cluster_at(address) as workers, pytest.raises(ValueError, match="balance"):
        sweep(loose, None, None, workers)


def test_workers_of_another_version_are_refused(cluster, monkeypatch):
    monkeypatch.setattr(sweep_cluster, "__version__", "0.0.0")
    with (
        cluster_at(cluster[0]) as workers,
        pytest.raises(ValueError, match="one version everywhere"),
    ):
        sweep(TASK, None, None, workers)


def test_a_cluster_that_is_not_there_or_empty_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(sweep_cluster, "CONNECT", 0.5)
    monkeypatch.setattr(sweep_cluster, "PATIENCE", 0.5)
    for address in ("tcp://127.0.0.1:1", "nonsense://x"):
        with (
            pytest.raises(ValueError, match=r"found none that answers.*Mend:"),
            cluster_at(address),
        ):
            pass
    scheduler = begin(("dask_scheduler", "--port", "0", "--no-dashboard"), tmp_path)
    try:
        address = address_of(tmp_path)
        monkeypatch.setattr(sweep_cluster, "CONNECT", 20.0)
        with pytest.raises(ValueError, match=r"expected workers.*found none for 0.5 s"):
            with cluster_at(address):
                pass
    finally:
        scheduler.kill()
        scheduler.wait()


def address_of(folder: Path) -> str:
    for _ in range(1200):
        try:
            return json.loads((folder / "scheduler.json").read_text())["address"]
        except (OSError, ValueError):
            time.sleep(0.05)
    raise AssertionError((folder / "said.txt").read_text())


def test_a_scheduler_that_ends_on_the_way_is_told_and_what_is_done_stays(tmp_path, monkeypatch):
    scheduler = begin(("dask_scheduler", "--port", "0", "--no-dashboard"), tmp_path)
    address = address_of(tmp_path)
    worker = begin(WORKER, tmp_path)
    sheet = blank_sheet(TASK)

    def tell(done, tiles):
        if done == 3:
            scheduler.kill()
            scheduler.wait()

    try:
        with pytest.raises(ValueError, match="goes on where this one stopped"):
            with cluster_at(address) as workers:
                sweep(TASK, sheet, tell, workers)
    finally:
        for one in (scheduler, worker):
            one.kill()
            one.wait()
    assert 3 <= sheet.done.sum() < 24
    assert np.isfinite(sheet.fields["rms"]).sum() == TILE * sheet.done.sum()


def test_the_library_that_is_missing_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ValueError, match=r"none installed.*pip install 'supple\[cluster\]'"):
        with cluster_at("tcp://127.0.0.1:1"):
            pass


SPEC = """
[sweep]
rig = "rig.toml"
drive = "drive.toml"
of = "cart:position:absolute"
scores = ["settling"]
[axes]
"links.spring.stiffness" = { start = 50.0, step = 5.0, count = 40 }
"links.spring.damping" = { start = 0.1, step = 0.5, count = 40 }
"""
RIG = """
[rig]
kind = "chain"
[masses.cart]
mass = 0.5
[links.spring]
between = ["ground", "cart"]
stiffness = 50.0
damping = 0.3
"""
DRIVE = """
[drive]
kind = "release"
place = "cart"
displacement = 0.1
[times]
duration = 2.0
sample_rate = 100.0
"""


def test_the_command_writes_the_same_bytes_with_a_cluster(cluster, tmp_path, capsys):
    for name, text in (("spec", SPEC), ("rig", RIG), ("drive", DRIVE)):
        (tmp_path / f"{name}.toml").write_text(text)
    called = ["sweep", str(tmp_path / "spec.toml"), "--quiet", "--out"]
    assert cli.main([*called, str(tmp_path / "alone")]) == 0
    assert cli.main([*called, str(tmp_path / "together"), "--cluster", cluster[0]]) == 0
    alone, together = (tmp_path / name / "map.nc" for name in ("alone", "together"))
    assert alone.read_bytes() == together.read_bytes()
    capsys.readouterr()
    elsewhere = [*called, str(tmp_path / "none"), "--cluster", "nonsense://x"]
    assert cli.main(elsewhere) == 2
    said = capsys.readouterr().err
    assert said.startswith("--cluster:") and len(said.splitlines()) == 1
    assert not (tmp_path / "none").exists()
