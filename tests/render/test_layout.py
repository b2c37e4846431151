"""Test replies as plain text and on a terminal: equal numbers, fitting columns, never -0.000."""

from __future__ import annotations

import re
from contextlib import chdir
from io import StringIO
from pathlib import Path
from typing import get_args

import pytest

from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.engine.engine import Engine
from vrs_cli.interfaces.session.session import Session
from vrs_cli.kinematics.joints import TURNING
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import IDENTITY
from vrs_cli.render.console import TerminalRenderer
from vrs_cli.render.layout import LAYOUTS
from vrs_cli.render.text import plain_text
from vrs_cli.values import replies
from vrs_cli.values.measured import BodyMode, BodySeen, DivergenceAlarm, DivergenceCause, OnAlarm, Report, ReportCounts
from vrs_cli.values.replies import Reply
from vrs_cli.values.results import Position, ResyncReport, Untrue

WIDTHS = (60, 80, 120)
LINES = """\
WHERE
WHERE AT 0.5
WHERE FROM 0 TO 1
SHOW
SHOW AT 0.5
SET part = TRANS(500,150,-100,90,90,0)
HERE #safe
WHY part
WHY #safe
WHY TRANS(1500,150,-100,90,90,0)
WHY TRANS(400,150,-100,90,90,0)
SET tiny = TRANS(-1E-6, -1E-5, -0.0001, -1E-6, 0, -1E-6)
a = -1E-9
LISTL
LISTR 5, a
$a = "text"
LISTS
LISTP
DIRECTORY
STATUS
STATUS AT 0.5
EXECUTE p
STATUS
IO
SWITCH
PARAMETER
TIME
ID
FREE
BODY
HELP
HELP SPEED
TIMELINE
PLOT
PLOT X, Y, Z
UNDO
REDO
DRIVE 1, 5 AT 900
UNDO
DRIVE 5, 5 AT 900
DRIVE 6, 5 AT 899.9
UNDO 2
BRANCH trial
DRIVE 6, 20
BRANCH
COMPARE
WHERE MEASURED
COMPARE MEASURED
MERGE
HELP MOTION
EDIT q, 2
E
EXPLAIN
EXPLAIN DRIVE 1, 5 AT 900
EXPLAIN MOVES TRANS(3000)
EXPLAIN HERE:HERE
EXPLAIN OAT HERE
EXPLAIN IK HERE
EXPLAIN SPLICE
FDIRECTORY programs
FLIST programs/hello.v2
EXIT
""".splitlines()


@pytest.fixture(scope="module")
def answers() -> list[Reply]:
    """Return one reply of nearly every kind, by commands."""
    with chdir(Path(__file__).parents[2]):
        return _answers()


def _answers() -> list[Reply]:
    terminal = RecordingTerminal()
    session = Session(terminal)
    for reply in session.load_text(".PROGRAM p ;first\nMOVF x\n.END\n.PROGRAM q\nDRIVE 1,60\nPAUSE\n.END\n"):
        terminal.show(replies.DiagnosticsReport((replies.Diagnosed(reply, "MOVF x", "p.v2"),)))
    session.engine.measured.add([Report(0.0, (0.1,) * 6)])
    for line in ["EXECUTE q", *(line for line in LINES if line != "EXECUTE p")]:
        session.perform(line)
    rows = tuple(replies.ReplayRow(k, "READY" * k, float(k), IDENTITY) for k in (0, 1))
    parts = (
        replies.PartRow("box", 2.0, IDENTITY, held=True),
        replies.PartRow("lid", 2.0, IDENTITY, on="table"),
        replies.PartRow("nut", 2.0, IDENTITY),
        replies.PartRow("bolt", 2.0, None),
    )
    reading = Untrue(7, 1001, True, True, 3.2, "pick step 4: WAIT SIG(1001)", "MOVE b", "part.there")
    more = replies.PartTable(parts, True), replies.NoLongerTrue((reading,)), replies.ReplayTable(rows)
    seen = BodySeen("arm", BodyMode.STOPPED, BodyMode.HOLDS, ReportCounts(5, 1), 2.5, -0.0000001, -1e-9, 0.2, 100.0)
    alarm = DivergenceAlarm(2.0, 2, 0.1, 0.05, DivergenceCause.BLOCKED, "joint 2 stands still", 1.8)
    done = replies.Resynchronised(ResyncReport(2.0, 2.5, (0.1, 0.2), "MOVE a"), TURNING)
    bodies = [replies.BodyReport(seen, 2.5, OnAlarm.HOLD, alarm), replies.BodyReport(BodySeen(""))]
    return [*terminal.replies, *more, *bodies, done]


def drawn(reply: Reply, width: int) -> str:
    """Return a reply as a terminal without colours shows it."""
    stream = StringIO()
    TerminalRenderer(stream, width).draw(reply)
    return stream.getvalue()


def test_every_reply_has_a_layout(answers: list[Reply]) -> None:
    assert set(LAYOUTS) == set(get_args(Reply))
    assert {type(reply) for reply in answers} == set(LAYOUTS)


def test_no_zero_has_a_sign(answers: list[Reply]) -> None:
    assert not re.search(r"-0\.0+\b", "".join(map(plain_text, answers)))


def test_plain_text_has_no_colours_and_no_blanks_at_line_ends(answers: list[Reply]) -> None:
    for reply in answers:
        text = plain_text(reply)
        assert "\x1b" not in text
        assert all(line == line.rstrip() for line in text.split("\n"))
        assert text.isascii() or isinstance(reply, replies.ProgramText)


@pytest.mark.parametrize("width", WIDTHS)
def test_a_terminal_is_never_overrun(answers: list[Reply], width: int) -> None:
    for reply in answers:
        assert all(len(line) <= width for line in drawn(reply, width).split("\n")), type(reply)


@pytest.mark.parametrize("width", WIDTHS)
def test_a_terminal_shows_the_same_words(answers: list[Reply], width: int) -> None:
    """The order differs if columns go below each other, and rules are added; drawings depend on the width."""
    for reply in answers:
        if not isinstance(reply, replies.Plot | replies.ArmPicture):
            missing = set(plain_text(reply).split()) - set(drawn(reply, width).split())
            assert not missing, type(reply)


def test_where_as_val_prints_it() -> None:
    engine = Engine(load_robot("puma560"))
    assert plain_text(replies.Whereabouts(engine.position())).splitlines() == [
        "         X         Y         Z         O         A         T      Hand",
        "   -20.320   149.090   921.120    90.000   -90.000     0.000     0.000",
        "       JT1       JT2       JT3       JT4       JT5       JT6",
        "     0.000   -90.000    90.000     0.000     0.000     0.000",
    ]


def test_colours_are_on_where_the_terminal_has_them(answers: list[Reply], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("TERM", "xterm-256color")
    assert "\x1b[" in drawn(answers[1], 80)


def test_nothing_to_list_says_so() -> None:
    empty = (
        replies.LocationTable(()),
        replies.RealTable(()),
        replies.StringTable(()),
        replies.ProgramNames(()),
    )
    texts = [plain_text(reply) for reply in empty]
    assert texts == [f"No {what}\n" for what in (
        "locations defined", "reals defined", "strings defined", "programs in memory"
    )]  # fmt: skip


def test_an_undefined_location_is_named() -> None:
    table = replies.LocationTable((replies.NamedLocation("part"),))
    assert plain_text(table).splitlines()[1].split() == ["part", "undefined"]


def test_signals_that_are_on_are_shown_wherever_they_are() -> None:
    states = tuple(number == 100 for number in range(1, 513))
    text = plain_text(replies.SignalTable((replies.SignalBank("Outputs", 1, states),)))
    assert text.splitlines() == [
        "Outputs",
        "    1-  0000 0000 0000 0000",
        "   17-  0000 0000 0000 0000",
        "   97-  0001 0000 0000 0000",
    ]


def test_a_long_timeline_shows_its_end_on_a_terminal_and_all_of_it_on_paper() -> None:
    terminal = RecordingTerminal()
    session = Session(terminal)
    for _ in range(150):
        session.perform("DRIVE 1, 1")
        session.perform("DRIVE 1, -1")
    session.perform("TIMELINE")
    reply = terminal.replies[-1]
    assert plain_text(reply).count("DRIVE") == 300 * 3
    on_terminal = drawn(reply, 80)
    assert "The first 100 commands are not shown" in on_terminal
    assert on_terminal.count("DRIVE") == 200 + 200


def test_position_rows_are_positions() -> None:
    engine = Engine(load_robot("puma560"))
    positions: tuple[Position, ...] = (engine.position(0.0), engine.position(1.0))
    lines = plain_text(replies.WhereaboutsTable(positions)).splitlines()
    assert [len(line.split()) for line in lines] == [14, 14, 14]
