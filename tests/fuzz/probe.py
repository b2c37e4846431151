"""What must hold for every text: diagnostics and VAL-II's errors, no other exception; printing settles; runs end."""

from __future__ import annotations

from math import isfinite
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

from tests.fuzz import numbers
from vrs_cli.dialogue.questions import Answer, LineWanted, Question
from vrs_cli.dialogue.replies import Reply
from vrs_cli.dialogue.talk import Reading, Running
from vrs_cli.engine.commands import SetParameter
from vrs_cli.errors import EndOfInput, VrsError
from vrs_cli.files.bounds import Folder
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.tasks.limits import Limits
from vrs_cli.kinematics.joints import joints_outside
from vrs_cli.language.analysis.analyzer import check_line
from vrs_cli.language.text.ast import Program
from vrs_cli.language.text.diagnostics import LineRefused, Severity, show
from vrs_cli.language.text.parser import parse_file, parse_prompt
from vrs_cli.language.text.printer import print_file

BOUNDS = Limits(max_time=20.0, max_steps=300)


class Silent:
    """A terminal that nobody sits at."""

    attended = False

    def type(self, text: str, newline: bool) -> None:
        assert isinstance(text, str)
        assert newline in (True, False)

    def progress(self, doing: Running | Reading) -> None:
        assert doing is not None

    def ask(self, question: Question) -> Answer:
        if not isinstance(question, LineWanted):
            return not question.text
        raise EndOfInput(f"PROMPT {question.text!r}")

    def show(self, reply: Reply) -> None:
        assert reply is not None


def probe(text: str) -> None:
    """Read, print, analyze and run a text. Raises AssertionError, or what should never be raised."""
    read_and_print(text)
    at_the_prompt(text)
    run(text)


def read_and_print(text: str) -> None:
    """Diagnostics have a place in the text and can be shown; what is printed is read and printed the same."""
    file, diagnostics = parse_file(text)
    lines = text.splitlines() or [""]
    for one in diagnostics:
        assert one.span.line >= 1
        assert one.span.column >= 1
        assert one.span.end >= one.span.column
        assert show(one, lines[min(one.span.line, len(lines)) - 1])
    if any(one.severity is Severity.ERROR for one in diagnostics):
        return
    printed = print_file(file)
    again, found = parse_file(printed)
    assert not any(one.severity is Severity.ERROR for one in found), f"printed, then refused: {found[0].message}"
    assert print_file(again) == printed, "printing twice changes the text"


def at_the_prompt(text: str) -> None:
    """Every line, as typed at the prompt."""
    for line in text.splitlines()[:8]:
        try:
            statement = parse_prompt(line)
        except LineRefused:
            continue
        if statement is not None:
            check_line(statement)


def run(text: str) -> None:
    """The programs of the text, for a few steps each; their files are in a folder of their own."""
    with TemporaryDirectory() as folder:
        session = Session(Silent(), folder=Folder(Path(folder)))
        run_in(session, text)
        session.close()


def run_in(session: Session, text: str) -> None:
    session.load_text(text)
    names = [part.name for part in parse_file(text)[0].parts if isinstance(part, Program)]
    for name in names[:3]:
        try:
            result = session.execute(name, limits=BOUNDS)
        except VrsError:
            continue
        assert result.ended >= result.started


# --- numbers at the prompt -------------------------------------------------------------------------------------------

LINES = 40  # of one session
PROGRAM = ".PROGRAM main(x)\nDRIVE 1, x, x\nDELAY x\n.END\n.LOCATIONS\na 0 450 -150 90 90 0\n#p 0 -90 90 0 0 0\n.END\n"


def typed(random: Random) -> int:
    """A session of lines with extreme numbers: they are refused, or done, and the robot is somewhere. How many."""
    with TemporaryDirectory() as folder:
        session = Session(Silent(), limits=BOUNDS, folder=Folder(Path(folder)))
        session.load_text(PROGRAM)
        session.engine.perform(SetParameter("PROFILE", random.choice(("LSPB", "SCURVE"))))
        for _ in range(LINES):
            one_line(session, numbers.line(random))
        session.close()
    return LINES


def one_line(session: Session, text: str) -> None:
    try:
        session.perform(text)
    except (VrsError, KeyboardInterrupt):
        pass
    except Exception as error:
        error.add_note(text)
        raise
    engine = session.engine
    at_end = engine.position(engine.end)
    assert isfinite(engine.now), text
    assert isfinite(engine.end), text
    assert not joints_outside(at_end.joints, engine.model.lower, engine.model.upper), text
    assert all(map(isfinite, at_end.T_world_tool)), text
