"""The language by its reference: every program of conformance/ types what its `; expect:` lines say.

The first program of a file is run, without faults, and the expectations were worked out from the manual by hand.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.interfaces.terminals import RecordingTerminal
from tests.programs.test_samples import expectations
from vrs_cli.interfaces.driver import Outcome
from vrs_cli.interfaces.session import Session

PROGRAMS = sorted((Path(__file__).parent / "conformance").glob("*.v2"))


def test_there_are_programs() -> None:
    assert len(PROGRAMS) >= 50


@pytest.mark.parametrize("path", PROGRAMS, ids=lambda path: path.stem)
def test_conformance(path: Path) -> None:
    text = path.read_text()
    expected = expectations(text)
    assert expected, f"{path.name} says nothing of what it does"
    session = Session(RecordingTerminal())
    assert session.load_text(text) == ()
    result = session.execute(next(iter(session.environment.programs.values())).name)
    assert result.fault is None
    assert result.outcome is Outcome.COMPLETED
    assert [line.strip() for line in result.typed] == expected
