"""The examples of the tables do what they say: each of a supported instruction, function and operator is run."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.files.opening import Folder
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.tasks.limits import Limits
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.language.text import ast
from vrs_cli.language.text.parser import parse_step
from vrs_cli.language.words.functions import FUNCTIONS, LINKS, OPERATORS, Function, Operator
from vrs_cli.language.words.instructions import CONTROL, DECLARATIONS, INSTRUCTIONS
from vrs_cli.language.words.monitor import COMMANDS
from vrs_cli.language.words.word import State, Word
from vrs_cli.values.diagnostics import LineRefused, Severity
from vrs_cli.values.results import RunOutcome

SURROUNDINGS = """
.PROGRAM prepare()
    SET a = TRANS(400, 300, -100, 90, 90, 0)
    SET b = TRANS(450, 300, -100, 90, 90, 0)
    SET c = TRANS(400, 350, -100, 90, 90, 0)
    SET part = TRANS(300, 450, -100, 90, 90, 0)
    SET p = part
    SET corner = TRANS(10, 20, 0, 90, 90, 0)
    SET pallet = TRANS(300, 400, -100)
    SET grip = TRANS(0, 0, 20)
    SET gripper = TRANS(0, 0, 50)
    SET #safe = #PPOINT(0, -90, 90, 0, 0, 0)
    x = 3
    y = 4
    r = 5
    n = 5
    i = 1
    j = 1
    t = 0
    count = 2
    busy = 0
    row[0] = 7
    $a = "part"
    $b = "place"
    $s = "abcdefgh"
    $line = "pick, place"
    $name = "pick"
    $text = "a text"
    MOVE part
    SIGNAL 2001
.END
.PROGRAM pick(where, height)
    z = 1
.END
.PROGRAM watch(where)
    WAIT SIG(2002)
.END
.PROGRAM guard.open()
.END
.PROGRAM stopped()
.END
.PROGRAM mend()
.END
.PROGRAM fails()
    TYPE nowhere.given
    WAIT SIG(2002)
.END
"""

ATTACHED = ['ATTACH (lun, 4) "DISK"']
WRITTEN = [*ATTACHED, 'FOPENW (lun) "log.txt"', 'WRITE (lun) "1 2 three"', "FCLOSE (lun)"]
OPENED = [*WRITTEN, 'FOPENR (lun) "log.txt"']
BEFORE = {  # what an example needs to have happened
    "DBLB": ["$s = $DBLB(1.5)"],
    "TRANSB": ["$s = $TRANSB(HERE)"],
    "DETACH": ATTACHED,
    "FOPENW": ATTACHED,
    "FOPENA": WRITTEN,
    "FOPENR": WRITTEN,
    "FDELETE": WRITTEN,
    "FOPEN": ['ATTACH (lun, 4) "TCP"'],
    "FCMND": ['ATTACH (lun, 4) "TCP"', "handle = 1"],
    "FCLOSE": OPENED,
    "WRITE": [*ATTACHED, 'FOPENW (lun) "log.txt"'],
    "READ": OPENED,
    "GETC": OPENED,
    "IOSTAT": OPENED,
    "ALTER": ["ALTON 3"],
    "SOLVE.ANGLES": ["DECOMPOSE row[1] = #safe"],
    "SOLVE.TRANS": ["DECOMPOSE row[1] = #safe"],
    **{name: ["PARAMETER LATCH.SIGNAL = 2007", "SIGNAL 2007"] for name in ("LATCH", "#PLATCH", "LATCHED")},
    "$UNPACK": ["PACK $a[0], 120, 20 = $text"],
    "ABORT": ["EXECUTE 2 watch(part)"],
    "KILL": ["EXECUTE 2 watch(part)", "WAIT", "ABORT 2", "WAIT"],
    "CYCLE.END": ["EXECUTE 2 watch(part)"],
    "PROCEED": ["EXECUTE 2 watch(part)", "WAIT", "ABORT 2", "WAIT"],
    "RETRY": ["EXECUTE 2 fails", "WAIT"],
    "SET.EVENT": ["EXECUTE 2 watch(part)"],
}
CLOSED_BY = {ast.If: "END", ast.While: "END", ast.Case: "END", ast.For: "END", ast.Do: "UNTIL TRUE"}
PAUSES = {"PAUSE": RunOutcome.PAUSED, "HALT": RunOutcome.HALTED}
ELSEWHERE = {"REMARK"}  # a comment
ROBOTS = {"SWIVEL": "panda"}  # what is of other robots than the PUMA; whose places they do not have


CALLED = re.compile(r"[#$]?[A-Z0-9.]+\(")


def lines_of(example: str) -> list[str]:
    """An example as lines of a program: an expression is typed, a block is closed."""
    try:
        statement = parse_step(example).statement
    except LineRefused:
        statement = None
    if statement is None or CALLED.match(example):
        return [f"TYPE {example}"]
    closer = CLOSED_BY.get(type(statement))
    return [example] if closer is None else ["x = 0", example, closer]


def run(lines: list[str], name: str = "") -> Session:
    """The lines in two loops, with a label after them; a declaration at the top."""
    lines = [*BEFORE.get(name, ()), *lines]
    top, inside = (lines, []) if name in DECLARATIONS else ([], lines)
    body = [*top, "FOR o.o = 1 TO 1", "FOR i.i = 1 TO 1", *inside, "END", "END", "10 z = 2"]
    robot = ROBOTS.get(name, "puma560")
    session = Session(RecordingTerminal(["5"]), load_robot(robot), limits=Limits(max_time=100.0))
    surroundings = ".PROGRAM prepare()\n.END" if name in ROBOTS else SURROUNDINGS
    text = "\n".join((".PROGRAM example()", *body, ".END", surroundings))
    wrong = [one for one in session.load_text(text) if one.severity is Severity.ERROR]
    assert not wrong, wrong
    session.execute("prepare")
    session.environment.signals.write(1001, inputs=True)
    result = session.execute("example")
    assert result.fault is None, result.fault
    assert result.outcome is PAUSES.get(name, RunOutcome.COMPLETED)
    return session


SUPPORTED = [row for row in INSTRUCTIONS.values() if row.state is State.SUPPORTED and row.name not in ELSEWHERE]


@pytest.mark.parametrize("row", SUPPORTED, ids=lambda row: row.name)
def test_the_example_of_an_instruction_runs(row: Word) -> None:
    run(lines_of(row.example), row.name)


@pytest.fixture(autouse=True)
def in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


USABLE = [row for row in FUNCTIONS.values() if row.state is State.SUPPORTED and row.name not in ELSEWHERE]


@pytest.mark.parametrize("row", USABLE, ids=lambda row: row.name)
def test_the_example_of_a_function_runs(row: Function) -> None:
    run(lines_of(row.example), row.name)


@pytest.mark.parametrize("row", [*OPERATORS.values(), *LINKS.values()], ids=lambda row: row.name)
def test_the_example_of_an_operator_runs(row: Operator) -> None:
    assert row.name in row.example
    run(lines_of(row.example))


AROUND = {  # what a word stands between
    "ELSE": ("IF x > 2 THEN", "END"),
    "UNTIL": ("DO",),
    "VALUE": ("CASE x OF", "END"),
    "ANY": ("CASE x OF", "END"),
    "END": ("IF x > 2 THEN",),
    "WHILE": ("x = 0", "END"),
    "DO": ("x = 0", "UNTIL TRUE"),
}


@pytest.mark.parametrize("row", CONTROL.values(), ids=lambda row: row.name)
def test_the_example_of_a_control_word_runs(row: Word) -> None:
    before, *after = AROUND.get(row.name, ("",))
    run([before, row.example, *after] if row.name in AROUND else lines_of(row.example))


# --- what is typed at the prompt -------------------------------------------------------------------------------------

MEMORY = """
.PROGRAM pick(part)
    READY
    READY
    READY
.END
.PROGRAM place
.END
.PROGRAM old
.END
.PROGRAM pick.place
    READY
    READY
    READY
.END
.PROGRAM watch
    PAUSE
    WAIT
.END
"""
FILES = {"pick.v2": "", "old.v2": "", "pick.pg": "", "cell.lc": "", "start.pc": "TIME\n"}
STOPPED, TRIED = ("EXECUTE watch",), ("BRANCH trial", "MOVE part")
TYPED_BEFORE = {
    **dict.fromkeys(("PROCEED", "RETRY", "SSTEP", "XSTEP", "NEXT"), STOPPED),
    **dict.fromkeys(("PCPROCEED", "PCRETRY"), ("PCEXECUTE watch", "DELAY 1")),
    **dict.fromkeys(("COMPARE", "MERGE"), TRIED),
    **dict.fromkeys(("LISTS", "DELETES"), ('$part = "nut"',)),
    "DELETEB": (*TRIED, "BRANCH main"),
    "REDO": ("MOVE part", "UNDO"),
    "REPLAY": ("SAVE demo.vrst",),
}
# they need the shell, a body, real time, or a program that runs while something is typed
TRIED_ELSEWHERE = {"SEE", "RESYNC", "LOG", "PLOT", "CLOCK", "CYCLE.END", "PCEND"}
COMMANDS_THERE = [row for row in COMMANDS.values() if row.state is State.SUPPORTED and row.name not in TRIED_ELSEWHERE]


@pytest.mark.parametrize("row", COMMANDS_THERE, ids=lambda row: row.name)
def test_the_example_of_a_command_runs(row: Word, tmp_path: Path) -> None:
    for name, text in FILES.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    (tmp_path / "cells").mkdir()
    session = Session(RecordingTerminal([""]), limits=Limits(max_time=100.0), folder=Folder(tmp_path))
    session.load_text(SURROUNDINGS)
    session.load_text(MEMORY)
    session.execute("prepare")
    for line in (*TYPED_BEFORE.get(row.name, ()), row.example):
        session.perform(line)
