"""The examples of the monitor commands do what they say: each of a supported command is typed at the prompt."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.interfaces.session.session import Session
from vrs_cli.language.words.monitor import COMMANDS
from vrs_cli.language.words.word import State, Word
from vrs_cli.values.replies import DiagnosticsReport

PROGRAMS = """
.PROGRAM pick(where, height)
    TYPE "pick"
    x = 1
    count = count+1
.END
.PROGRAM watch(where)
    WAIT SIG(2002)
.END
.PROGRAM pick.place()
    TYPE "one"
    TYPE "two"
    TYPE "three"
.END
.PROGRAM place()
    TYPE "place"
.END
.PROGRAM old()
    TYPE "old"
.END
.PROGRAM demo()
    TYPE "demo"
.END
.LOCATIONS
part 300 450 -100 90 90 0
a 400 300 -100 90 90 0
b 450 300 -100 90 90 0
corner 10 20 0 90 90 0
grip 0 0 20 90 -90 0
gripper 0 0 50 90 -90 0
#safe 0 -90 90 0 0 0
.END
.REALS
count 3
x 1
.END
.STRINGS
$name "pick"
$part "A-17"
.END
"""
BEFORE = {  # what an example needs to have happened
    "PROCEED": ["PRIME pick.place"],
    "RETRY": ["PRIME pick.place"],
    "ABORT": ["EXECUTE 2 watch(part)"],
    "KILL": ["PRIME pick.place"],
    "CYCLE.END": ["PRIME pick.place"],
    "SSTEP": ["PRIME pick.place"],
    "XSTEP": ["PRIME pick.place"],
    "NEXT": ["PRIME pick.place"],
    "PCABORT": ["PCEXECUTE watch(part)"],
    "PCEND": ["PCEXECUTE watch(part)"],
    "PCPROCEED": ["PCEXECUTE watch(part)", "PCABORT"],
    "PCRETRY": ["PCEXECUTE watch(part)", "PCABORT"],
    "UNDO": ["MOVE part"],
    "REDO": ["MOVE part", "UNDO"],
    "COMPARE": ["BRANCH trial", "MOVE part", "BRANCH main"],
    "MERGE": ["BRANCH trial", "MOVE part"],
    "DELETEB": ["BRANCH trial", "BRANCH main"],
    "TIMELINE": ["MOVE part"],
    "PLOT": ["MOVE part"],
    "SAVE": ["MOVE part"],
}
ELSEWHERE = {"SEE", "REPLAY", "EDIT", "LOG", "CLOCK", "RESYNC"}  # they need a screen, a shell, a body, or a wall clock
SAMPLE = '.PROGRAM other()\n    TYPE "other"\n.END\n'


@pytest.fixture(autouse=True)
def _files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("pick.v2", "pick.pg", "old.v2", "cell.v2", "cell.lc", "cell.pg"):
        (tmp_path / name).write_text(SAMPLE)
    (tmp_path / "cells").mkdir()
    (tmp_path / "start.pc").write_text(".PROGRAM start()\n    MC SPEED 50\n.END\n")


def try_it(row: Word) -> None:
    """The example after what it needs; what is refused raises."""
    session = Session(RecordingTerminal(["", "", ""]))
    session.draw = lambda path, _plot: path.touch()
    wrong = [one for one in session.load_text(PROGRAMS) if one.severity.name == "ERROR"]
    assert not wrong, wrong
    for line in BEFORE.get(row.name, ()):
        session.perform(line)
    session.perform(row.example)
    assert isinstance(session.terminal, RecordingTerminal)
    assert not any(isinstance(one, DiagnosticsReport) for one in session.terminal.replies)
    session.close()


SUPPORTED = [row for row in COMMANDS.values() if row.state is State.SUPPORTED and row.name not in ELSEWHERE]


@pytest.mark.parametrize("row", SUPPORTED, ids=lambda row: row.name)
def test_the_example_of_a_command_is_carried_out(row: Word) -> None:
    try_it(row)
