"""How many examples a law is tried on: few in the fast run, many in `pytest --hypothesis-profile=long`.

Hypothesis finds the same examples every time, and takes the time it needs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import pytest
from hypothesis import HealthCheck, settings

USUAL = 100  # to which the numbers in the tests are in proportion
FEWEST = 2  # of any law
PROFILES = {"fast": 10, "long": 1000}

for _name, _count in PROFILES.items():
    settings.register_profile(
        _name, max_examples=_count, derandomize=True, deadline=None, suppress_health_check=list(HealthCheck)
    )


def in_full() -> bool:
    """Return whether this is the long run."""
    return settings().max_examples == PROFILES["long"]


def only_in_full() -> pytest.MarkDecorator:
    """Mark a test that the fast run leaves out, as others hold nearly all of its law: `@only_in_full()`."""
    return pytest.mark.skipif(not in_full(), reason="only with --hypothesis-profile=long")


def first(count: int, cases: Iterable[object]) -> list[object]:
    """Return the cases of a law for `parametrize`: the fast run has the first so many, `-m long` the others."""
    return quick(cases, lambda number, _case: number < count)


def quick(cases: Iterable[object], is_quick: Callable[[int, Any], bool]) -> list[object]:
    """Return cases for `parametrize`: `-m long` has those that are not quick, by their number or themselves."""
    return [
        case
        if is_quick(number, case)
        else pytest.param(*(case if isinstance(case, tuple) else (case,)), marks=pytest.mark.long)
        for number, case in enumerate(cases)
    ]


def some(many: int) -> int:
    """How many of so many usual examples this run takes."""
    return max(min(many, FEWEST), many * settings().max_examples // USUAL)


def examples(many: int) -> settings:
    """For a test: `@examples(400)`."""
    return settings(max_examples=some(many))
