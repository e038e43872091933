"""A laboratory's own file becomes a record in the house format: a table and its sidecar."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .engine import write_together


def convert_file(
    path: Path, out: Path | None, sample_rate: float | None = None, seed: int = 0
) -> dict[str, Any]:
    """Converts a universal, TDMS, MAT, C3D or text file, or the record of a sidecar.

    Args:
        path: the file, or the sidecar that maps it.
        out: folder for ``NAME.csv`` and ``NAME.toml``; None writes nothing.
        sample_rate: where the file does not tell [Hz].
        seed: kept in the provenance; nothing here is drawn by chance.

    Returns:
        The contents of ``convert.json``: channels with their units, files and doubts.

    Raises:
        ValueError: in the words of the door; also where a file would overwrite what it came from.
    """
    from .. import __version__
    from ..identification.house_format import house_format, relative_files
    from ..model.door import fault

    began = time.perf_counter()
    found = house_format(path, sample_rate)
    folder = out or Path()
    read = {Path(name).resolve() for name in found.files}
    for name in found.texts:
        if out is not None and (folder / name).resolve() in read:
            expected = "a folder other than that of the file itself"
            raise fault(path, "--out", expected, f"'{folder}'", "name another folder")
    texts = {name: relative_files(text, folder) for name, text in found.texts.items()}
    writers = {
        name: lambda each: each.write_text(texts[each.name], encoding="utf-8") for name in texts
    }
    write_together(out, writers)
    return {
        "name": found.name,
        "channels": [dict(one) for one in found.channels],
        "files": sorted(texts),
        "doubts": list(found.doubts),
        "provenance": {
            "version": __version__,
            "inputs": dict(found.files),
            "seed": seed,
            "seconds": round(time.perf_counter() - began, 3),
        },
    }


def show_convert(result: Mapping[str, Any]) -> None:
    """Print what became of each channel, and what the sidecar must still be told."""
    from .listing import printed

    keys = ("channel", "column", "unit", "quantity", "samples", "file")
    rows = [tuple(str(one[key]) for key in keys) for one in result["channels"]]
    printed(f"{result['name']}: {', '.join(result['files'])}", keys, rows,
            [f"! {text}" for text in result["doubts"]])  # fmt: skip
