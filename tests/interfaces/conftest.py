"""A session at a terminal that writes down what it is shown."""

from __future__ import annotations

import pytest

from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.interfaces.session.session import Session


@pytest.fixture
def terminal() -> RecordingTerminal:
    return RecordingTerminal()


@pytest.fixture
def session(terminal: RecordingTerminal) -> Session:
    return Session(terminal)
