"""Work side by side: a function of each record, or whole fits, on a thread for each processor."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable, Hashable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import TypeVar

Item = TypeVar("Item")
Found = TypeVar("Found")

_COMPILED: set[Hashable] = set()
"""What has been called once: two threads would both compile what is new to them."""

_COMPILING = threading.Lock()
"""Held while code that is new is called: fits side by side may ask for the same."""

_WORKING = threading.local()
"""Of a thread of `each_whole`'s pool: `stopped`, whether its answer is not awaited any more."""

THREADS = min(os.cpu_count() or 1, 8)
"""Threads of a pool [-]: half of the work is Python's own, which more would only wait for."""


HANDOVER = 2e-4
"""How long a thread that comes back from compiled code waits until another one gives up Python's
lock [s]: calls of compiled code take milliseconds, and Python's own 5 ms are as long."""


@cache
def _pool(process: int, name: str) -> ThreadPoolExecutor:
    """Threads of this process; one that was forked from it makes its own."""
    sys.setswitchinterval(min(HANDOVER, sys.getswitchinterval()))
    return ThreadPoolExecutor(THREADS, thread_name_prefix=f"{name}-{process}")


def each_whole(function: Callable[[Item], Found], items: Sequence[Item]) -> list[Found]:
    """What a function finds of each item, in their order, where each is work of many calls.

    Half of a fit is what compiled code does not do, on one thread: fits side by side fill the
    processors better than their records do.

    Args:
        function: of one item; it may call `each`. Where it calls this, that goes one by one.
        items: any, each for itself.

    Returns:
        As many as items; the first fault of the function is raised. After a fault, or where the
        user interrupts, the others end at their next call of `each`.

    Source: tests/identification/test_beside.py.
    """
    if len(items) < 2 or hasattr(_WORKING, "stopped"):
        return [function(item) for item in items]
    stopped = threading.Event()

    def work(item: Item) -> Found:
        _WORKING.stopped = stopped
        return function(item)

    try:
        return list(_pool(os.getpid(), "fits").map(work, items))
    except BaseException:
        stopped.set()
        raise


class _Stopped(Exception):
    """Nobody awaits this any more."""


def each(
    function: Callable[[Item], Found],
    items: Sequence[Item],
    compiled: Callable[[Item], Hashable],
) -> list[Found]:
    """What a function finds of each item, in their order; compiled code lets its threads run.

    Args:
        function: of one item; it may not call `each` itself.
        items: any.
        compiled: what an item's call compiles; the first of each goes before others like it.

    Returns:
        As many as items; the first fault of the function is raised.

    Source: tests/identification/test_beside.py.
    """
    if hasattr(_WORKING, "stopped") and _WORKING.stopped.is_set():
        raise _Stopped
    keys = [compiled(item) for item in items]
    found: dict[int, Found] = {}
    if not _COMPILED.issuperset(keys):
        with _COMPILING:
            new = {key: i for i, key in reversed(list(enumerate(keys))) if key not in _COMPILED}
            found = _side_by_side(function, items, sorted(new.values()))
            _COMPILED.update(new)
    left = [index for index in range(len(items)) if index not in found]
    found |= _side_by_side(function, items, left)
    return [found[index] for index in range(len(items))]


def _side_by_side(
    function: Callable[[Item], Found], items: Sequence[Item], which: Sequence[int]
) -> dict[int, Found]:
    if len(which) == 1:
        return {which[0]: function(items[which[0]])}
    told = _pool(os.getpid(), "records").map(function, [items[index] for index in which])
    return dict(zip(which, told, strict=True))
