"""The shell on a terminal: keys in, what the session has become out."""

from __future__ import annotations

import asyncio
import os
import signal
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import pytest
from prompt_toolkit.application import create_app_session
from prompt_toolkit.buffer import Buffer
from prompt_toolkit.completion import CompleteEvent
from prompt_toolkit.document import Document
from prompt_toolkit.formatted_text import fragment_list_to_text
from prompt_toolkit.input import PipeInput, create_pipe_input
from prompt_toolkit.output import DummyOutput

from tests.engine.wall import ManualWall
from tests.repl.afar import session_of
from vrs_cli.engine.clock import RobotClock
from vrs_cli.interfaces.dialogue import Dialogue
from vrs_cli.interfaces.session.session import Session
from vrs_cli.language.words.values import Kind
from vrs_cli.render import colours
from vrs_cli.render.colours import Ink, ink_style
from vrs_cli.repl import interactive
from vrs_cli.repl.config import state_folder
from vrs_cli.repl.front_end import FrontEnd
from vrs_cli.repl.interactive import Shell, ValCompleter
from vrs_cli.repl.interrupt import stoppable
from vrs_cli.repl.prompt import FromHistory, ValLexer
from vrs_cli.repl.shell import Local
from vrs_cli.trajectory.timeline import TimelineDelta
from vrs_cli.values.results import Message

ENTER, CTRL_C, CTRL_D, TAB, UP, LEFT = "\r", "\x03", "\x04", "\t", "\x1b[A", "\x1b[D"
CTRL_U, CTRL_X, CTRL_Y = "\x15", "\x18", "\x19"
PASTE = ("\x1b[200~", "\x1b[201~")


@pytest.fixture(autouse=True)
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@contextmanager
def keyboard() -> Iterator[PipeInput]:
    with create_pipe_input() as keys, create_app_session(input=keys, output=DummyOutput()):
        yield keys


def run(*keys: str, file: str | None = None, clock: RobotClock | None = None) -> Shell:
    """A whole session of the shell; it must end by itself at the last key."""
    with keyboard() as pipe:
        pipe.send_text("".join(keys) + CTRL_D)  # the answer where EXIT asks about what is not stored
        shell = Shell(Local(file=file, clock=clock, recovery=state_folder(os.environ) / "recovery"))
        assert shell.run() == 0
    return shell


def front_end(shell: Shell) -> FrontEnd:
    return shell.terminal_maker.wait().screens


def session(shell: Shell) -> Session:
    return session_of(front_end(shell))


def lines(*texts: str) -> str:
    return "".join(text + ENTER for text in texts)


def shown_below(shell: Shell) -> str:
    """The toolbar."""
    return fragment_list_to_text(shell._toolbar())


def real(shell: Shell, name: str) -> object:
    return dict(session(shell).environment.variables(Kind.REAL)).get(name)


# --- leaving -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("last", [lines("EXIT"), lines("quit"), CTRL_D])
def test_ways_to_leave(last: str) -> None:
    assert real(run(lines("a = 1"), last), "a") == 1.0


TYPED = lines(".PROGRAM p", ".END")


@pytest.mark.parametrize("asked", [lines("EXIT"), CTRL_D])
@pytest.mark.parametrize("answer", [lines("Y"), lines("EXIT"), CTRL_D])
def test_leaving_asks_about_what_is_not_stored(asked: str, answer: str, capsys: pytest.CaptureFixture[str]) -> None:
    shell = run(TYPED, asked, answer, lines("a = 1"))
    assert real(shell, "a") is None
    assert "Not stored: program p. STORE file stores all" in capsys.readouterr().out


@pytest.mark.parametrize("asked", [lines("EXIT"), CTRL_D])
@pytest.mark.parametrize("answer", [lines("N"), lines(""), lines("what", "no"), CTRL_C])
def test_who_does_not_leave_can_store(asked: str, answer: str, state: Path) -> None:
    shell = run(TYPED, asked, answer, lines("a = 1", "STORE all", "EXIT", "a = 2"))
    assert real(shell, "a") == 1.0
    assert ".PROGRAM p" in (state / "all.v2").read_text()


def test_who_has_disabled_questions_leaves_at_once() -> None:
    assert real(run(TYPED, lines("DISABLE INTERACTIVE", "EXIT", "a = 1")), "a") is None


def test_who_leaves_leaves_nothing_behind(state: Path) -> None:
    run(TYPED, lines("EXIT", "Y"))
    assert list((state / "vrs" / "recovery").iterdir()) == []


def test_it_says_what_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    run(CTRL_D)
    assert capsys.readouterr().out.startswith("vrs ")


# --- wrong lines ---------------------------------------------------------------------------------------------------


def test_ctrl_c_drops_the_line_says_so_and_never_leaves(capsys: pytest.CaptureFixture[str]) -> None:
    shell = run("a = 1", CTRL_C, CTRL_C, lines("b = 2", "EXIT"))
    assert (real(shell, "a"), real(shell, "b")) == (None, 2.0)
    out = capsys.readouterr().out
    assert out.index("The line is dropped") < out.index("Nothing to stop: EXIT leaves")


def test_a_wrong_line_is_told_with_its_place_and_kept_in_the_history(capsys: pytest.CaptureFixture[str]) -> None:
    shell = run(lines("a = 3 +", "b = 2", "EXIT"))
    assert real(shell, "b") == 2.0
    assert shell.prompts.history.get_strings() == ["a = 3 +", "b = 2", "EXIT"]
    out = capsys.readouterr().out
    assert "*Illegal expression syntax* a value is missing after +\na = 3 +\n       ^\n" in out


def test_lines_pasted_without_brackets_are_taken_one_by_one() -> None:
    shell = run("MOVF a\rb = 2\rc = (3\rd = 4\r", lines("EXIT"))
    assert (real(shell, "b"), real(shell, "d")) == (2.0, 4.0)


def test_ctrl_u_clears_all_of_the_line_and_ctrl_y_brings_it_back() -> None:
    shell = run("a = 1", LEFT * 3, CTRL_U, lines("b = 2"), CTRL_Y, ENTER, lines("EXIT"))
    assert (real(shell, "a"), real(shell, "b")) == (1.0, 2.0)


def test_a_line_that_cannot_be_done_does_not_end_the_shell(capsys: pytest.CaptureFixture[str]) -> None:
    shell = run(lines("MOVE nowhere", "a = 1", "EXIT"))
    assert "*Undefined value* nowhere" in capsys.readouterr().out
    assert real(shell, "a") == 1.0


def test_an_error_of_the_shell_itself_is_one_line(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_arguments: object) -> None:
        raise ZeroDivisionError("surprise")

    monkeypatch.setattr(Session, "answers", broken)
    run(lines("WHERE"), CTRL_D)
    out = capsys.readouterr().out
    assert "internal error: ZeroDivisionError: surprise" in out
    assert "Traceback" not in out
    report = Path("".join(out.split("please report it with")[1].split()))
    assert "Traceback" in report.read_text()
    report.unlink()


def test_a_step_with_a_mistake_is_told_at_once_and_is_no_step(capsys: pytest.CaptureFixture[str]) -> None:
    shell = run(lines(".PROGRAM p", "a = 1", "MOVF a", "WHERE", "b = 2", ".END", "EXECUTE p", "EXIT"))
    assert (real(shell, "a"), real(shell, "b")) == (1.0, 2.0)
    out = capsys.readouterr().out
    assert out.count("*Unknown instruction* MOVF") == 1
    assert out.index("MOVF") < out.index("Not in it, for their mistakes: 2 lines") < out.index("Program p: 2 steps")


def test_steps_that_are_pasted_together_are_all_in_the_program(capsys: pytest.CaptureFixture[str]) -> None:
    run(PASTE[0], ".PROGRAM p\na = 1\nMOVF a\n.END", PASTE[1], ENTER, lines("EXIT"))
    assert "Program p: 2 steps; it cannot be executed yet" in capsys.readouterr().out


def test_a_dumb_terminal_is_told_by_the_answer(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("TERM", "dumb")
    assert real(run(lines("MOVF part", "a = 1", "EXIT")), "a") == 1.0
    assert "MOVF (did you mean MOVE?)" in capsys.readouterr().out


@pytest.fixture
def shell() -> Iterator[Shell]:
    with keyboard():
        yield Shell(Local())


# --- real time -----------------------------------------------------------------------------------------------------


def test_in_real_time_the_arm_moves_while_lines_are_typed(capsys: pytest.CaptureFixture[str]) -> None:
    wall = ManualWall(each_look=lambda: 0.001)
    shell = run(lines("DRIVE 1, 90, 20", "WHERE", "a = 1", "EXIT"), clock=wall.clock())
    engine = session(shell).engine
    assert 0.0 < engine.now < engine.end
    assert wall.slept == []
    assert "Hand" in capsys.readouterr().out


def test_in_real_time_tasks_go_on_at_the_prompt() -> None:
    wall = ManualWall()
    shell = run(lines(".PROGRAM tick", "WAIT.EVENT , 2", "x = 5", ".END", "PCEXECUTE tick", "EXIT"), clock=wall.clock())
    assert real(shell, "x") is None
    wall.seconds += 3.0
    front_end(shell).keep_up()
    assert real(shell, "x") == 5.0


LOOP = lines(".PROGRAM loop", "DO", "DRIVE 1, 10", "DRIVE 1, -10", "UNTIL FALSE", ".END")


def test_execute_gives_a_living_prompt_back_and_ctrl_c_on_an_empty_line_stops_the_program(
    capsys: pytest.CaptureFixture[str],
) -> None:
    wall = ManualWall(each_look=lambda: 0.01)
    shell = run(
        LOOP,
        lines("EXECUTE loop", "a = 1"),
        "b = 1",
        CTRL_C,
        lines("a = a+1"),
        CTRL_C,
        lines("EXIT"),
        clock=wall.clock(),
    )
    assert (real(shell, "a"), real(shell, "b")) == (2.0, None)
    wall.seconds += 3.0
    front_end(shell).keep_up()
    assert not session(shell).running
    assert "(ABORTED)\nProgram stopped at loop, step" in capsys.readouterr().out


@pytest.mark.parametrize("typed", ["", "b = ", "DRIVE 1,"])
def test_ctrl_x_aborts_beside_the_line_that_is_edited(typed: str, capsys: pytest.CaptureFixture[str]) -> None:
    wall = ManualWall(each_look=lambda: 0.01)
    shell = run(LOOP, lines("EXECUTE loop"), typed, CTRL_X, "3", CTRL_U, lines("a = 4", "EXIT"), clock=wall.clock())
    assert (real(shell, "a"), real(shell, "b"), session(shell).running) == (4.0, None, False)
    assert "(ABORTED)\nProgram stopped at loop, step" in capsys.readouterr().out


def test_ctrl_x_keeps_the_line_that_is_edited() -> None:
    assert real(run("b = ", CTRL_X, "3", ENTER, lines("EXIT"), clock=ManualWall().clock()), "b") == 3.0


def test_abort_beside_a_question_withdraws_it(capsys: pytest.CaptureFixture[str]) -> None:
    asks = lines(".PROGRAM ask", 'PROMPT "How many? ", n', ".END")
    shell = run(asks, lines("EXIT"), clock=ManualWall().clock())
    front_end(shell).take("EXECUTE ask")
    assert front_end(shell).status().asked
    front_end(shell).abort()
    front_end(shell).keep_up()
    assert (front_end(shell).status().asked, session(shell).running) == ("", False)
    assert "(ABORTED)\nProgram stopped at ask, step 1" in capsys.readouterr().out


def test_a_line_with_text_is_cleared_and_the_program_runs_on() -> None:
    wall = ManualWall(each_look=lambda: 0.01)
    shell = run(LOOP, lines("EXECUTE loop"), "b = 1", CTRL_C, lines("EXIT"), clock=wall.clock())
    wall.seconds += 3.0
    front_end(shell).keep_up()
    assert session(shell).running


def test_a_question_of_a_program_comes_in_the_place_of_an_empty_line(capsys: pytest.CaptureFixture[str]) -> None:
    asks = lines(".PROGRAM ask", 'PROMPT "How many? ", n', 'TYPE "got", n', ".END")
    shell = run(asks, lines("EXECUTE ask", "five", "5", "a = n", "EXIT"), clock=ManualWall().clock())
    assert real(shell, "a") == 5.0
    out = capsys.readouterr().out
    assert out.index("*Invalid number format* five") < out.index("got 5") < out.index("Program completed")


def test_ctrl_c_at_a_question_stops_the_program_that_asks(capsys: pytest.CaptureFixture[str]) -> None:
    asks = lines(".PROGRAM ask", 'PROMPT "How many? ", n', ".END")
    shell = run(asks, lines("EXECUTE ask"), CTRL_C, lines("a = 1", "EXIT"), clock=ManualWall().clock())
    assert (real(shell, "n"), real(shell, "a"), session(shell).running) == (None, 1.0, False)
    assert "(ABORTED)\nProgram stopped at ask, step 1" in capsys.readouterr().out


def test_what_goes_wrong_behind_the_prompt_is_noted() -> None:
    shell = run(lines("a = 1", "EXIT"), clock=ManualWall().clock())

    def broken() -> None:
        raise ZeroDivisionError("surprise")

    session(shell).settle = broken  # type: ignore[method-assign]
    front_end(shell).keep_up()
    assert "ZeroDivisionError: surprise" in front_end(shell).noted


# --- completion and colours ----------------------------------------------------------------------------------------


def test_completion_knows_what_is_defined(shell: Shell) -> None:
    terminal = shell.terminal_maker.wait()
    terminal.screens.take("SET pallet = TRANS(500,150,-100,90,90,0)")
    found = ValCompleter(lambda: terminal).get_completions(Document("MOVE pa"), CompleteEvent(text_inserted=True))
    (completion,) = found
    assert (completion.text, completion.start_position) == ("pallet", -2)
    assert completion.display_meta_text == "500.0 150.0 -100.0 90.0 90.0 0.0"


def test_nothing_pops_up_on_an_empty_line(shell: Shell) -> None:
    completer = ValCompleter(shell.terminal_maker.wait)
    assert list(completer.get_completions(Document(""), CompleteEvent(text_inserted=True))) == []
    assert list(completer.get_completions(Document(""), CompleteEvent(completion_requested=True)))


def test_before_the_tables_are_there_nothing_is_suggested_or_coloured() -> None:
    assert list(ValCompleter(lambda: None).get_completions(Document("MO"), CompleteEvent(text_inserted=True))) == []
    assert ValLexer(lambda: False).lex_document(Document("MOVE a"))(0) == [("", "MOVE a")]
    coloured = ValLexer(lambda: True).lex_document(Document("MOVE a"))(0)
    assert [fragment[1] for fragment in coloured] == ["MOVE", " ", "a"]
    assert coloured[0][0] == ink_style(Ink.INSTRUCTION)


def test_a_line_is_coloured_once_for_each_text(monkeypatch: pytest.MonkeyPatch) -> None:
    scanned: list[str] = []

    def scan(line: str, _variables: object) -> list[tuple[str, Ink]]:
        scanned.append(line)
        return [(line, Ink.TEXT)]

    monkeypatch.setattr(colours, "scan", scan)
    lexer = ValLexer(lambda: True)
    for text in ("MOVE a", "MOVE ab"):
        coloured = lexer.lex_document(Document(text))
        assert coloured(0) == coloured(0)
    assert scanned == ["MOVE a", "MOVE ab"]


def test_a_failing_completion_is_told_in_the_toolbar(shell: Shell, monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = shell.terminal_maker.wait()

    def broken(*_arguments: object, **_options: object) -> object:
        raise RuntimeError("no names")

    monkeypatch.setattr("vrs_cli.interfaces.conversation.conversation.names_of", broken)
    assert list(ValCompleter(lambda: terminal).get_completions(Document("MO"), CompleteEvent(text_inserted=True))) == []
    assert terminal.screens.noted.startswith("internal error: RuntimeError: no names")
    shell._look()
    assert terminal.screens.noted in " ".join(shown_below(shell).split())  # all of it, with the name of the report
    Path(terminal.screens.noted.rsplit(" ", 1)[1]).unlink()


# --- programs ------------------------------------------------------------------------------------------------------


def test_a_program_typed_line_by_line() -> None:
    shell = run(
        lines(".PROGRAM count", "FOR i = 1 TO 3", "total = total+i", "END", ".END", "total = 0", "EX count", "EXIT")
    )
    assert real(shell, "total") == 6.0
    (stored,) = session(shell).environment.programs.values()
    assert [step.statement is not None for step in stored.program.steps] == [True, True, True]


def test_a_wrong_step_is_not_taken() -> None:
    shell = run(lines(".PROGRAM p"), "MOVX", ENTER, "\x15\x0b", lines("a = 1", ".END", "EXIT"))  # Ctrl-U, Ctrl-K
    (stored,) = session(shell).environment.programs.values()
    assert (len(stored.program.steps), stored.analysis.executable) == (1, True)


@pytest.mark.parametrize("key", [CTRL_C, CTRL_D])
def test_leaving_a_program_asks_stores_nothing_and_says_so(key: str, capsys: pytest.CaptureFixture[str]) -> None:
    shell = run(lines(".PROGRAM p", "a = 1"), key, lines("Y", "b = 2", "EXIT"))
    assert session(shell).environment.programs == {}
    assert real(shell, "b") == 2.0
    assert "p is not stored (.END would have ended it)" in capsys.readouterr().out


@pytest.mark.parametrize("keys", [CTRL_C + lines("N"), CTRL_D + lines("N"), "b = 3" + CTRL_C])
def test_who_does_not_leave_a_program_goes_on_with_it(keys: str) -> None:
    shell = run(lines(".PROGRAM p", "a = 1"), keys, lines("a = 2", ".END", "EXIT"))
    (stored,) = session(shell).environment.programs.values()
    assert len(stored.program.steps) == 2


@pytest.mark.parametrize("key", [CTRL_C, CTRL_D])
def test_a_program_without_a_line_is_left_at_once(key: str) -> None:
    shell = run(lines(".PROGRAM p"), key, lines("b = 2", "EXIT"))
    assert (session(shell).environment.programs, real(shell, "b")) == ({}, 2.0)


def test_a_structure_error_is_told_at_the_end(capsys: pytest.CaptureFixture[str]) -> None:
    shell = run(lines(".PROGRAM p", "FOR i = 1 TO 3", ".END", "EXIT"))
    assert "*Control structure error*" in capsys.readouterr().out
    assert not session(shell).environment.programs["p"].analysis.executable


def test_a_file_pasted_as_a_whole() -> None:
    text = ".PROGRAM p\nFOR i = 1 TO 2\n  n = n+i\nEND\n.END\n.REALS\nn 10\n.END\nEXECUTE p\n"
    shell = run(PASTE[0], text, PASTE[1], ENTER, lines("EXIT"))
    assert real(shell, "n") == 13.0


@pytest.mark.parametrize(("answer", "value"), [("N", 1.0), ("Y", 2.0)])
def test_a_program_that_is_there_is_replaced_when_agreed(answer: str, value: float) -> None:
    first = lines(".PROGRAM p", "a = 1", ".END")
    again = lines(".PROGRAM p", answer) + (lines("a = 2", ".END") if answer == "Y" else "")
    assert real(run(first, again, lines("EXECUTE p", "EXIT")), "a") == value


def test_prompt_and_change_are_answered() -> None:
    shell = run(
        lines(".PROGRAM p", 'PROMPT "How many? ", n', ".END", "EXECUTE p", "5", "POINT a = NULL", "1,2,3", "", "EXIT")
    )
    assert real(shell, "n") == 5.0
    (location,) = session(shell).environment.variables(Kind.LOCATION)
    assert location.value[3::4] == pytest.approx((0.001, 0.002, 0.003))  # type: ignore[index]


def test_a_file_named_on_the_command_line_is_loaded(state: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (state / "my cell.v2").write_text(".PROGRAM p\na = 4\n.END\n")
    assert real(run(lines("EXECUTE p", "EXIT"), file="my cell.v2"), "a") == 4.0
    run(CTRL_D, file="nowhere.v2")
    assert "*Nonexistent file* nowhere.v2" in capsys.readouterr().out


# --- history -------------------------------------------------------------------------------------------------------


def test_lines_come_back_in_the_next_session() -> None:
    run(lines("a = 1", "EXIT"))
    assert real(run(UP, UP, ENTER, lines("EXIT")), "a") == 1.0


def test_without_a_place_for_the_history_there_is_one_note(
    state: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (state / "file").touch()
    monkeypatch.setenv("XDG_STATE_HOME", str(state / "file"))
    assert real(run(lines("a = 1", "EXIT")), "a") == 1.0
    assert capsys.readouterr().out.count("the history cannot be kept") == 1


# --- Ctrl-C while a program runs -----------------------------------------------------------------------------------


def interrupting(when: Callable[[Session], bool], number: int) -> Callable[..., Dialogue[None]]:
    """Session.answers, with a signal as soon as the clock tells so."""
    answers = Session.answers

    def pressed(session: Session, line: str) -> Dialogue[None]:
        notify = session.engine.book.notify

        def press(deltas: Sequence[TimelineDelta]) -> None:
            notify(deltas)
            if when(session):
                signal.raise_signal(number)

        session.engine.book.notify = press
        return answers(session, line)

    return pressed


@pytest.mark.parametrize("key", ["SIGINT", "SIGQUIT"])  # of Ctrl-C and Ctrl-X, while a line is carried out
def test_ctrl_c_and_ctrl_x_stop_the_program_and_not_the_shell(
    key: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    number = getattr(signal, key, None)
    if number is None:
        pytest.skip(f"there is no {key}")
    pressed: list[float] = []

    def once(session: Session) -> bool:
        late = session.engine.now > 5.0 and not pressed
        if late:
            pressed.append(session.engine.now)
        return late

    monkeypatch.setattr(Session, "answers", interrupting(once, number))
    typed = lines(".PROGRAM loop", "DO", "DRIVE 1, 10", "DRIVE 1, -10", "UNTIL FALSE", ".END")
    shell = run(typed, lines("EXECUTE loop", "a = 1", "EXIT"))
    out = capsys.readouterr().out
    assert "(ABORTED)\nProgram stopped at loop, step" in out
    assert real(shell, "a") == 1.0
    assert 5.0 < session(shell).engine.now < 10.0


class Over(Exception):
    """Enough of a loop without end."""


def looks_and_pictures(seconds: float, monkeypatch: pytest.MonkeyPatch, *typed: str) -> tuple[int, int]:
    """How often the prompt looks at the clock, and is drawn again, while nobody types."""
    wall, drawn, looks = ManualWall(), [], []
    shell = run(lines(*typed, "EXIT"), clock=wall.clock())
    ends = wall.seconds + seconds

    async def wait_or_wake(_woken: object, seconds: float) -> None:
        wall.seconds += seconds
        looks.append(wall.seconds)
        if wall.seconds > ends:
            raise Over

    monkeypatch.setattr(interactive, "wait_or_wake", wait_or_wake)
    monkeypatch.setattr(interactive, "monotonic", lambda: wall.seconds)
    monkeypatch.setattr(shell, "_redraw", lambda: drawn.append(wall.seconds))
    with pytest.raises(Over):
        asyncio.run(shell._keep_up(shell.prompts))
    return len(looks), len(drawn)


def test_a_cancelled_wait_ends_even_if_it_is_woken_at_the_same_time() -> None:
    """The prompt waits for the end of what it has cancelled."""

    async def cancelled_as_it_wakes() -> bool:
        woken = asyncio.Event()
        resting = asyncio.create_task(interactive.wait_or_wake(woken, 60.0))
        await asyncio.sleep(0)
        woken.set()
        resting.cancel()
        await asyncio.wait([resting])
        return resting.cancelled()

    assert asyncio.run(cancelled_as_it_wakes())


def test_at_rest_the_prompt_is_drawn_once_a_second(monkeypatch: pytest.MonkeyPatch) -> None:
    looks, pictures = looks_and_pictures(60.0, monkeypatch)
    assert 55 <= pictures <= looks <= 65


def test_while_the_arm_moves_it_is_drawn_as_it_changes(monkeypatch: pytest.MonkeyPatch) -> None:
    _, pictures = looks_and_pictures(3.0, monkeypatch, "DRIVE 1, 90, 10")
    assert 25 <= pictures <= 32


def test_ctrl_c_beside_a_program_ends_what_is_done(shell: Shell) -> None:
    terminal = shell.terminal_maker.wait()
    with pytest.raises(KeyboardInterrupt), stoppable(terminal.interrupt):
        signal.raise_signal(signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_the_toolbar_shows_the_clock_and_the_last_message(shell: Shell) -> None:
    terminal = shell.terminal_maker.wait()
    terminal.screens.take("DRIVE 1, 60")
    terminal.show(Message("all is well"))
    shell._look()
    text = shown_below(shell)
    assert "t 1.03 s" in text
    assert "X -139.3" in text


# --- keys ----------------------------------------------------------------------------------------------------------

F1 = "\x1bOP"


def test_the_rest_of_a_line_is_suggested_from_the_history() -> None:
    buffer = Buffer()
    for line in ("count = 40+2", "count = 0", "MOVE part"):
        buffer.history.append_string(line)
    suggested = FromHistory().get_suggestion(buffer, Document("count = 4"))
    assert suggested is not None
    assert suggested.text == "0+2"
    for text in ("", "  ", "MOVE part", "nothing"):
        assert FromHistory().get_suggestion(buffer, Document(text)) is None


@pytest.mark.parametrize("keys", [f"APPRO part, {F1}", lines("appro?"), lines("? APPRO")])
def test_help_on_a_word(keys: str, capsys: pytest.CaptureFixture[str]) -> None:
    run(keys, CTRL_C, lines("EXIT"))
    assert "Motion to a distance [mm] in front of a location" in capsys.readouterr().out


def test_a_question_in_a_program_is_no_step(capsys: pytest.CaptureFixture[str]) -> None:
    shell = run(lines(".PROGRAM p", "MOVES?", "READY", ".END", "EXIT", "Y"))
    assert "Straight-line motion to a location." in capsys.readouterr().out
    assert len(session(shell).programs["p"].program.steps) == 1


def test_the_form_of_the_word_stands_above_the_state() -> None:
    with keyboard():
        shell = Shell(Local())
        shell.terminal_maker.wait()
        shell._look()
        shell.prompts.default_buffer.text = "DRIVE 1, "
        shell.prompts.default_buffer.cursor_position = 9
        form, state = shown_below(shell).split("\n")
    assert form.startswith(" DRIVE joint, change[, speed] [AT t | IN dt] | ")
    assert state.startswith(" t 0.00 s")
