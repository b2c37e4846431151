"""Test that the memory of long programs is freed without blocking others."""

from __future__ import annotations

import gc
import weakref
from collections.abc import Callable, Iterator
from threading import Event, active_count
from threading import enumerate as threads

import pytest

from tests.live import PATIENCE
from vrs_cli.language.text.collector import FREED_AT_ONCE, MANY, collect_in_small_parts, free_in_parts, pause_collector


class Owner:
    """An object with a long sequence."""

    def __init__(self, steps: tuple[object, ...]) -> None:
        self.steps = steps


class Step:
    """An object that reports when it is freed."""


@pytest.fixture
def served() -> Iterator[None]:
    with collect_in_small_parts():
        yield


def owner_of(count: int) -> tuple[Owner, Callable[[], int]]:
    """Return the owner of so many steps, and a function that counts those still there."""
    owner = Owner(tuple(Step() for _ in range(count)))
    free_in_parts(owner, owner.steps)
    references = [weakref.ref(step) for step in owner.steps]
    return owner, lambda: sum(reference() is not None for reference in references)


@pytest.mark.usefixtures("served")
def test_a_long_sequence_is_freed_by_another_thread() -> None:
    owner, there = owner_of(3 * FREED_AT_ONCE)
    ended = Event()
    weakref.finalize(owner.steps[0], ended.set)  # what is freed last
    del owner
    assert ended.wait(PATIENCE)
    assert there() == 0


def test_where_nobody_waits_it_is_freed_at_once() -> None:
    owner, there = owner_of(3 * FREED_AT_ONCE)
    del owner
    assert there() == 0


def test_objects_that_the_caller_has_frozen_stay_frozen() -> None:
    gc.freeze()
    frozen = gc.get_freeze_count()
    with collect_in_small_parts():
        pass
    assert gc.get_freeze_count() >= frozen * 0.9


def test_a_process_is_as_before_when_it_no_longer_serves() -> None:
    gc.unfreeze()  # what the run of the tests has frozen
    before, running = gc.get_threshold(), active_count()
    with collect_in_small_parts():
        assert gc.get_threshold() != before
    assert gc.get_threshold() == before
    assert gc.get_freeze_count() == 0
    owner, there = owner_of(3 * FREED_AT_ONCE)
    del owner
    assert there() == 0
    for thread in threads():
        if thread.name == "free":
            thread.join(PATIENCE)
    assert active_count() == running
    gc.freeze()  # as it was: the collection after this file would look at all that the tests have left


@pytest.mark.parametrize(("count", "made_old"), [(MANY // 2, False), (2 * MANY, True)])
def test_many_values_that_last_count_as_old_and_few_cost_nothing(
    monkeypatch: pytest.MonkeyPatch, count: int, made_old: bool
) -> None:
    """Counting frozen objects takes as long as there are of them, for each small file that is read."""
    asked = list[str]()
    monkeypatch.setattr(gc, "get_freeze_count", lambda: asked.append("count") or 0)
    monkeypatch.setattr(gc, "freeze", lambda: asked.append("freeze"))
    monkeypatch.setattr(gc, "unfreeze", lambda: asked.append("unfreeze"))
    with pause_collector(lasting=True):
        values = [[] for _ in range(count)]  # type: ignore[var-annotated]
    assert len(values) == count
    assert asked == (["count", "freeze", "unfreeze"] if made_old else [])


@pytest.mark.usefixtures("served")
def test_a_short_sequence_is_freed_at_once() -> None:
    owner, there = owner_of(FREED_AT_ONCE)
    del owner
    assert there() == 0
