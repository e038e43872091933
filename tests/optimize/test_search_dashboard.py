"""optuna-dashboard opens the storages that a search leaves: both kinds, served on loopback."""

import json
import threading
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any
from wsgiref.simple_server import WSGIRequestHandler, make_server

import optuna
import optuna.storages.journal
import pytest

from supple.optimize.search import search
from tests.optimize.test_search_gp import TASK

dashboard = pytest.importorskip("optuna_dashboard")
ASKED = replace(TASK, sampler="nsga2", trials=24, batch=8)


class Silent(WSGIRequestHandler):
    def log_message(self, format: str, *args: Any) -> None:
        pass


@contextmanager
def served(storage: Any) -> Iterator[str]:
    """The address of a dashboard of its own."""
    with make_server("127.0.0.1", 0, dashboard.wsgi(storage), handler_class=Silent) as server:
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()
        thread.join()


def asked(address: str) -> Any:
    with urllib.request.urlopen(address, timeout=20) as answer:
        return json.loads(answer.read())


@pytest.mark.parametrize("kind", ["sqlite", "journal"])
def test_the_dashboard_shows_every_trial_with_its_parameters(kind, tmp_path: Path):
    where = f"sqlite:///{tmp_path}/a.db" if kind == "sqlite" else f"journal:{tmp_path}/a.log"
    found = search(ASKED, where, "one")
    storage: Any = where
    if kind == "journal":
        backend = optuna.storages.journal.JournalFileBackend(f"{tmp_path}/a.log")
        storage = optuna.storages.JournalStorage(backend)
    with served(storage) as address:
        studies = asked(f"{address}/api/studies")["study_summaries"]
        assert [one["study_name"] for one in studies] == ["one"]
        told = asked(f"{address}/api/studies/{studies[0]['study_id']}?after=0")
    trials = told["trials"]
    assert len(trials) == 24 and {one["state"] for one in trials} == {"Complete"}
    for one, draw, value in zip(trials, found.draws, found.scores["rms"]):
        shown = {each["name"]: float(each["param_internal_value"]) for each in one["params"]}
        assert shown == pytest.approx(draw)
        assert float(one["values"][0]) == pytest.approx(value)
