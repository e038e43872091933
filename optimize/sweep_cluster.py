"""A map by many machines: one task a tile on a cluster of dask, results taken as they come."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager
from itertools import islice
from typing import TYPE_CHECKING, Any

from .. import __version__
from .sweep import Result, TileWork, Workers

if TYPE_CHECKING:
    from distributed import Client, Future

CONNECT = 10.0
"""How long the cluster's scheduler may take to answer [s]."""

PATIENCE = 60.0
"""How long a cluster may be without any worker before the sweep gives up [s]."""

AHEAD = 3
"""Tiles under way for each thread of the cluster [-]: enough to keep it busy, few to lose."""


@contextmanager
def cluster_at(address: str) -> Iterator[Workers]:
    """Who works on the tiles of a map: the workers of a cluster of dask.

    Each tile is one task. A worker that ends takes nothing with it but the tiles that it was
    working on, which others do again; each is given back once. Results are written by whoever asks.

    Args:
        address: of the cluster's scheduler, such as ``tcp://127.0.0.1:8786``.

    Yields:
        What `supple.optimize.sweep.sweep` takes as its workers.

    Raises:
        ValueError: for a library that is missing, a scheduler that does not answer, a cluster
            without workers, or workers of another version.

    Source: tests/optimize/test_sweep_cluster.py.
    """
    client = _connected(address)
    try:
        _await_worker(client, address)
        yield lambda work, tiles: _told(client, address, work, tiles)
    finally:
        client.close()


def _connected(address: str) -> Client:
    try:
        from distributed import Client
    except ImportError:
        raise ValueError(
            "--cluster: expected dask.distributed, found none installed. "
            "Mend: pip install 'supple[cluster]', or leave --cluster out."
        ) from None
    for name in logging.root.manager.loggerDict:
        if name.split(".")[0] == "distributed":  # what goes wrong is told in our own words
            logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        return Client(address, timeout=CONNECT, set_as_default=False, name="supple")
    except (OSError, ValueError, TypeError) as error:
        raise ValueError(
            f"--cluster: expected a scheduler of dask at '{address}', found none that answers "
            f"({type(error).__name__}). Mend: start `dask scheduler` there, or correct the address."
        ) from None


def _await_worker(client: Client, address: str) -> None:
    try:
        client.wait_for_workers(1, timeout=PATIENCE)
    except TimeoutError:
        raise ValueError(
            f"--cluster: expected workers at '{address}', found none for {PATIENCE:g} s. Mend: "
            f"start `dask worker {address}` on each machine; the same command goes on."
        ) from None


def _told(
    client: Client, address: str, work: TileWork, tiles: list[int]
) -> Iterator[tuple[int, Result]]:
    """Each tile as it comes; a scheduler that ends is told in words."""
    try:
        yield from _worked(client, address, work, tiles)
    except (CancelledError, OSError):
        raise ValueError(
            f"--cluster: expected the scheduler at '{address}' to stay, found it gone. Mend: start "
            "it again; the same command goes on where this one stopped."
        ) from None


def _worked(
    client: Any, address: str, work: TileWork, tiles: list[int]
) -> Iterator[tuple[int, Result]]:
    """Each of some tiles as it comes from the cluster, few of them under way at a time."""
    left, ahead = iter(tiles), dict[Any, int]()
    while True:
        threads = sum(client.nthreads().values()) if client.status == "running" else 0
        for tile in islice(left, max(0, AHEAD * max(threads, 1) - len(ahead))):
            ahead[client.submit(_tile_there, work, tile, __version__, pure=False)] = tile
        if not ahead:
            return
        try:
            done = _finished(client, list(ahead))
        except TimeoutError:
            _await_worker(client, address)
            continue
        for future in sorted(done, key=lambda one: ahead[one]):
            tile = ahead.pop(future)
            yield tile, _taken(future, tile)
            future.release()


def _finished(client: Any, ahead: list[Any]) -> set[Any]:
    """Those that are finished, once one is; without one for long, `TimeoutError`."""
    from distributed import wait

    with client.as_current():
        found: Any = wait(ahead, PATIENCE, "FIRST_COMPLETED")
    return found.done


def _tile_there(work: TileWork, tile: int, version: str) -> Result:
    """What a worker does."""
    if version != __version__:
        raise ValueError(
            f"--cluster: expected workers with supple {version}, found {__version__}. "
            "Mend: install one version everywhere."
        )
    return work(tile)


def _taken(future: Future[Any], tile: int) -> Result:
    """A tile's result, or what went wrong in words."""
    from distributed.scheduler import KilledWorker

    try:
        return future.result()
    except KilledWorker:
        raise ValueError(
            f"--cluster: expected workers that survive a tile, found tile {tile} on each of those "
            "that ended. Mend: give workers more memory; the same command goes on."
        ) from None
    except ImportError as error:
        raise ValueError(
            f"--cluster: expected workers that have supple, found one that says '{error}'. "
            "Mend: install supple wherever a worker runs."
        ) from None
