"""Programs that are kept on disk as they were traced: to trace them takes a new process long.

jax keeps what it has compiled, but finds it by the program, which it must trace first: for a march
under laws that takes seconds, for every set of laws anew. Here the traced program itself is kept,
found by its function, its static arguments and the shapes of its arrays.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from functools import cache, lru_cache, wraps
from pathlib import Path
from typing import Any, TypeVar

import jax
import numpy as np
from jax import export
from jax.core import Tracer

FOLDER = "SUPPLE_PROGRAMS"
"""The environment's word for the folder where they are kept; where it is empty, none are."""

LOADED = 1024
"""Programs of a function that a process holds at once [-]: some 50 kB each."""

Kind = TypeVar("Kind")
Computes = Callable[..., Any]


def keepable(kind: type[Kind]) -> type[Kind]:
    """A named tuple, or a dataclass that jax knows, that a kept program may take or give."""
    name = f"supple.{kind.__qualname__}"
    if issubclass(kind, tuple):
        export.register_namedtuple_serialization(kind, serialized_name=name)
    else:
        export.register_pytree_node_serialization(
            kind,
            serialized_name=name,
            serialize_auxdata=lambda _: b"",
            deserialize_auxdata=lambda _: (),
        )
    return kind


def kept(
    static: tuple[int, ...], options: Mapping[str, str | bool] | None = None
) -> Callable[[Computes], Computes]:
    """A function of arrays [any unit], compiled; its programs are kept where a folder is named.

    Within another function that jax traces it is as any other. Nothing but the model's own source
    and these arguments may decide how it is traced: by them a program is found again.

    Args:
        static: numbers of the arguments for each of whose values it is compiled: texts, numbers,
            None, and tuples and dataclasses of them. For others its programs are not kept.
        options: for the compiler.

    Source: tests/model/test_kept.py.
    """

    def decorate(function: Computes) -> Computes:
        told = None if options is None else dict(options)
        plain = jax.jit(function, static_argnums=static, compiler_options=told)

        @lru_cache(maxsize=LOADED)
        def program(folder: str, held: tuple[Any, ...], outline: Any, shapes: Any) -> Computes:
            traced = _traced(function, folder, dict(held), outline, shapes)
            return plain if traced is None else jax.jit(traced, compiler_options=told)

        @wraps(function)
        def call(*given: Any) -> Any:
            folder = os.environ.get(FOLDER, "")
            arrays = tuple(one for i, one in enumerate(given) if i not in static)
            leaves, outline = jax.tree.flatten(arrays)
            if not folder or any(isinstance(leaf, Tracer) for leaf in leaves):
                return plain(*given)
            leaves = [leaf if isinstance(leaf, jax.Array) else np.asarray(leaf) for leaf in leaves]
            shapes = tuple((leaf.shape, leaf.dtype) for leaf in leaves)
            held = tuple((i, given[i]) for i in static if i < len(given))
            found = program(folder, held, outline, shapes)
            return plain(*given) if found is plain else found(*jax.tree.unflatten(outline, leaves))

        return call

    return decorate


def _traced(
    function: Computes, folder: str, held: dict[int, Any], outline: Any, shapes: tuple[Any, ...]
) -> Computes | None:
    """A function of arrays alone, from disk or traced; None where its program cannot be kept."""
    name = f"{function.__module__}.{function.__qualname__}"
    source = source_digest()
    try:
        told = _told((tuple(held.items()), tuple((*shape, str(kind)) for shape, kind in shapes)))
    except TypeError:
        return None
    if not source:
        return None
    text = "\n".join((source, name, told, str(outline)))
    path = Path(folder) / f"{name}-{hashlib.sha256(text.encode()).hexdigest()}.traced"
    found = _read(path)
    if found is not None:
        return found.call

    def bound(*arrays: Any) -> Any:
        rest = iter(arrays)
        count = len(held) + len(arrays)
        return function(*(held[i] if i in held else next(rest) for i in range(count)))

    like = [jax.ShapeDtypeStruct(shape, dtype) for shape, dtype in shapes]
    try:
        found = export.export(jax.jit(bound))(*jax.tree.unflatten(outline, like))
    except ValueError:  # it calls what jax does not promise to understand in later releases
        return None
    _write(path, bytes(found.serialize()))
    return found.call


_CHECK = hashlib.sha256().digest_size


def _read(path: Path) -> export.Exported | None:
    """The program in a file; None where there is none, or none that is whole."""
    try:
        data = path.read_bytes()
    except OSError:
        return None
    if hashlib.sha256(data[_CHECK:]).digest() != data[:_CHECK]:
        return None
    return export.deserialize(bytearray(data[_CHECK:]))


def _write(path: Path, data: bytes) -> None:
    """Beside, and renamed; what cannot be written is traced again in the next process."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        number, beside = tempfile.mkstemp(dir=path.parent)
        try:
            with os.fdopen(number, "wb") as file:
                file.write(hashlib.sha256(data).digest() + data)
            Path(beside).replace(path)
        finally:
            Path(beside).unlink(missing_ok=True)
    except OSError:
        return


def _told(value: Any) -> str:
    """A static argument as text that is the same in every process."""
    if value is None or isinstance(value, str | bool | int | float):
        return repr(value)
    if isinstance(value, tuple):
        return f"({','.join(_told(one) for one in value)})"
    if is_dataclass(value) and not isinstance(value, type):
        parts = (f"{field.name}={_told(getattr(value, field.name))}" for field in fields(value))
        return f"{type(value).__module__}.{type(value).__qualname__}({','.join(parts)})"
    raise TypeError(f"no text stands for a {type(value).__name__}")


@cache
def source_digest() -> str:
    """Of what decides how the model is traced [-]: its source, jax, and what jax is told.

    Empty where the source is not at hand.
    """
    sources = sorted(Path(__file__).parent.rglob("*.py"))
    if not sources:
        return ""
    digest = hashlib.sha256()
    for path in sources:
        digest.update(path.read_bytes())
    told = jax.__version__, jax.default_backend(), os.environ.get("XLA_FLAGS", "")
    digest.update(repr((told, jax.config.read("jax_enable_x64"))).encode())
    return digest.hexdigest()
