"""Lines typed beside a program of another client are answered; `python -m tests.net.onlookers 1000` types many."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.net.onlookers import watch

pytest.importorskip("pty")


@pytest.mark.long
def test_lines_beside_a_program_are_answered(tmp_path: Path) -> None:
    watch(15, 3, tmp_path)
