"""After a fault RESYNC brings body and timeline together in time, and the timeline never jumps."""

from __future__ import annotations

import pytest

from tests.examples import first
from tests.laws.resync import outcome


@pytest.mark.parametrize("name", first(1, ["emergency stop", "body restarts"]))
def test_the_body_follows_again_in_time(name: str) -> None:
    found = outcome(name, 0)
    assert found.after is not None
    assert found.after <= found.bound
    assert found.jump <= 1.0
