"""Robots of this process and of a server: both are the same to Python."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack

import pytest

import vrs_cli as vrs
from tests.net.serving import serving

New = Callable[[], vrs.Robot]


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Iterator[str]]:
    """The addresses of robots that nobody has moved yet."""
    cells = tuple(f"cell{k}" for k in range(70))
    with serving(tmp_path_factory.mktemp("served"), cells) as it:
        yield (f"{it.address}/robots/{cell}" for cell in cells)


@pytest.fixture(params=["here", "served"])
def new(request: pytest.FixtureRequest) -> Iterator[New]:
    """Makes robots of this process, and connects to robots of a server: both are the same to Python."""
    with ExitStack() as left:
        if request.param == "here":
            yield vrs.Robot
        else:
            addresses: Iterator[str] = request.getfixturevalue("served")
            yield lambda: left.enter_context(vrs.connect(next(addresses)))
