"""All conversations of the kit."""

from __future__ import annotations

from collections.abc import Iterator

from tests.net.kit.connections import connections
from tests.net.kit.conversation import Conversation
from tests.net.kit.timelines import parts, robots, steered


def conversations() -> Iterator[Conversation]:
    yield from connections()
    yield from parts()
    yield from steered()
    yield from robots()
