"""Records side by side: one function of each record, on as many threads as there are processors."""

from __future__ import annotations

import os
from collections.abc import Callable, Hashable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import TypeVar

Item = TypeVar("Item")
Found = TypeVar("Found")

_COMPILED: set[Hashable] = set()
"""What has been called once: two threads would both compile what is new to them."""


@cache
def _pool(process: int) -> ThreadPoolExecutor:
    """Threads of this process; one that was forked from it makes its own."""
    return ThreadPoolExecutor(os.cpu_count() or 1, thread_name_prefix=f"records-{process}")


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
    new: dict[Hashable, int] = {}
    for index, item in enumerate(items):
        key = compiled(item)
        if key not in _COMPILED:
            new.setdefault(key, index)
    found = _side_by_side(function, items, list(new.values()))
    _COMPILED.update(new)
    left = [index for index in range(len(items)) if index not in found]
    found |= _side_by_side(function, items, left)
    return [found[index] for index in range(len(items))]


def _side_by_side(
    function: Callable[[Item], Found], items: Sequence[Item], which: Sequence[int]
) -> dict[int, Found]:
    if len(which) == 1:
        return {which[0]: function(items[which[0]])}
    told = _pool(os.getpid()).map(function, [items[index] for index in which])
    return dict(zip(which, told, strict=True))
