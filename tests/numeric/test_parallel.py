"""An ordered map over threads: order, errors in their turn, few results ahead, maps inside maps, and a forked child."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Iterator

import pytest

from collaudit.core.numeric.parallel import begun, by_name, ordered_map, threads, use_threads


@pytest.fixture(autouse=True, params=[2, 4])
def count(request: pytest.FixtureRequest) -> Iterator[int]:
    before = threads()
    use_threads(request.param)
    yield request.param
    use_threads(before)


def test_results_come_in_order_from_two_threads() -> None:
    both = threading.Barrier(2, timeout=20)

    def met(number: int) -> int:
        if number < 2:
            both.wait()  # passes only where two threads work at a time
        return -number

    assert list(ordered_map(met, range(20))) == [-number for number in range(20)]


def test_an_error_is_raised_in_its_turn() -> None:
    found = []
    with pytest.raises(ZeroDivisionError):
        for value in ordered_map(lambda x: 6 // (3 - x), range(6)):
            found.append(value)
    assert found == [2, 3, 6]


def test_what_is_begun_is_at_work_before_it_is_asked_for() -> None:
    started = threading.Event()
    result = begun(lambda: started.set() or threading.current_thread())
    assert started.wait(20)
    assert result() is not threading.current_thread() and result() is result()


def test_a_lone_thread_begins_when_it_is_asked() -> None:
    use_threads(1)
    seen: list[int] = []
    result = begun(lambda: seen.append(1) or len(seen))
    assert not seen
    assert result() == result() == 1


def test_few_results_wait() -> None:
    taken = []

    def items() -> Iterator[int]:
        for number in range(50):
            taken.append(number)
            yield number

    for number in ordered_map(abs, items()):
        assert len(taken) <= number + threads() + 1


def test_maps_inside_maps_come_to_no_standstill() -> None:
    inner = ordered_map(lambda x: sum(ordered_map(lambda y: x * y, range(5))), range(8))
    assert list(inner) == [10 * x for x in range(8)]


def test_a_map_that_is_left_early_leaves_nothing_at_work() -> None:
    at_work: list[int] = []

    def slow(number: int) -> int:
        at_work.append(number)
        time.sleep(0.02)
        at_work.remove(number)
        return number

    found = ordered_map(slow, range(50))
    assert next(found) == 0
    found.close()  # type: ignore[attr-defined]
    assert at_work == []


def test_progress_is_told_by_the_caller_for_each_name() -> None:
    told: list[tuple[int, int, int]] = []
    names = ["c", "a", "b"]
    found = by_name(str.upper, names, lambda done, total: told.append((done, total, threading.get_ident())))
    assert list(found.items()) == [("c", "C"), ("a", "A"), ("b", "B")]
    assert told == [(k, 3, threading.get_ident()) for k in (1, 2, 3)]


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_forked_process_has_threads_of_its_own() -> None:
    assert list(ordered_map(abs, range(4))) == [0, 1, 2, 3]
    child = os.fork()
    if child == 0:
        os._exit(0 if list(ordered_map(abs, range(-3, 3))) == [3, 2, 1, 0, 1, 2] else 1)
    deadline = time.monotonic() + 20
    while (ended := os.waitpid(child, os.WNOHANG)) == (0, 0) and time.monotonic() < deadline:
        time.sleep(0.01)
    assert ended == (child, 0)
