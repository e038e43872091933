"""Functions that are compiled in half the time, for what is called a few times only."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, wraps
from typing import Any

import jax

CHOICE: dict[str, str | bool] = {"xla_cpu_use_fusion_emitters": False}
"""Of XLA's two ways to make loops for a processor the older one: it compiles twice as fast, and
what it makes runs up to a tenth slower [-]."""


@cache
def _choice() -> dict[str, str | bool] | None:
    """`CHOICE`, or nothing where this version of the compiler no longer has it."""
    try:
        jax.jit(lambda x: x).lower(0.0).compile(compiler_options=CHOICE)
    except jax.errors.JaxRuntimeError:
        return None
    return CHOICE


def quickly(function: Callable[..., Any], static: tuple[int, ...]) -> Callable[..., Any]:
    """A function of arrays [any unit], compiled for a few calls.

    Args:
        function: of arrays, compiled or not; jax does not differentiate or batch what comes back.
        static: numbers of the arguments for each of whose values it is compiled.
    """

    @cache
    def compiled() -> Callable[..., Any]:
        return jax.jit(function, static_argnums=static, compiler_options=_choice())

    @wraps(function)
    def call(*given: Any) -> Any:
        return compiled()(*given)

    return call
