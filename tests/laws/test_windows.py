"""A book with a small window is the same book, after kills too; `python -m tests.laws.windows 1000` tries many."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.examples import first
from tests.laws.windows import check_window, small_parts


@pytest.mark.parametrize("seed", first(2, range(4)))
def test_a_book_with_a_window_is_the_same(tmp_path: Path, seed: int) -> None:
    with small_parts():
        check_window(seed, tmp_path)
