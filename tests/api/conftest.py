"""Give tests robots of this process and of a server, which behave the same in Python."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack

import pytest

import vrs_cli as vrs
from tests.net.serving import serving

New = Callable[[], vrs.Robot]


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Iterator[str]]:
    """Yield an iterator of addresses of robots that have not moved yet."""
    cells = tuple(f"cell{k}" for k in range(70))
    with serving(tmp_path_factory.mktemp("served"), cells) as it:
        yield (f"{it.address}/robots/{cell}" for cell in cells)


@pytest.fixture(params=["here", "served"])
def new(request: pytest.FixtureRequest) -> Iterator[New]:
    """Yield a function that makes robots of this process, or one that connects to robots of a server."""
    with ExitStack() as left:
        if request.param == "here":
            yield vrs.Robot
        else:
            addresses: Iterator[str] = request.getfixturevalue("served")
            yield lambda: left.enter_context(vrs.connect(next(addresses)))
