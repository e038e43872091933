"""What is compiled in less time says the same, and does without where the choice is gone."""

from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest

from supple.model import quick


def waves(count: int, x: Any) -> Any:
    return jnp.stack([jnp.sin(k * x) for k in range(count)])


@pytest.fixture
def forgotten():
    quick._choice.cache_clear()
    yield
    quick._choice.cache_clear()


def test_it_says_what_the_function_says():
    x = np.linspace(0.0, 1.0, 50)
    found = quick.quickly(waves, (0,))(4, x)
    assert np.asarray(found) == pytest.approx(np.asarray(waves(4, x)), abs=1e-15)


def test_a_compiler_without_the_choice_is_no_obstacle(monkeypatch, forgotten):
    assert quick._choice() == quick.CHOICE
    quick._choice.cache_clear()
    monkeypatch.setattr(quick, "CHOICE", {"xla_of_another_year": True})
    assert quick._choice() is None
    assert float(quick.quickly(waves, (0,))(2, np.array([0.5]))[1, 0]) == np.sin(0.5)
