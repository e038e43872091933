"""Traced programs are found again as they were, and only where they are the same."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from supple.model import kept as module
from supple.model.kept import kept
from supple.model.march import March
from supple.model.plant import numbers_vector
from supple.model.respond import simulate, tangents
from tests.model.test_respond import CART_NUMBERS, FORCED, STEP, WIDTHS, wave


@dataclass(frozen=True)
class Form:
    power: int
    names: tuple[str, ...] = ("x",)


class Counted(NamedTuple):
    """A function that counts how often it is traced, as a process of its own would call it."""

    call: Callable[..., Any]
    traced: list[int]


def counted(static: tuple[int, ...] = (0,)) -> Counted:
    traced = []

    def powers(form: Any, x: Any, more: Any = None) -> Any:
        traced.append(1)
        power = getattr(form, "power", 2)
        rest = jnp.zeros(1) if more is None else more
        return March(x**power, rest, x, x + 1.0)

    return Counted(kept(static)(powers), traced)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "programs"
    monkeypatch.setenv(module.FOLDER, str(folder))
    return folder


def files(folder: Path) -> list[Path]:
    return sorted(folder.iterdir()) if folder.is_dir() else []


X = np.array([1.0, 2.0, 3.0])


def test_a_second_process_does_not_trace(folder):
    for wanted in (1, 0):
        one = counted()
        for _ in range(2):
            found = one.call(Form(3), X)
            assert isinstance(found, March)
            np.testing.assert_array_equal(found.states, X**3)
            np.testing.assert_array_equal(found.memory, X + 1.0)
        assert len(one.traced) == wanted
        assert len(files(folder)) == 1


def test_what_differs_has_a_program_of_its_own(folder):
    one = counted()
    given = [
        (Form(2), X),
        (Form(3), X),
        (Form(3, ("y",)), X),
        (Form(3), X[:2]),
        (Form(3), X.astype(int)),
        (Form(3), X, X),
        (Form(3), X, (X, X)),
    ]
    for index, some in enumerate(given):
        one.call(*some)
        assert len(files(folder)) == index + 1
    assert len(one.traced) == len(given)


def test_other_source_is_traced_anew(folder, monkeypatch):
    counted().call(Form(3), X)
    monkeypatch.setattr(module, "source_digest", lambda: "other")
    one = counted()
    one.call(Form(3), X)
    assert len(one.traced) == 1
    assert len(files(folder)) == 2


@pytest.mark.parametrize("left", [0, 20, 500])
def test_a_file_that_was_cut_off_is_written_again(folder, left):
    counted().call(Form(3), X)
    (path,) = files(folder)
    whole = path.read_bytes()
    path.write_bytes(whole[:left])
    one = counted()
    np.testing.assert_array_equal(one.call(Form(3), X).states, X**3)
    assert len(one.traced) == 1
    again = counted()
    again.call(Form(3), X)
    assert not again.traced


def test_a_folder_that_cannot_be_written_is_no_obstacle(tmp_path, monkeypatch):
    (tmp_path / "file").touch()
    monkeypatch.setenv(module.FOLDER, str(tmp_path / "file" / "programs"))
    np.testing.assert_array_equal(counted().call(Form(3), X).states, X**3)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_what_no_text_stands_for_is_not_kept(folder):
    found = counted().call(object(), X)
    np.testing.assert_array_equal(found.states, X**2)
    assert not files(folder)


def test_without_the_source_nothing_is_kept(folder, monkeypatch):
    monkeypatch.setattr(module, "source_digest", lambda: "")
    np.testing.assert_array_equal(counted().call(Form(3), X).states, X**3)
    assert not files(folder)


def test_what_jax_does_not_promise_to_read_later_is_not_kept(folder, monkeypatch):
    def refuses(function: Any) -> Any:
        def call(*_: Any) -> Any:
            raise ValueError("no promise")

        return call

    monkeypatch.setattr(module.export, "export", refuses)
    np.testing.assert_array_equal(counted().call(Form(3), X).states, X**3)
    assert not files(folder)


def test_without_a_folder_nothing_is_kept(tmp_path, monkeypatch):
    monkeypatch.setenv(module.FOLDER, "")
    monkeypatch.chdir(tmp_path)
    np.testing.assert_array_equal(counted().call(Form(3), X).states, X**3)
    assert not files(tmp_path)


def test_within_a_traced_function_it_is_as_any_other(folder):
    one = counted()

    def total(x: Any) -> Any:
        return one.call(Form(3), x).states.sum()

    np.testing.assert_allclose(jax.grad(total)(X), 3.0 * X**2, rtol=1e-15)
    np.testing.assert_allclose(jax.vmap(total)(X[:, None]), X**3, rtol=1e-15)
    assert not files(folder)


def test_a_motion_and_its_derivatives_are_the_same_to_the_last_bit(folder, monkeypatch):
    z = numbers_vector(FORCED, CART_NUMBERS)
    z[FORCED.slots["strengths"]] = 0.5
    given = jnp.asarray(wave()), jnp.asarray(STEP), WIDTHS

    def moved() -> list[np.ndarray]:
        along = tangents(FORCED, 2, z, np.eye(len(z))[:3], *given)
        return [np.asarray(simulate(FORCED, 2, z, *given)), np.asarray(along)]

    kept_ones = moved()
    assert len(files(folder)) > 3
    monkeypatch.setenv(module.FOLDER, "")
    for found, wanted in zip(kept_ones, moved(), strict=True):
        assert np.abs(wanted).max() > 0.0
        np.testing.assert_array_equal(found, wanted)
