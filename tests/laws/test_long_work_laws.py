"""Long work comes in parts, or is done by another thread: what others ask for meanwhile comes before it or after it."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from math import inf
from pathlib import Path
from threading import Event
from typing import Any
from weakref import finalize

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.interfaces.holders.holder import Holder
from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.engine import book
from vrs_cli.errors import RequestRefused, VrsError
from vrs_cli.files import program_file
from vrs_cli.interfaces.actor import actor
from vrs_cli.interfaces.dialogue import Ticket, quietly
from vrs_cli.interfaces.editor import buffer, editors
from vrs_cli.interfaces.monitor import programs
from vrs_cli.interfaces.session.acts import act_on
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.station import loaded_file
from vrs_cli.interfaces.station.loaded_file import LoadedFile
from vrs_cli.language.run import environment
from vrs_cli.language.text import parser
from vrs_cli.values.acts import Define

FILE = ".PROGRAM brought\nx = 1\nDRIVE 1, 5\n.END\n.REALS\nx 7\nrow[1] 8\n.END\n.LOCATIONS\np 1 2 3 0 0 0\n.END\n"
BEFORE = ("x = 1", "y = 2", "row[1] = 3", "DRIVE 1, 5", "DRIVE 2, 5", "UNDO", "BRANCH b", "DRIVE 3, 5", "BRANCH main")
LONG = ("UNDO {0}", "REDO {0}", "MERGE b", "LOAD brought", "STORE all", "LISTR", "LISTL", "COMPARE main, b")
LONG += ("DEFINE", "FLIST brought", "DIRECTORY", "EXECUTE brought")
MEANWHILE = ("DRIVE 4, 5", "x = 5", "p = 3", "DELETER x", "WHERE", "UNDO", "LISTR", "ABORT", "STOP")


class Beside:
    """What is to be done by threads is done when the test says so."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self.due: list[Any] = []
        self.put = self.due.append

    def thread(self, **_: object) -> Beside:
        return self

    def start(self) -> None:
        """Nothing is done by itself."""

    def do(self) -> None:
        """The last that was given."""
        self._session.actor._do_in_thread(*self.due.pop())


@contextmanager
def served(session: Session, at_once: int) -> Iterator[Beside]:
    """As in a server, but for who lets the threads run; and with small parts."""
    beside = Beside(session)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(actor, "Thread", beside.thread)
        patch.setattr(book, "CHANGES_AT_ONCE", at_once)
        patch.setattr(session.actor, "_works", beside)
        session.actor._server = beside  # type: ignore[assignment]
        yield beside
        session.actor._server = None


def begun(lines: list[str], seed: int) -> tuple[Session, Holder]:
    session = Session(RecordingTerminal())
    holder = Holder(session)
    for number, line in enumerate(["DISABLE INTERACTIVE", *lines]):
        told(session, holder.ask(f"{line} ;{seed + number}"))
    return session, holder


def told(session: Session, ticket: Ticket[None]) -> None:
    while not ticket.done():
        session.actor.step()


def state(session: Session, holder: Holder) -> tuple[Any, ...]:
    """All that lines can change, as a holder has it, and the files."""
    session.branches.serve(holder.user_state)
    books = [session.branches.book("main"), session.engine.book]
    return (
        session.environment.values(),
        dict(session.environment.spelling),
        {key: one.lines for key, one in session.programs.items()},
        [(list(map(repr, book.timeline)), list(map(repr, book.deltas)), book.number) for book in books],
        [[step.delta.motion.text for step in book.history.done] for book in books],
        [[one.step.delta.motion.text for one in book.history.undone] for book in books],
        session.engine.now,
        {path.name: path.read_text() for path in Path().iterdir()},
    )


def asked(holder: Holder, line: str) -> Ticket[Any]:
    if line == "DEFINE":
        return holder.submit(act_on(holder._session, Define(FILE)))
    return holder.stop() if line == "STOP" else holder.ask(line)


def ended(ticket: Ticket[None]) -> tuple[str, list[str]]:
    error = ticket.error(0.0)
    assert error is None or isinstance(error, VrsError)
    return str(error), list(map(str, ticket.take_said()))


def one_after_the_other(lines: list[str], seed: int, first: str, second: str, *, swapped: bool) -> tuple[Any, Any, Any]:
    """What two lines say, of two holders, and the state after them, when one comes after the other."""
    session, holder = begun(lines, seed)
    other = Holder(session)
    asks = [(holder, first), (other, second)]
    tickets = []
    for who, line in reversed(asks) if swapped else asks:
        tickets.append(asked(who, line))
        told(session, tickets[-1])
    said = list(map(ended, tickets))
    return (*(said[::-1] if swapped else said), state(session, holder))


@given(
    st.lists(st.sampled_from(BEFORE), max_size=12),
    st.sampled_from(LONG),
    st.integers(1, 6),
    st.sampled_from(MEANWHILE),
    st.integers(0, 8),
    st.integers(1, 3),
)
def test_what_comes_meanwhile_comes_before_or_after(
    tmp_path_factory: pytest.TempPathFactory,
    lines: list[str],
    long: str,
    count: int,
    meanwhile: str,
    steps: int,
    at_once: int,
) -> None:
    line, found = long.format(count), []
    for swapped in (False, True):
        with pytest.MonkeyPatch.context() as patch:
            patch.chdir(tmp_path_factory.mktemp("one_by_one"))
            Path("brought.v2").write_text(FILE)
            found.append(one_after_the_other(lines, count, line, meanwhile, swapped=swapped))
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path_factory.mktemp("at_the_same_time"))
        Path("brought.v2").write_text(FILE)
        session, holder = begun(lines, count)
        other = Holder(session)
        with served(session, at_once) as beside:
            work = asked(holder, line)
            for _ in range(steps):
                if session.actor.peek() < inf:
                    session.actor.step()
            between = asked(other, meanwhile)
            while not (work.done() and between.done()):
                if session.actor.peek() < inf:
                    session.actor.step()
                else:
                    beside.do()
        stopped = isinstance(work.error(0.0), RequestRefused)
        here = ended(work), ended(between), state(session, holder)
    if stopped and meanwhile in ("ABORT", "STOP"):  # nothing of it is done
        assert here[2] == alone(tmp_path_factory, lines, count, meanwhile)
    else:
        assert any(here == one for one in found)


def alone(tmp_path_factory: pytest.TempPathFactory, lines: list[str], seed: int, line: str) -> tuple[Any, ...]:
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path_factory.mktemp("alone"))
        Path("brought.v2").write_text(FILE)
        session, holder = begun(lines, seed)
        told(session, asked(Holder(session), line))
        return state(session, holder)


def test_what_a_holder_asks_for_waits_for_the_work_beside_before_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("brought.v2").write_text(FILE)
    session = Session(RecordingTerminal())
    one, other = Holder(session), Holder(session)
    with served(session, 1) as beside:
        load, run, his = one.ask("LOAD brought"), one.ask("CALL brought"), other.ask("DRIVE 2, 5")
        while not his.done():
            session.actor.step()
        assert (load.done(), run.done()) == (False, False)
        while not run.done():
            if beside.due:
                beside.do()
            session.actor.step()
    assert (load.error(0.0), run.error(0.0)) == (None, None)
    assert [record.text for record in session.engine.book.records()] == ["DRIVE 2, 5", "DRIVE 1, 5"]


STEPS = 60  # of a program that counts as long here
TEXT = ".PROGRAM long\n" + "x = x+1\n" * STEPS + "CALL other\n.END\n.PROGRAM other\nFOR i = 1 TO 3\ny = i\nEND\n.END\n"


@pytest.mark.parametrize(
    "lines",
    [
        ("LOAD long",),
        ("DEFINE",),
        ("LOAD long", "LISTP long"),
        ("LOAD long", "EXECUTE long"),
        ("LOAD long", "EXECUTE 3 long", "EXECUTE long, 1, 5"),
        ("LOAD long", "PRIME long", "SSTEP long", "BPT long, 3"),
        ("LOAD long", "EDIT long", "P 5", "I", "x = 2", "", "E"),
        ("FLIST long.v2",),
        ("LOAD long", "DELETE long"),
        ("LOAD long", "LOAD by_text", "EXECUTE by_text"),
        ("LOAD waits", "EXECUTE 3 waits", "LOAD long", "SIGNAL 1", "CALL other"),
    ],
)
def test_no_step_of_a_robot_works_on_a_whole_long_program(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, lines: tuple[str, ...]
) -> None:
    """Reading, analysing, compiling, printing and listing of it happen beside the robot alone."""
    monkeypatch.chdir(tmp_path)
    Path("long.v2").write_text(TEXT)
    Path("by_text.v2").write_text('.PROGRAM by_text()\n$name = "long"\nCALLS $name\n.END\n')
    Path("waits.v2").write_text(".PROGRAM waits()\nWAIT SIG(1)\nCALL long\n.END\n")
    where, beside_now = list[str](), False

    def watched(owner: Any, name: str) -> None:
        work = getattr(owner, name)

        def noted(*given: Any, **named: Any) -> Any:
            short = name == "compile_program" and len(given[1].program.steps) <= 10  # a line of the prompt
            if not beside_now and not short:
                where.append(name)
            return work(*given, **named)

        monkeypatch.setattr(owner, name, noted)

    for owner, name in WORK:
        watched(owner, name)
    for constant in ("LONG_TEXT", "LONG_PROGRAM"):
        monkeypatch.setattr(loaded_file, constant, 10)
    for user in (buffer, editors):
        monkeypatch.setattr(user, "LONG_PROGRAM", 10)
    session = Session(RecordingTerminal())
    holder = Holder(session)
    with served(session, 1) as beside:
        for line in ("DISABLE INTERACTIVE", *lines):
            ticket = holder.submit(act_on(session, Define(TEXT))) if line == "DEFINE" else holder.ask(line)
            while not ticket.done():
                if session.actor.peek() < inf:
                    session.actor.step()
                else:
                    beside_now = True
                    beside.do()
                    beside_now = False
            assert ticket.error(0.0) is None, line
    assert not where


WORK = (
    (parser, "parse_file"),
    (LoadedFile, "of"),
    (environment, "compile_program"),
    (buffer, "list_steps"),
    (buffer, "rebuild"),
    (buffer.ProgramBuffer, "read"),
    (buffer.ProgramBuffer, "of_program"),
    (editors, "edit_line"),
    (programs, "with_called"),
    (programs, "variables_used"),
    (program_file, "read_program_file"),
)


RELEASED_AFTER = 20.0  # [s] in which threads let go of what they worked on


@pytest.mark.parametrize("steps", [3, 700])  # 700 are compiled to two functions
@pytest.mark.parametrize(
    "lines",
    [
        ("LOAD brought", "ZERO"),
        ("LOAD brought", "LISTP brought", "DELETEP brought"),
        ("LOAD brought", "EXECUTE brought", "ZERO"),
        ("LOAD brought", "EXECUTE brought", "DELETE brought"),
        ("LOAD brought", "EXECUTE brought", "LOAD brought", "EXECUTE brought", "ZERO"),
        ("LOAD brought", "EXECUTE 3 brought", "PRIME brought", "SSTEP", "KILL", "KILL 3", "DELETEP brought"),
        ("LOAD brought", "COPY other = brought", "RENAME third = brought", "CALL other", "ZERO"),
        ("DEFINE", "EXECUTE brought", "DEFINE", "EXECUTE brought", "ZERO"),
    ],
)
def test_nothing_keeps_a_program_that_is_deleted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, lines: tuple[str, ...], steps: int
) -> None:
    """Without the collector of cycles, which in a server leaves alone what is old."""
    monkeypatch.chdir(tmp_path)
    text = ".PROGRAM brought\n" + "x = 1\n" * steps + ".END\n"
    Path("brought.v2").write_text(text)
    session = Session(RecordingTerminal())
    holder, gone = Holder(session), dict[str, Event]()

    def watch() -> None:
        for stored in session.programs.values():
            program = session.environment.executable(stored)
            pieces = [stored, program.program, program]
            if "compilation" in vars(program):
                pieces.append(program.compilation.ordinary.function)
            for piece in pieces:
                finalize(piece, gone.setdefault(f"{type(piece).__name__} {id(piece)}", Event()).set)

    gc.disable()
    try:
        session.actor.serve()
        for line in ("DISABLE INTERACTIVE", *lines):
            asks = holder.submit(act_on(session, Define(text))) if line == "DEFINE" else holder.ask(line)
            assert asks.error(RELEASED_AFTER) is None, line
            holder.submit(quietly(watch)).result(RELEASED_AFTER)
        assert not session.programs
        assert len(gone) >= 3
        assert [name for name, event in gone.items() if not event.wait(RELEASED_AFTER)] == []
    finally:
        gc.enable()
        session.actor.close()
