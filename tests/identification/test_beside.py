"""Records side by side: in order, one alone where code is compiled, faults raised."""

import threading
import time

import pytest

from supple.identification.beside import each


def test_answers_keep_their_order_and_new_code_goes_alone():
    running, most = set(), []
    lock = threading.Lock()

    def slow(item: int) -> int:
        with lock:
            running.add(item)
            most.append((len(running), item))
        time.sleep(0.02 if item else 0.05)
        with lock:
            running.discard(item)
        return item * item

    items = list(range(6))
    assert each(slow, items, lambda item: ("squares", 0)) == [item * item for item in items]
    assert most[0] == (1, 0) and all(item for _, item in most[1:])  # the first ended before others
    assert each(slow, [7], lambda item: ("squares", 0)) == [49]
    assert each(slow, [], lambda item: ("squares", 0)) == []


def test_a_fault_is_raised_and_the_next_call_works():
    def inverse(item: float) -> float:
        return 1.0 / item

    with pytest.raises(ZeroDivisionError):
        each(inverse, [1.0, 0.0, 2.0], lambda item: "inverse")
    assert each(inverse, [1.0, 4.0, 2.0], lambda item: "inverse") == [1.0, 0.25, 0.5]
