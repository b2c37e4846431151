"""A server that is killed comes back with all it has answered; `python -m tests.net.kills 200` does it for long."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.net.kills import kill


@pytest.mark.long
def test_two_kills(tmp_path: Path) -> None:
    kill(2, 3, tmp_path)
