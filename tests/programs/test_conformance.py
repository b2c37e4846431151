"""Small programs, one theme each: what they type is worked out by hand from the rules of the language.

The first program of a file is executed. Its header lines say what else there is:

    ; signals: t, n, state      an input changes at a time (ON, OFF, 1, 0)
    ; file: name text           a line of a file that is there before
    ; answer: text              a line that is typed in
    ; expect: text              a line that is typed; without one nothing may be
    ; written: name text        a line of a file that is there after; no other files may be
    ; fault: code program step  the program stops there with an error
"""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.interfaces.terminals import RecordingTerminal
from tests.programs.test_samples import keeps_limits
from vrs_cli.files.opening import Folder
from vrs_cli.files.timed_lines import parse_signals
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.tasks.limits import Limits
from vrs_cli.values.results import RunOutcome

CONFORMANCE = Path(__file__).parent / "conformance"
PROGRAMS = sorted(CONFORMANCE.glob("*.v2"))


def header(text: str, word: str) -> list[str]:
    """What stands after `; word:` in each line that begins so."""
    start = f"; {word}:"
    return [line.removeprefix(start).strip() for line in text.splitlines() if line.startswith(start)]


def files(lines: list[str]) -> dict[str, str]:
    """The files that `name text` lines make up."""
    found: dict[str, str] = {}
    for line in lines:
        name, _, text = line.partition(" ")
        found[name] = f"{found.get(name, '')}{text}\n"
    return found


def test_there_are_programs() -> None:
    assert len(PROGRAMS) >= 290


@pytest.mark.parametrize("path", PROGRAMS, ids=lambda path: path.stem)
def test_program(path: Path, tmp_path: Path) -> None:
    text = path.read_text()
    for name, content in files(header(text, "file")).items():
        (tmp_path / name).write_text(content)
    session = Session(RecordingTerminal(header(text, "answer")), limits=Limits(max_time=100.0), folder=Folder(tmp_path))
    diagnostics = session.load_text(text)
    assert not [one for one in diagnostics if one.severity.name == "ERROR"], diagnostics
    session.driver.inputs = parse_signals("\n".join(header(text, "signals")))
    result = session.execute(next(iter(session.environment.programs.values())).name)
    assert [line.strip() for line in result.typed] == header(text, "expect")
    fault = result.fault
    stopped = [] if fault is None else [f"{fault.code} {fault.program} {fault.step}"]
    assert stopped == header(text, "fault")
    assert result.outcome in (RunOutcome.COMPLETED, RunOutcome.HALTED, RunOutcome.FAILED)
    session.close()
    assert {one.name: one.read_text() for one in tmp_path.iterdir()} == files(header(text, "written"))
    keeps_limits(session)
