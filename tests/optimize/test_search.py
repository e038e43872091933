"""A search: near the refined grid's optimum, the same whoever draws, in whole batches alone."""

import json
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import optuna
import optuna.storages.journal
import pytest
from optuna.distributions import CategoricalDistribution, FloatDistribution
from optuna.samplers import TPESampler
from optuna.samplers._tpe.parzen_estimator import _ParzenEstimator

from supple.model.drives import impact
from supple.model.linear import Port
from supple.model.robot import PRESETS, Robot
from supple.optimize import search as searching
from supple.optimize.search import SearchTask, search
from supple.optimize.search_samplers import CANDIDATES, Sampler, _Parzen, space_of
from supple.optimize.search_spec import Choice, Limit, Range
from supple.optimize.search_storage import BATCH, open_archive
from supple.optimize.sweep import Axis, SweepTask, score_designs, sweep

NUMBERS = PRESETS["robo_v_sleeve_50"]
ROBOT = Robot("pinned_wrist", tuple(NUMBERS))
RANGES = (
    Range("wrist_stiffness", 20.0, 2000.0, True, "N m/rad"),
    Range("wrist_damping", 0.5, 100.0, True, "N m s/rad"),
)
BASE = SweepTask(
    ROBOT,
    NUMBERS,
    impact("clubhead", -1600.0, 0.0, 0.005),
    np.arange(2000) / 1000.0,
    (0.005, 2.0),
    Port("clubhead", "acceleration", "collet"),
    ("rms",),
    tuple(Axis(one.name, np.array([one.low, one.high]), one.unit) for one in RANGES),
)
TASK = SearchTask(BASE, RANGES, (), (("rms", "minimize"),), trials=500)


def wanting(*scores: str, **others) -> SearchTask:
    return replace(TASK, sweep=replace(BASE, scores=scores), **others)


@pytest.fixture(scope="module")
def refined() -> float:
    """The lowest RMS of a grid that is made finer around its lowest point, five times."""
    low = np.log([one.low for one in RANGES])
    high = np.log([one.high for one in RANGES])
    best = np.inf
    for _ in range(5):
        grids = [np.exp(np.linspace(a, b, 25)) for a, b in zip(low, high)]
        axes = tuple(Axis(one.name, grid) for one, grid in zip(RANGES, grids))
        design, best = sweep(replace(BASE, axes=axes)).extreme("rms", lowest=True) or ({}, 0.0)
        at = np.log([design[one.name] for one in RANGES])
        part = (high - low) / 8
        low, high = at - part, at + part
    return best


def best(found: searching.Search) -> float:
    return float(found.scores["rms"][found.front[0]])


@pytest.mark.parametrize("sampler", ["tpe", "cmaes", "nsga2"])
def test_a_search_comes_within_one_percent_of_the_refined_grid(sampler, refined, tmp_path):
    task = replace(TASK, sampler=sampler, seed=3)
    found = search(task, f"sqlite:///{tmp_path}/search.db", "one")
    assert len(found.draws) == 500
    assert refined * (1 - 1e-9) <= best(found) <= 1.01 * refined


@pytest.mark.slow
@pytest.mark.parametrize("sampler", ["tpe", "cmaes"])
def test_it_does_so_from_every_one_of_twenty_seeds(sampler, refined, tmp_path):
    for seed in range(20):
        task = replace(TASK, sampler=sampler, seed=seed)
        found = search(task, f"journal:{tmp_path}/{seed}.log", "one")
        assert refined * (1 - 1e-9) <= best(found) <= 1.01 * refined, seed


def test_scores_are_those_of_the_sweep(tmp_path):
    found = search(wanting("rms", trials=30, batch=8), f"journal:{tmp_path}/a.log", "one")
    expected = score_designs(BASE, found.numbers)["rms"]
    np.testing.assert_allclose(found.scores["rms"], expected, rtol=1e-12)


STORAGES = ["sqlite:///{}/a.db", "journal:{}/a.log"]


@pytest.mark.parametrize("storage", STORAGES)
@pytest.mark.parametrize("sampler", ["tpe", "cmaes", "nsga2"])
def test_a_broken_search_goes_on_as_if_it_had_not_been(sampler, storage, tmp_path):
    task = replace(TASK, sampler=sampler, trials=150, batch=32)
    whole = search(task, storage.format(tmp_path / "whole"), "one")
    part = storage.format(tmp_path / "part")

    class Killed(Exception):
        pass

    def stop(done, of):
        if done == 64:
            raise Killed

    with pytest.raises(Killed):
        search(task, part, "one", tell=stop)
    rest = search(task, part, "one")
    assert rest.resumed == 64
    assert rest.draws == whole.draws
    np.testing.assert_array_equal(rest.scores["rms"], whole.scores["rms"])


@pytest.mark.parametrize("storage", STORAGES)
def test_what_is_stored_is_what_optuna_reads(storage, tmp_path):
    choice = Choice("sleeve", ("soft", "hard"), {"sleeve_stiffness": np.array([5e4, 2e5])}, {})
    task = wanting(
        "rms", "peak", "grip_displacement_peak",
        choices=(choice,), objectives=(("rms", "minimize"), ("peak", "maximize")),
        limits=(Limit("grip_displacement_peak", None, 4e-4),), trials=90, batch=32,
    )  # fmt: skip
    where = storage.format(tmp_path)
    found = search(task, where, "one")
    kept: str | optuna.storages.BaseStorage = where
    if where.startswith("journal:"):
        backend = optuna.storages.journal.JournalFileBackend(where.removeprefix("journal:"))
        kept = optuna.storages.JournalStorage(backend)
    study = optuna.load_study(study_name="one", storage=kept)
    trials = study.get_trials(deepcopy=False)
    assert [one.number for one in trials] == list(range(90))
    assert {one.state.name for one in trials} == {"COMPLETE"}
    assert [one.params for one in trials] == list(found.draws)
    np.testing.assert_array_equal([one.values[1] for one in trials], found.scores["peak"])
    grip = found.scores["grip_displacement_peak"]
    np.testing.assert_array_equal([o.user_attrs["grip_displacement_peak"] for o in trials], grip)
    excess = [one.constraints["grip_displacement_peak"] for one in trials]
    np.testing.assert_allclose(excess, grip / 4e-4 - 1.0, rtol=1e-12, atol=1e-15)
    assert 0 < found.usable.sum() < 90
    assert {one.number for one in study.best_trials} == set(found.front)


def test_the_front_is_what_nothing_usable_beats():
    losses = np.array([[1.0, 5.0], [2.0, 2.0], [3.0, 3.0], [4.0, 1.0], [0.0, 0.0], [2.0, 2.0]])
    task = wanting("rms", "peak", objectives=(("rms", "minimize"), ("peak", "maximize")))
    scores = {"rms": losses[:, 0], "peak": -losses[:, 1]}
    excess = np.array([0.0, 0.0, 0.0, 0.0, 0.5, 0.0])
    found = searching.Search(task, ({},) * 6, {}, scores, excess)
    assert found.front == [0, 1, 3]


def test_no_usable_design_makes_no_front(tmp_path):
    task = wanting(
        "rms", "peak", limits=(Limit("peak", None, 1e-3),), sampler="cmaes", trials=16, batch=8
    )
    found = search(task, f"journal:{tmp_path}/a.log", "one")
    assert found.front == [] and not found.usable.any() and (found.excess > 0).all()


@pytest.mark.parametrize("sampler", ["tpe", "cmaes", "nsga2"])
def test_a_limit_that_cuts_off_the_best_is_kept(sampler, tmp_path):
    """The freest optimum has a peak of about 870 m/s²."""
    limits = (Limit("peak", None, 700.0),)
    task = wanting("rms", "peak", limits=limits, sampler=sampler, trials=400)
    found = search(task, f"journal:{tmp_path}/a.log", "one")
    at = found.front[0]
    assert 640.0 < found.scores["peak"][at] <= 700.0
    usable = np.flatnonzero(found.usable)
    assert found.scores["rms"][at] == found.scores["rms"][usable].min()


def test_a_catalogue_gives_the_best_of_its_parts(tmp_path):
    generator = np.random.default_rng(1)
    stiffness = np.exp(generator.uniform(np.log(20.0), np.log(2000.0), 40))
    damping = np.exp(generator.uniform(np.log(0.5), np.log(100.0), 40))
    numbers = {"wrist_stiffness": stiffness, "wrist_damping": damping}
    parts = tuple(f"part {k}" for k in range(40))
    task = replace(TASK, ranges=(), choices=(Choice("wrist", parts, numbers, {}),), trials=320)
    found = search(task, f"journal:{tmp_path}/a.log", "one")
    every = score_designs(BASE, numbers)["rms"]
    assert found.draws[found.front[0]]["wrist"] == f"part {int(np.argmin(every))}"


@pytest.mark.parametrize("sampler", ["tpe", "cmaes", "nsga2"])
def test_a_batch_does_not_depend_on_which_were_drawn_before(sampler, tmp_path):
    task = replace(TASK, sampler=sampler, batch=16, ahead=3, trials=160)
    found = search(task, f"journal:{tmp_path}/a.log", "one")
    space = space_of(task.ranges, task.choices)
    batches = [
        [
            optuna.trial.create_trial(
                value=float(found.scores["rms"][at]), params=found.draws[at], distributions=space
            )
            for at in range(16 * k, 16 * k + 16)
        ]
        for k in range(10)
    ]
    for order in ([3, 4, 5, 9], [9, 3, 7], [8, 8, 4]):
        own = Sampler(sampler, space, ("minimize",), 16, 3, 0)
        for number in order:
            earlier = batches[: number - 2]
            searching._renumber(earlier)
            expected = list(found.draws[16 * number : 16 * number + 16])
            assert own.draw(number, 16, earlier) == expected, (order, number)


def test_seeds_differ_and_repeat(tmp_path):
    def drawn(seed, name):
        task = replace(TASK, trials=96, batch=32, seed=seed)
        return search(task, f"journal:{tmp_path}/{name}.log", "one").draws

    assert drawn(1, "a") == drawn(1, "b")
    assert not set(map(str, drawn(1, "a"))) & set(map(str, drawn(2, "c")))


@pytest.mark.parametrize("storage", STORAGES)
def test_another_search_of_the_same_name_is_refused(storage, tmp_path):
    where = storage.format(tmp_path)
    search(replace(TASK, trials=8, batch=8), where, "one")
    with pytest.raises(ValueError, match="another 'study'"):
        search(replace(TASK, trials=8, batch=8, seed=5), where, "one")
    found = search(replace(TASK, trials=8, batch=8, seed=5), where, "two")
    assert found.resumed == 0 and len(found.draws) == 8


def test_more_trials_are_added_to_those_that_are_there(tmp_path):
    where = f"sqlite:///{tmp_path}/a.db"
    search(replace(TASK, trials=20, batch=16), where, "one")
    found = search(replace(TASK, trials=50, batch=16), where, "one")
    assert len(found.draws) == 50 and found.resumed == 20


def test_a_storage_that_cannot_be_opened_is_refused(tmp_path):
    for where in ("nonsense://x", f"sqlite:///{tmp_path}", "postgresql://nobody@127.0.0.1:1/none"):
        with pytest.raises(ValueError, match="expected one that can be opened"):
            open_archive(where, "one", ["minimize"], "task")


def test_a_line_that_a_kill_cut_off_is_mended(tmp_path):
    path = tmp_path / "a.log"
    task = replace(TASK, trials=48, batch=16)
    search(task, f"journal:{path}", "one")
    lines = path.read_bytes().splitlines(keepends=True)
    marks = [k for k, line in enumerate(lines) if BATCH.encode() in line]
    whole = search(task, f"journal:{path}", "one")
    path.write_bytes(b"".join(lines[: marks[1] + 5]) + lines[marks[1] + 5][:20])
    rest = search(task, f"journal:{path}", "one")
    assert rest.resumed == 32 and rest.draws == whole.draws
    stripped = [json.loads(line) for line in path.read_bytes().splitlines()]
    assert len([one for one in stripped if one["op_code"] == 4]) == 48


def _writes(where: str, seed: int, ahead: int, started, go) -> None:
    task = replace(TASK, sampler="nsga2", trials=320, batch=16, seed=seed, ahead=ahead)
    started.release()
    go.wait()
    search(task, where, "one")


@pytest.mark.parametrize("writers", [2, pytest.param(4, marks=pytest.mark.slow)])
@pytest.mark.parametrize("storage", STORAGES)
def test_several_writers_find_what_one_finds(storage, writers, tmp_path):
    task = replace(TASK, sampler="nsga2", trials=320, batch=16, ahead=4)
    alone = search(task, storage.format(tmp_path / "alone"), "one")
    where = storage.format(tmp_path / "both")
    context = multiprocessing.get_context("spawn")
    started, go = context.Semaphore(0), context.Event()
    running = [
        context.Process(target=_writes, args=(where, 0, 4, started, go), daemon=True)
        for _ in range(writers)
    ]
    for one in running:
        one.start()
    for _ in running:
        started.acquire()
    go.set()
    for one in running:
        one.join(120)
        assert one.exitcode == 0
    both = search(task, where, "one")
    assert both.resumed == 320  # nothing was left to do, and nothing was done twice
    assert both.draws == alone.draws
    np.testing.assert_array_equal(both.scores["rms"], alone.scores["rms"])


def test_densities_and_draws_are_those_of_optuna():
    """The mixture is optuna's own: densities to rounding, draws in distribution."""
    generator = np.random.default_rng(2)
    space = {
        "a": FloatDistribution(1.0, 1e3, log=True),
        "b": FloatDistribution(-2.0, 5.0),
        "c": CategoricalDistribution(("x", "y", "z")),
    }
    seen = {
        "a": np.exp(generator.uniform(0.0, np.log(1e3), 70)),
        "b": generator.uniform(-2.0, 5.0, 70),
        "c": generator.integers(0, 3, 70).astype(float),
    }
    told = TPESampler(multivariate=True)._parzen_estimator_parameters
    ours, theirs = _Parzen(seen, space, told), _ParzenEstimator(seen, space, told)
    points = theirs.sample(np.random.RandomState(1), 400)
    np.testing.assert_allclose(ours.log_pdf(points), theirs.log_pdf(points), rtol=1e-10, atol=1e-10)
    drawn = ours.sample(np.random.RandomState(1), 20_000)
    known = theirs.sample(np.random.RandomState(2), 20_000)
    for name in space:
        assert np.mean(drawn[name]) == pytest.approx(np.mean(known[name]), rel=0.03)
        assert np.std(drawn[name]) == pytest.approx(np.std(known[name]), rel=0.03)
    assert drawn["a"].min() >= 1.0 and drawn["a"].max() <= 1e3
    assert len(points["a"]) > CANDIDATES


def test_every_value_drawn_lies_in_its_range():
    choice = Choice("part", ("p", "q", "r"), {}, {})
    single = Choice("held", ("only",), {}, {})
    space = space_of(RANGES, (choice, single))
    sampler = Sampler("tpe", space, ("minimize",), 64, 1, 7)
    for one in sampler.draw(0, 200, []):
        assert all(low.low <= one[low.name] <= low.high for low in RANGES)
        assert one["part"] in choice.parts and one["held"] == "only"


SCRIPT = """
import sys
sys.path.insert(0, {folder!r})
import test_search as own
from dataclasses import replace
own.search(replace(own.TASK, trials=4000, batch=16), {where!r}, "one")
"""


@pytest.mark.parametrize("storage", STORAGES)
def test_sigkill_loses_the_running_batch_at_most(storage, tmp_path):
    where = storage.format(tmp_path)
    code = SCRIPT.format(folder=str(Path(__file__).parent), where=where)
    environment = os.environ | {"JAX_COMPILATION_CACHE_DIR": str(tmp_path / "cache")}
    with subprocess.Popen([sys.executable, "-c", code], env=environment) as running:
        archive, done = None, 0
        while done < 5:
            assert running.poll() is None, "it ended before it could be killed"
            time.sleep(0.02)
            if archive is None and any(tmp_path.glob("a.*")):
                try:
                    task = replace(TASK, trials=4000, batch=16)
                    archive = open_archive(where, "one", task.directions, task.fingerprint({}))
                except ValueError:
                    continue
            if archive is not None:
                done += len(archive.batches())
        running.send_signal(signal.SIGKILL)
        assert running.wait() == -signal.SIGKILL
    assert archive is not None
    done += len(archive.batches())
    archive.close()
    found = search(replace(TASK, trials=16 * done + 32, batch=16), where, "one")
    assert found.resumed == 16 * done
    alone = search(replace(TASK, trials=16 * done + 32, batch=16), f"journal:{tmp_path}/b", "one")
    assert found.draws == alone.draws


@pytest.mark.slow
@pytest.mark.parametrize("storage", STORAGES)
def test_four_writers_of_two_thousand_trials_each_lose_none(storage, tmp_path):
    where = storage.format(tmp_path)
    context = multiprocessing.get_context("spawn")
    writers = [
        context.Process(target=_own_study, args=(where, f"study {k}"), daemon=True)
        for k in range(4)
    ]
    for one in writers:
        one.start()
    for one in writers:
        one.join(600)
        assert one.exitcode == 0
    for k in range(4):
        task = replace(TASK, trials=2000, sampler="nsga2", seed=k)
        found = search(task, where, f"study {k}")
        assert found.resumed == 2000
        assert found.draws == search(task, f"journal:{tmp_path}/alone.log", f"study {k}").draws


def _own_study(where: str, name: str) -> None:
    search(replace(TASK, trials=2000, sampler="nsga2", seed=int(name[-1])), where, name)
