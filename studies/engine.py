"""What every command that computes shares: compiled code kept on disk, provenance, results."""

from __future__ import annotations

import ctypes
import os
import shutil
import tempfile
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..identification.records import Record
    from ..model.rig import Rig

Progress = Callable[[str], None]


KEPT_PROGRAMS = 6000
"""Traced and compiled programs that may lie in the user's cache folder [-]: some 80 kB each."""


def start_engine() -> None:
    """Keep traced and compiled programs in the user's cache folder, for later runs.

    A program that cannot be read there, since its writer was killed, is compiled again.
    """
    home = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache"))
    own = home / "supple" / "jax"
    if os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(own)) == str(own):
        _forget_oldest(own)
    os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0.1")
    os.environ.setdefault("SUPPLE_PROGRAMS", os.environ["JAX_COMPILATION_CACHE_DIR"])
    warnings.filterwarnings("ignore", "Error (reading|writing) persistent compilation cache")


def _forget_oldest(folder: Path) -> None:
    """Throw away the older half of kept programs where they have become too many."""
    try:
        kept = list(folder.iterdir())
        if len(kept) > KEPT_PROGRAMS:
            kept.sort(key=lambda path: path.stat().st_mtime)
            for path in kept[: len(kept) // 2]:
                path.unlink(missing_ok=True)
    except OSError:
        return  # no folder yet, or another process is tidying it up


def release_memory() -> None:
    """Give what compiling has left behind back to the system, where the system can be asked."""
    try:
        ctypes.CDLL(None).malloc_trim(0)
    except (OSError, AttributeError, TypeError):
        return  # not a GNU system: it keeps the memory for later


MAPPED = 20_000
"""Pieces of memory that a process may hold before what it compiled is thrown away [-]; a system
allows 65,530, and some hundred compiled programs reach that: then compiling fails or ends the
process. One diagnosis of a driven robot was seen to take 31,000."""


def forget_programs() -> None:
    """Drop compiled programs where they have become too many, between two pieces of work."""
    maps = Path("/proc/self/maps")
    if maps.is_file() and maps.read_bytes().count(b"\n") > MAPPED:
        import jax

        jax.clear_caches()
        release_memory()


@dataclass
class Inputs:
    """Records and rig of one command, with what is needed to say where a result comes from.

    Attributes:
        records: as read at the door.
        held_out: further records, to be held out.
        rig: the one rig of them all.
        files: SHA-256 of every file read.
        began: when the command began [s].
    """

    records: list[Record]
    held_out: list[Record]
    rig: Rig
    files: dict[str, str] = field(default_factory=dict)
    began: float = field(default_factory=time.perf_counter)

    def provenance(self, seed: int) -> dict[str, Any]:
        """Version, inputs, seed and time taken [s]."""
        from .. import __version__

        seconds = round(time.perf_counter() - self.began, 3)
        return {"version": __version__, "inputs": self.files, "seed": seed, "seconds": seconds}


def read_inputs(paths: Sequence[Path], rig: Path | None, held_out: Sequence[Path] = ()) -> Inputs:
    """Read records with the rig that they share.

    Args:
        paths: sidecars.
        rig: a rig that overrides the sidecars'.
        held_out: sidecars of records to hold out.

    Returns:
        The inputs.

    Raises:
        ValueError: in the words of the door; also where records name different rigs or none.
    """
    from ..identification.records import check_record_against_rig, read_record
    from ..model.rig import read_rig

    start_engine()
    began = time.perf_counter()
    records = [read_record(path, rig) for path in paths]
    kept = [read_record(path, rig) for path in held_out]
    names: dict[str, Path] = {}
    for record in (*records, *kept):
        if record.name in names and names[record.name] != record.path:
            raise ValueError(
                f"{record.path.name}: expected records of different names, found '{record.name}' "
                "twice. Mend: rename one of the sidecars."
            )
        names[record.name] = record.path
    rigs = {record.rig_path for record in (*records, *kept)}
    if None in rigs or len(rigs) != 1:
        found = "none" if rigs == {None} else f"{len(rigs)} different ones"
        raise ValueError(
            f"{records[0].path.name}: [record] rig: expected one rig for all records, found "
            f"{found}. Mend: name it in the sidecars or with --rig."
        )
    path = rigs.pop()
    assert path is not None
    known = read_rig(path)
    files = {str(path): known.sha256}
    for record in (*records, *kept):
        check_record_against_rig(record, known)
        files |= record.files
    return Inputs(records, kept, known, files, began)


def progress_of(talks: bool) -> Progress:
    """A teller of progress: a spinner on standard error, where that is a terminal."""
    from rich.console import Console

    console = Console(stderr=True)
    if not (talks and console.is_terminal):
        return lambda text: None
    status = console.status("")
    status.start()
    return lambda text: status.update(text) if text else status.stop()


def write_together(folder: Path | None, writers: Mapping[str, Callable[[Path], Any]]) -> None:
    """Write several files so that an earlier result is never overwritten in part.

    Args:
        folder: where they go; nothing is written where None.
        writers: by file name, what writes that file to a given path.

    Raises:
        ValueError: where the folder cannot be written to.
    """
    if folder is None:
        return
    try:
        folder.mkdir(parents=True, exist_ok=True)
        beside = Path(tempfile.mkdtemp(prefix=".unfinished-", dir=folder))
    except OSError as error:
        raise ValueError(
            f"{folder}: --out: expected a folder that can be written to, found "
            f"'{error.strerror}'. Mend: name another folder."
        ) from None
    try:
        for name, write in writers.items():
            write(beside / name)
        for name in writers:
            os.replace(beside / name, folder / name)
    finally:
        shutil.rmtree(beside, ignore_errors=True)
