"""What commands share: compiled programs are kept on disk, in bounds, none trusted blindly."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from supple.studies import engine

COMPILES = """
from supple.studies.engine import start_engine
start_engine()
import jax
print(float(jax.jit(lambda x: jax.numpy.sin(x) + 1.0)(0.0)))
"""


def compiles(home: Path) -> str:
    """What a fresh process prints that keeps programs under `home`; it must not warn."""
    environment = os.environ | {
        "XDG_CACHE_HOME": str(home),
        "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0",
    }
    del environment["JAX_COMPILATION_CACHE_DIR"]
    command = [sys.executable, "-W", "error", "-c", COMPILES]
    run = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    assert "Warning" not in run.stderr  # what a processor's loader logs is not ours
    return run.stdout


def test_a_program_that_was_cut_off_is_compiled_again_without_a_word(tmp_path):
    assert compiles(tmp_path) == "1.0\n"
    kept = [path for path in (tmp_path / "supple" / "jax").iterdir() if "lambda" in path.name]
    assert len(kept) == 1
    kept[0].write_bytes(kept[0].read_bytes()[:50])
    assert compiles(tmp_path) == "1.0\n"


@pytest.mark.parametrize(("most", "left"), [(9, list("abcdefghi")), (8, list("efghi"))])
def test_the_older_half_is_thrown_away_where_programs_are_too_many(
    tmp_path, monkeypatch, most, left
):
    folder = tmp_path / "supple" / "jax"
    folder.mkdir(parents=True)
    for age, name in enumerate(reversed("abcdefghi")):
        (folder / name).touch()
        os.utime(folder / name, (1e9 - age, 1e9 - age))
    monkeypatch.setattr(engine, "KEPT_PROGRAMS", most)
    monkeypatch.setattr(os, "environ", {"XDG_CACHE_HOME": str(tmp_path)})
    engine.start_engine()
    assert sorted(path.name for path in folder.iterdir()) == left


def test_a_folder_that_the_user_names_is_left_alone(tmp_path, monkeypatch):
    (tmp_path / "own").touch()
    monkeypatch.setattr(engine, "KEPT_PROGRAMS", 0)
    monkeypatch.setattr(os, "environ", {"JAX_COMPILATION_CACHE_DIR": str(tmp_path)})
    engine.start_engine()
    assert (tmp_path / "own").exists()


FORGETS = """
import jax
from supple.studies import engine
double = jax.jit(lambda x: 2.0 * x)
double(1.0)
engine.forget_programs()
kept = double._cache_size()
engine.MAPPED = 0
engine.forget_programs()
print(kept, double._cache_size())
"""


@pytest.mark.skipif(not Path("/proc/self/maps").is_file(), reason="no list of maps here")
def test_compiled_programs_are_dropped_only_where_they_have_become_too_many():
    run = subprocess.run(
        [sys.executable, "-c", FORGETS], capture_output=True, text=True, check=True
    )
    assert run.stdout.split() == ["1", "0"]
