"""Work side by side: in order, one alone where code is compiled, faults raised."""

import threading
import time

import pytest

from supple.identification.beside import THREADS, each, each_whole


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


def test_whole_fits_go_side_by_side_with_their_records():
    both = threading.Barrier(min(2, THREADS), timeout=60.0)

    def fit(number: int) -> list[int]:
        both.wait()  # neither goes on before the other has begun
        inner = each_whole(lambda one: threading.get_ident(), [0, 1, 2])
        assert set(inner) == {threading.get_ident()}  # within one they go one by one
        return each(lambda record: number * record, [1, 2, 3], lambda record: ("fits", number))

    expected = [[number * record for record in (1, 2, 3)] for number in range(6)]
    assert each_whole(fit, range(6)) == expected
    assert each_whole(lambda one: one, []) == []
    with pytest.raises(ZeroDivisionError):
        each_whole(lambda item: 1 / item, [1, 0, 2])


def test_code_that_two_fits_ask_for_is_compiled_once():
    called, both = [], threading.Barrier(min(2, THREADS), timeout=60.0)

    def compile_it(item: int) -> int:
        called.append((item, time.perf_counter()))
        time.sleep(0.1)
        return item

    def fit(number: int) -> list[int]:
        both.wait()
        return each(compile_it, [number, number], lambda item: "asked for by both")

    assert each_whole(fit, [0, 1]) == [[0, 0], [1, 1]]
    began = [at for _, at in called]
    assert len(began) == 4 and min(began[1:]) - began[0] >= 0.1  # all others after the first ended


def test_after_a_fault_the_other_fits_end_at_once():
    ended = threading.Event()

    def fit(number: int) -> None:
        if not number:
            time.sleep(0.1)
            raise ZeroDivisionError
        try:
            while True:
                each(lambda item: time.sleep(0.01), [0, 1], lambda item: "endless")
        finally:
            ended.set()

    with pytest.raises(ZeroDivisionError):
        each_whole(fit, [0, 1] if THREADS > 1 else [0, 0])
    assert THREADS == 1 or ended.wait(60.0)
    assert each_whole(lambda item: item, [1, 2, 3]) == [1, 2, 3]  # its threads are free
