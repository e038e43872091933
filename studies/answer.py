"""A study's answer: what it found with its provenance, written as JSON, Markdown and one figure."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .engine import write_together

if TYPE_CHECKING:
    from .study import Call
    from .thesis.draw import Panel


def answered(
    call: Call,
    name: str,
    question: str,
    found: Mapping[str, Any],
    as_text: Callable[[Mapping[str, Any]], str],
    panels: Sequence[Panel],
    inputs: Mapping[str, str],
    began: float,
    tables: Mapping[str, str] | None = None,
) -> dict[str, Any]:
    """The result of a study, with its files written together.

    Args:
        call: who asks.
        name: of the study, and of its files.
        question: in one sentence.
        found: what it found, as JSON can hold it.
        as_text: the result as Markdown.
        panels: of the figure.
        inputs: SHA-256 of every file read, by its path.
        began: when the study began, by the performance counter [s].
        tables: further files of text, by name.

    Returns:
        ``study``, ``question``, what was found, ``figure`` and ``provenance``.

    Raises:
        ValueError: where the folder cannot be written to.
    """
    from .. import __version__
    from .thesis.draw import drawn

    result = {
        "study": name,
        "question": question,
        **found,
        "figure": f"{name}.svg",
        "provenance": {
            "version": __version__,
            "inputs": dict(inputs),
            "seed": call.seed,
            "seconds": round(time.perf_counter() - began, 1),
        },
    }
    text = json.dumps(result, indent=2, allow_nan=False, ensure_ascii=False) + "\n"
    texts = {f"{name}.json": text, f"{name}.md": as_text(result), **(tables or {})}
    writers: dict[str, Callable[[Path], Any]] = {
        file: lambda path: path.write_text(texts[path.name], encoding="utf-8") for file in texts
    }
    writers[f"{name}.svg"] = lambda path: path.write_bytes(drawn(panels))
    write_together(call.out, writers)
    return result
