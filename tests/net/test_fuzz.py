"""A few thousand of the inputs of `tests/net/fuzz.py`."""

from __future__ import annotations

import pytest

from tests.examples import in_full, some
from tests.net.fuzz import run


@pytest.mark.parametrize("seed", range(some(3) if in_full() else 1))
def test_whatever_comes_to_either_end(seed: int) -> None:
    counts = run(1500, seed)
    for what in ("server: Line", "server: closed", "client: Delta", "client: Told", "client: closed"):
        assert counts[what]
