"""A search by a Gaussian process: near the optimum in few designs, and the same after a break."""

import sys
from dataclasses import replace

import numpy as np
import pytest

from supple.optimize.search import search
from supple.optimize.search_spec import Limit
from supple.optimize.sweep import score_designs
from tests.optimize.search_tasks import RANGES, TASK as SHARED

TASK = replace(SHARED, sampler="gp", batch=8, ahead=1, trials=48)


def lowest() -> float:
    """The lowest RMS of a fine grid."""
    grid = np.meshgrid(*(np.geomspace(o.low, o.high, 81) for o in RANGES), indexing="ij")
    numbers = {one.name: values.ravel() for one, values in zip(RANGES, grid)}
    return float(score_designs(TASK.sweep, numbers)["rms"].min())


def test_without_its_library_it_says_what_to_install(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(ValueError, match=r"PyTorch for 'gp'.*pip install 'supple\[gp\]'"):
        search(TASK, f"journal:{tmp_path}/a.log", "one")
    assert not (tmp_path / "a.log").exists()


@pytest.mark.slow
def test_it_comes_near_the_optimum_in_few_designs_and_a_break_changes_nothing(tmp_path):
    pytest.importorskip("torch", reason="the Gaussian process needs PyTorch")
    found = search(TASK, f"journal:{tmp_path}/whole.log", "one")
    at = found.front[0]
    assert found.scores["rms"][at] <= 1.01 * lowest()
    assert at >= 16  # proposed by the process, not by the spread that begins

    class Left(Exception):
        pass

    def stop(done, of):
        if done == 32:
            raise Left

    with pytest.raises(Left):
        search(TASK, f"journal:{tmp_path}/part.log", "one", tell=stop)
    rest = search(TASK, f"journal:{tmp_path}/part.log", "one")
    assert rest.resumed == 32 and rest.draws == found.draws


@pytest.mark.slow
def test_it_keeps_limits_and_weighs_two_objectives(tmp_path):
    pytest.importorskip("torch", reason="the Gaussian process needs PyTorch")
    both = replace(
        TASK,
        sweep=replace(TASK.sweep, scores=("rms", "peak", "grip_displacement_peak")),
        objectives=(("rms", "minimize"), ("peak", "minimize")),
        limits=(Limit("grip_displacement_peak", None, 4.2e-4),),
        trials=32,
    )
    found = search(both, f"sqlite:///{tmp_path}/a.db", "one")
    assert len(found.draws) == 32 and 0 < found.usable.sum()
    assert len(found.front) >= 2
    assert (found.scores["grip_displacement_peak"][found.front] <= 4.2e-4).all()
