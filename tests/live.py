"""Which tests run in real time: those whose module, or a fixture of theirs, reaches a process, a thread, a socket or a
browser, itself or through another module of the tests.

The machine they run on may be busy at the wrong moment, so they may be tried again. What computes alone may not.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from functools import cache
from types import ModuleType

import pytest

REAL = {"http", "playwright", "signal", "socket", "subprocess", "threading", "urllib", "websockets"}
PATIENCE = 60.0  # [s] until a test fails that waits for something real: a busy machine keeps it waiting
PAUSE = 0.002  # [s] between two looks
AGAIN = 2  # times that a failed one is tried again
MARKS = (pytest.mark.live, pytest.mark.flaky(reruns=AGAIN))  # `flaky` is the word of pytest-rerunfailures


def until(condition: Callable[[], object], what: str = "") -> None:
    """Wait until a condition holds."""
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline, f"not so after {PATIENCE:g} s: {what or condition}"
        time.sleep(PAUSE)


def mark_live(tests: list[pytest.Item]) -> None:
    for test in tests:
        if any(_is_live(name) for name in _modules_of(test)):
            for mark in MARKS:
                test.add_marker(mark)


def _modules_of(test: pytest.Item) -> Iterator[str]:
    """Its own, and those of its fixtures."""
    yield test.module.__name__  # type: ignore[attr-defined]
    fixtures = test._fixtureinfo.name2fixturedefs  # type: ignore[attr-defined]
    yield from (definition.func.__module__ for definitions in fixtures.values() for definition in definitions)


@cache
def _is_live(name: str) -> bool:
    """Whether a module of the tests reaches what is real."""
    origins = {_origin(value) for value in vars(sys.modules[name]).values()} - {name}
    return any(
        origin.partition(".")[0] in REAL or (origin.startswith("tests.") and _is_live(origin)) for origin in origins
    )


def _origin(value: object) -> str:
    """The module which that is, or is from."""
    origin = value.__name__ if isinstance(value, ModuleType) else getattr(value, "__module__", None)
    return origin if isinstance(origin, str) else ""
