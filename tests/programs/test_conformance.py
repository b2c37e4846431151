"""Small programs, one theme each: what they type is worked out by hand from the rules of the language.

The first program of a file is executed. Its header lines say what else there is:

    ; signals: t, n, state      an input changes at a time (ON, OFF, 1, 0)
    ; expect: text              a line that is typed; without one nothing may be
    ; fault: code program step  the program stops there with an error
"""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.interfaces.terminals import RecordingTerminal
from tests.programs.test_samples import keeps_limits
from vrs_cli.files.signal_file import parse_signals
from vrs_cli.interfaces.driver import Bounds, Outcome
from vrs_cli.interfaces.session import Session

CONFORMANCE = Path(__file__).parent / "conformance"
PROGRAMS = sorted(CONFORMANCE.glob("*.v2"))


def header(text: str, word: str) -> list[str]:
    """What stands after `; word:` in each line that begins so."""
    start = f"; {word}:"
    return [line.removeprefix(start).strip() for line in text.splitlines() if line.startswith(start)]


def test_there_are_programs() -> None:
    assert len(PROGRAMS) >= 130


@pytest.mark.parametrize("path", PROGRAMS, ids=lambda path: path.stem)
def test_program(path: Path) -> None:
    text = path.read_text()
    session = Session(RecordingTerminal(), bounds=Bounds(max_time=100.0))
    diagnostics = session.load_text(text)
    assert not [one for one in diagnostics if one.severity.name == "ERROR"], diagnostics
    session.driver.inputs = parse_signals("\n".join(header(text, "signals")))
    result = session.execute(next(iter(session.environment.programs.values())).name)
    assert [line.strip() for line in result.typed] == header(text, "expect")
    fault = result.fault
    stopped = [] if fault is None else [f"{fault.code} {fault.program} {fault.step}"]
    assert stopped == header(text, "fault")
    assert result.outcome in (Outcome.COMPLETED, Outcome.HALTED, Outcome.FAILED)
    keeps_limits(session)
