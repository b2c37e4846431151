"""What must hold for every text: diagnostics and VAL-II's errors, no other exception; printing settles; runs end."""

from __future__ import annotations

from collections import Counter
from io import StringIO
from math import isfinite
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

from rich.console import ConsoleDimensions

from tests.fuzz import lines
from tests.language.trees import without_places
from vrs_cli.errors import EndOfInput, VrsError
from vrs_cli.files.opening import Folder
from vrs_cli.interfaces.dialogue import Reading, Running
from vrs_cli.interfaces.inspection import Inspector, inspect
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.tasks.limits import Limits
from vrs_cli.kinematics.joints import joints_outside
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.language.analysis.structure import canonical_text
from vrs_cli.language.text.ast import Program
from vrs_cli.language.text.parser import parse_file
from vrs_cli.render.console import TerminalRenderer
from vrs_cli.values.commands import SetParameter
from vrs_cli.values.diagnostics import Dialect, show
from vrs_cli.values.questions import Answer, Confirmation, LineWanted, OnScreen, Question
from vrs_cli.values.replies import Reply

BOUNDS = Limits(max_time=20.0, max_steps=150, max_elements=10_000, max_output=10_000, max_disk=10_000)
MOST_LINES = 15  # of a text that are typed at the prompt
MOST_PROGRAMS = 3  # of a text that are run
LINES = ("1, 2, 3", "abc", "")  # what is typed where a program reads


class Silent:
    """A terminal that nobody looks at: what is said is drawn, and what is asked is answered for a while."""

    attended = False

    def __init__(self) -> None:
        self._lines = iter(LINES)
        self._renderer = TerminalRenderer(StringIO())
        self._renderer.console.size = ConsoleDimensions(80, 24)

    def type(self, text: str, newline: bool) -> None:
        assert isinstance(text, str)
        assert newline in (True, False)

    def progress(self, doing: Running | Reading) -> None:
        assert doing is not None

    def ask(self, question: Question) -> Answer:
        if isinstance(question, OnScreen):
            return None
        if isinstance(question, Confirmation):
            return True
        said = next(self._lines, None)
        if said is None and isinstance(question, LineWanted):
            raise EndOfInput(f"PROMPT {question.text!r}")
        return said or ""

    def show(self, reply: Reply) -> None:
        assert isinstance(self._renderer.to_text(reply), str)


class Probe:
    """Reads, prints, checks, types and runs texts, in a folder whose files are gone afterwards. `counted`: how many
    times each of these was done.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = Folder(folder, closed=True)
        model = load_robot("puma560")
        self._inspectors = {dialect: Inspector(model, dialect) for dialect in Dialect}
        self._model, self._unchanged = model, folder.stat().st_mtime_ns
        self.counted: Counter[str] = Counter()

    def __call__(self, text: str) -> None:
        """Raises AssertionError, or what should never be raised."""
        for dialect in Dialect:
            self._check(text, dialect)
            self._format(text, dialect)
        session = Session(Silent(), self._model, folder=self._folder, limits=BOUNDS)
        try:
            self._run(session, text)
            self._type(session, text)
        finally:
            session.close()
            self._clear()

    def _check(self, text: str, dialect: Dialect) -> None:
        """Diagnostics have a place in the text and can be shown; a file is as wrong by itself as after others."""
        inspector = self._inspectors[dialect]
        found = inspector.inspect(inspector.read(text))
        if dialect is Dialect.VPLUS and not self.counted["checked"] % 50:
            assert found == inspect(text, self._model), "found otherwise after other texts"
        lines = text.splitlines() or [""]
        for one in found:
            assert one.span.line >= 1
            assert one.span.column >= 1
            assert one.span.end >= one.span.column
            assert one.label
            assert show(one, lines[min(one.span.line, len(lines)) - 1])
        self.counted["checked"] += 1

    def _format(self, text: str, dialect: Dialect) -> None:
        """What is printed means the same, and is printed the same."""
        printed = canonical_text(text, dialect)
        self.counted["formatted"] += 1
        if isinstance(printed, str):
            assert canonical_text(printed, dialect) == printed, "printing twice changes the text"
            assert _meaning(printed, dialect) == _meaning(text, dialect), "printed, it means something else"
            self.counted["printed and read again"] += 1

    def _run(self, session: Session, text: str) -> None:
        """The programs of the text, for a few steps each."""
        session.load_text(text)
        names = [part.name for part in parse_file(text)[0].parts if isinstance(part, Program)]
        for name in names[:MOST_PROGRAMS]:
            try:
                result = session.execute(name)
            except VrsError:
                continue
            assert result.ended >= result.started
            self.counted["run"] += 1

    def _type(self, session: Session, text: str) -> None:
        """Its lines at the prompt."""
        for line in text.splitlines()[:MOST_LINES]:
            one_line(session, line)
            self.counted["typed"] += 1

    def _clear(self) -> None:
        """A folder in which nothing was made or removed is not read: there are many texts, and few files."""
        if self._folder.root.stat().st_mtime_ns == self._unchanged:
            return
        for path in sorted(self._folder.root.rglob("*"), reverse=True):
            path.rmdir() if path.is_dir() and not path.is_symlink() else path.unlink()
        self._unchanged = self._folder.root.stat().st_mtime_ns


def _meaning(text: str, dialect: Dialect) -> object:
    """Its trees without their places."""
    return without_places(parse_file(text, dialect)[0].parts)


def probe(text: str) -> None:
    """One text by itself."""
    with TemporaryDirectory() as folder:
        Probe(Path(folder))(text)


# --- numbers at the prompt -------------------------------------------------------------------------------------------

TYPED = 40  # lines of one session
PROGRAM = ".PROGRAM main(x)\nDRIVE 1, x, x\nDELAY x\n.END\n.LOCATIONS\na 0 450 -150 90 90 0\n#p 0 -90 90 0 0 0\n.END\n"


def typed(random: Random) -> int:
    """A session of lines with extreme numbers: they are refused, or done, and the robot is somewhere. How many."""
    with TemporaryDirectory() as folder:
        session = Session(Silent(), limits=BOUNDS, folder=Folder(Path(folder)))
        session.load_text(PROGRAM)
        session.engine.perform(SetParameter("PROFILE", random.choice(("LSPB", "SCURVE"))))
        for _ in range(TYPED):
            one_line(session, lines.line(random))
        session.close()
    return TYPED


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
