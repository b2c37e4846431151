"""The shell at a robot afar shows what it shows at one that is here."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator, Sequence
from io import StringIO
from math import inf
from pathlib import Path

import pytest
from msgspec import structs
from prompt_toolkit.application import create_app_session
from prompt_toolkit.input import create_pipe_input
from prompt_toolkit.output import DummyOutput

from tests.engine.wall import ManualWall
from tests.interfaces.terminals import RecordingTerminal
from tests.repl.afar import Line
from vrs_cli.errors import RequestRefused
from vrs_cli.interfaces.conversation.conversation import Conversation
from vrs_cli.interfaces.port.port import Outlet
from vrs_cli.interfaces.session.session import Session
from vrs_cli.kinematics.model_data import to_dict
from vrs_cli.net import messages
from vrs_cli.repl.connection import WORDS, Remote
from vrs_cli.repl.front_end import FrontEnd, Place
from vrs_cli.repl.interactive import Shell
from vrs_cli.repl.loop import PlainTerminal
from vrs_cli.repl.piped import KEEPING_UP, RESTING
from vrs_cli.repl.shell import Local, on_pipe
from vrs_cli.trajectory.timeline import TimelineDelta
from vrs_cli.values.questions import Answer, Question
from vrs_cli.values.results import Message
from vrs_cli.wire.messages import Refusal

ENTER, CTRL_C, CTRL_D, TAB, SAVE, QUIT, UP = "\r", "\x03", "\x04", "\t", "\x13", "\x11", "\x1b[A"


@pytest.fixture(autouse=True)
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.setattr("vrs_cli.repl.terminal.PROGRESS_DELAY_S", inf)  # a slow computer shows progress, here and there
    monkeypatch.chdir(tmp_path)
    return iter(())


class Soon(Remote):
    """A line on which every answer comes at once: keys that are typed ahead come to the same in every run."""

    remote = False


def afar(line: Line, told: Callable[[str], None] = lambda _text: None) -> Remote:
    return Soon(line, told)


def lines(*texts: str) -> str:
    return "".join(text + ENTER for text in texts)


def shown(place: Place, keys: str, capsys: pytest.CaptureFixture[str]) -> str:
    """All that a whole session shows; it must end by itself at the last key."""
    with create_pipe_input() as pipe, create_app_session(input=pipe, output=DummyOutput()):
        pipe.send_text(keys + CTRL_D)
        assert Shell(place).run() == 0
    return capsys.readouterr().out


PROGRAM = (".PROGRAM p", "FOR i = 1 TO 3", 'PROMPT "How many? ", n', "TYPE n", "END", ".END")
ASKED = {
    "a program that asks": lines(*PROGRAM, "EXECUTE p", "1", "five", "5", "6", "DISABLE INTERACTIVE"),
    "Ctrl-C at its question": lines(*PROGRAM, "EXECUTE p", "1") + CTRL_C + lines("LISTR n", "DISABLE INTERACTIVE"),
    "changes of a location": lines("POINT a", "1,2,3,4,5,6", ",,9", "", "LISTL", "DISABLE INTERACTIVE"),
    "Ctrl-C at Change?": lines("POINT a", "1,2,3,4,5,6") + CTRL_C + lines("LISTL", "DISABLE INTERACTIVE"),
    "yes or no": lines("a = 1", "ZERO", "what", "N", "LISTR", "ZERO", "Y", "LISTR"),
    "a mistake": lines("MOVF a", "a = (3") + "b" + CTRL_C + CTRL_C + lines("a = 1", "LISTR", "DISABLE INTERACTIVE"),
    "completion": lines("pallet = 3") + "LISTR pal" + TAB + ENTER + lines("DISABLE INTERACTIVE"),
    "the line editor": lines(*PROGRAM, "EDIT p", "T", "D 2", "x = 1", "E", "LISTP p", "DISABLE INTERACTIVE"),
    "Ctrl-C in the editor": lines(*PROGRAM, "EDIT p", "x = 1") + CTRL_C + lines("Y", "LISTP p", "DISABLE INTERACTIVE"),
    "SEE": lines("SEE q") + "movee a" + ENTER + "ready" + SAVE + QUIT + lines("LISTP q", "DISABLE INTERACTIVE"),
    "SEE that is left": lines("SEE q") + "ready" + QUIT + QUIT + lines("DIRECTORY", "DISABLE INTERACTIVE"),
    "JOG": lines("JOG") + UP + UP + "]" + UP + "q" + lines("WHERE", "DISABLE INTERACTIVE"),
    "REPLAY": lines("DRIVE 1, 10", "SAVE t", "REPLAY t") + " q" + lines("DISABLE INTERACTIVE"),
    "SHOW": lines("DRIVE 1, 10", "SHOW", "SHOW AT 0.2", "DISABLE INTERACTIVE"),
    "PLOT": lines("DRIVE 1, 10", "PLOT 1", "TIMELINE", "HELP MOVE", "DISABLE INTERACTIVE"),
    "files": lines("a = 1", "STORE all", "a = 2", "LOAD all", "STORE all", "N", "STORE all", "Y", "LISTR"),
    "branches": lines("BRANCH try", "DRIVE 1, 5", "COMPARE try, main", "BRANCH main", "DISABLE INTERACTIVE"),
}


@pytest.mark.parametrize("keys", ASKED.values(), ids=ASKED.keys())
def test_it_shows_the_same(
    keys: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    said = []
    for place in (Local(), afar(Line(attended=True))):
        folder = tmp_path / str(len(said))
        folder.mkdir()
        monkeypatch.chdir(folder)
        said.append(shown(place, keys, capsys))
    assert said[0] == said[1]
    assert len(said[0].splitlines()) > 1


# --- a pipe -------------------------------------------------------------------------------------------------------


def piped(line: Line, typed: list[str], told: list[str]) -> tuple[int, str]:
    sink = StringIO()
    return on_pipe(afar(line, told.append), iter(typed), sink), sink.getvalue()


def test_a_pipe_has_its_answers_and_its_status() -> None:
    told: list[str] = []
    typed = ["a = 2\n", 'PROMPT "n? ", n\n', "5\n", "LISTR a*n\n", ".PROGRAM p\n", "READY\n"]
    status, text = piped(line := Line(), typed, told)
    assert text == "n? \na*n              10\nthe input ended: p is not stored (.END would have ended it)\n"
    assert (status, told, line.closed) == (1, [], True)
    assert piped(Line(), ["a = 2\n", "EXIT\n", "wrong\n"], told) == (0, "")


def test_the_end_of_the_input_is_told_as_here() -> None:
    typed = ['PROMPT "n? ", n\n']
    sink = StringIO()
    on_pipe(Local(), iter(typed), sink)
    assert piped(Line(), typed, []) == (1, sink.getvalue())


REST = "not given, for the connection was cut meanwhile: the lines after this one"


def test_a_line_of_a_pipe_does_not_wait_for_a_connection() -> None:
    line, told = Line(), list[str]()
    line.cut = True
    typed = iter(["a = 2\n", "a = 3\n"])
    assert on_pipe(afar(line, told.append), typed, StringIO()) == 1
    assert told == [str(RequestRefused("there is no connection")), REST]
    assert list(typed) == ["a = 3\n"]


def cut_at(line: Line, wanted: str) -> str:
    """The connection is cut by that line, which never comes to the robot, and is back before its end is told: what the
    user is told of it.
    """
    begin, lost = line.begin, RequestRefused("it was not done", "give it again")

    def begin_or_cut(make: Callable[[int], messages.Request], outlet: Outlet) -> int:
        request = make(0)
        if getattr(request, "text", "") != wanted or isinstance(request, messages.Check):
            return begin(make, outlet)
        line.cuts += 1
        outlet(messages.Done(0, ok=False, refusal=Refusal.of(lost)))
        return 0

    line.begin = begin_or_cut  # type: ignore[method-assign]
    return str(lost)


def test_a_pipe_ends_where_its_connection_was_cut() -> None:
    line, told = Line(), list[str]()
    lost = cut_at(line, "a = 2")
    assert piped(line, ["a = 1\n", "a = 2\n", "a = 3\n", "LISTR a\n"], told) == (1, "")
    assert told == [lost, REST]
    assert dict(line.session.environment.values()) == {("a", None): 1.0}


def test_what_is_typed_while_the_connection_is_cut_is_told_and_dropped() -> None:
    line, told = Line(attended=True), list[str]()
    lost = cut_at(line, "a = 2")
    with create_pipe_input() as pipe, create_app_session(input=pipe, output=DummyOutput()):

        def hear(text: str) -> None:
            told.append(text)
            if text.endswith("a = 5"):
                pipe.send_text(lines("b = 1") + CTRL_D)

        shell = Shell(afar(line, hear))
        pipe.send_text(lines("a = 1", "a = 2", "a = 3", "a = 4") + "a = 5" + CTRL_D)
        shell.run()
        history = shell.prompts.history.get_strings()
    dropped = [f"not given, for the connection was cut meanwhile: a = {k}" for k in (3, 4, 5)]
    assert told[-4:] == [lost, *dropped]
    assert dict(line.session.environment.values()) == {("a", None): 1.0, ("b", None): 1.0}
    assert history == ["a = 1", "a = 2", "a = 3", "a = 4", "a = 5", "b = 1"]


def test_ctrl_c_stops_what_is_waited_for_and_the_rest_of_the_pipe() -> None:
    line, pressed = Line(), list[float]()
    notify = line.session.engine.book.notify

    def press(deltas: Sequence[TimelineDelta]) -> None:
        notify(deltas)
        if line.session.engine.now > 5.0 and not pressed:
            pressed.append(line.session.engine.now)
            signal.raise_signal(signal.SIGINT)

    line.session.engine.book.notify = press
    loop = [".PROGRAM loop\n", "DO\n", "DRIVE 1, 10\n", "DRIVE 1, -10\n", "UNTIL FALSE\n", ".END\n"]
    status, text = piped(line, [*loop, "EXECUTE loop\n", "a = 1\n"], [])
    assert "(ABORTED)\nProgram stopped at loop, step" in text
    assert (status, line.session.environment.kinds) == (1, {})


# --- while a line is typed ----------------------------------------------------------------------------------------


def test_completion_and_status_come_over_the_line() -> None:
    line = Line(attended=True)
    terminal = PlainTerminal(StringIO(), iter(()))
    terminal.attended = True
    front_end = Remote(line, lambda _text: None).front_end(terminal)
    front_end.opening()
    assert front_end.status().prompt == "."
    front_end.take("SET pallet = TRANS(500,150,-100,90,90,0)")
    (found,) = front_end.suggestions("MOVE pa", False)
    assert (found.text, found.length, found.meta) == ("pallet", 2, "500.0 150.0 -100.0 90.0 90.0 0.0")
    line.cut = True
    assert front_end.suggestions("MOVE pa", False) == []


def test_the_clock_of_the_toolbar_does_not_go_back(monkeypatch: pytest.MonkeyPatch) -> None:
    """A status that was long on its way tells an earlier time; one of a clock that stands is believed."""
    wall = ManualWall()
    monkeypatch.setattr("tests.repl.afar.time.monotonic", lambda: wall.seconds)
    line = Line(attended=True, clock=wall.clock())
    front_end, _ = attended(line, [], [])
    early = line.conversation.status()
    wall.seconds += 13.0
    front_end.take("WHERE")
    assert front_end.status().clock == pytest.approx(13.0)
    line._tell(messages.Status(early))
    front_end.keep_up()
    wall.seconds += 1.0
    assert front_end.status().clock == pytest.approx(14.0)
    front_end.take("CLOCK PAUSE")
    wall.seconds += 5.0
    assert front_end.status().clock == pytest.approx(14.0)


def test_the_status_of_a_robot_at_rest_tells_the_time_of_now() -> None:
    wall = ManualWall()
    dialogue = Conversation(Session(RecordingTerminal(), clock=wall.clock()))
    wall.seconds += 5.0
    assert dialogue.status().clock == 5.0


def test_in_real_time_a_program_runs_on_beside_the_prompt_and_asks() -> None:
    wall = ManualWall()
    line = Line(attended=True, clock=wall.clock())
    sink = StringIO()
    terminal = PlainTerminal(sink, iter(["5\n"]))
    front_end = Remote(line, lambda _text: None).front_end(terminal)
    front_end.take('.PROGRAM ask\nWAIT.EVENT , 2\nPROMPT "n? ", n\nTYPE n\n.END\nEXECUTE ask')
    assert (front_end.status().prompt, front_end.status().running, front_end.status().asked) == ("*", True, "")
    wall.seconds += 3.0
    front_end.take("TIME")
    assert front_end.status().asked == "ask asks: n? "
    front_end.answer()
    assert sink.getvalue().splitlines() == [
        "Program ask: 3 steps",
        "Robot clock 3.000 s, rate 1",
        "n? ",
        " 5",
        "Program completed",
    ]


def attended(line: Line, answers: list[str], told: list[str]) -> tuple[FrontEnd, StringIO]:
    """A seat whose user answers so."""
    sink = StringIO()
    terminal = PlainTerminal(sink, iter(answers))
    terminal.attended = True
    return Remote(line, told.append).front_end(terminal), sink


def test_who_is_alone_with_a_robot_is_not_told_how_it_is_shared() -> None:
    line, told = Line(attended=True), list[str]()
    attended(line, [], told)[0].opening()
    assert told == [WORDS]
    line.one_user = True
    attended(line, [], told)[0].opening()
    assert told == [WORDS]


def test_a_long_paste_goes_in_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vrs_cli.repl.loop.MAX_CHARS", 20)
    line = Line(attended=True)
    front_end, sink = attended(line, [], [])
    front_end.take(".PROGRAM p\n" + "x = 1\n" * 20 + ".END\na = 2\nLISTR a\n")
    assert sink.getvalue() == "Program p: 20 steps\na                2\n"
    front_end.take(".PROGRAM p\n" + "b = 1\n" * 20 + ".END\nLISTR a")  # nobody lets it be replaced
    assert "already exists" in sink.getvalue()
    assert sink.getvalue().endswith("a                2\n")
    assert "b" not in line.session.environment.kinds


def test_a_question_does_not_outlive_its_server() -> None:
    line = Line(attended=True)
    seen: list[bool] = []

    class Thinking(PlainTerminal):
        attended = True

        def ask(self, question: Question) -> Answer:
            model = to_dict(line.session.engine.model)
            for resumed in (True, False):
                welcome = messages.Welcome(1, "k", "one", "life", "supervisor", "tester", messages.Clock(0.0), model)
                line._tell(structs.replace(welcome, resumed=resumed))
                front_end.keep_up()
                seen.append(front_end.question_is_withdrawn)
            return super().ask(question)

    front_end = Remote(line, lambda _text: None).front_end(Thinking(StringIO(), iter(["N\n"])))
    front_end.take("a = 1\nZERO")
    assert seen == [False, True]


def test_a_server_that_was_started_anew_asks_anew() -> None:
    line, told = Line(attended=True), list[str]()
    front_end, sink = attended(line, ["Y\n"], told)
    line._tell(messages.Withdrawn(1, seq=1))
    model = to_dict(line.session.engine.model)
    line._tell(messages.Welcome(1, "key", "one", "life", "supervisor", "tester", messages.Clock(0.0), model))
    front_end.keep_up()
    assert told == ["connected again"]
    front_end.take("a = 1\nZERO\nLISTR")
    assert sink.getvalue().endswith("Are you sure (Y/N)?\nNo reals defined\n")


def test_the_clock_of_a_robot_in_real_time_goes_on_between_two_looks(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]
    monkeypatch.setattr("time.monotonic", lambda: now[0])
    line = Line(attended=True, clock=(wall := ManualWall()).clock())
    front_end, _ = attended(line, [], [])
    wall.seconds += 2.0
    front_end.take("TIME")
    now[0] += 1.5
    assert front_end.status().clock == 3.5
    front_end.take("CLOCK PAUSE")
    now[0] += 1.5
    assert front_end.status().clock == 2.0


def test_who_waits_at_a_prompt_is_woken_and_looks_at_nothing_else(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("time.monotonic", lambda: 100.0)
    line, woken = Line(attended=True, clock=ManualWall().clock()), list[str]()
    front_end, _ = attended(line, [], [])
    assert front_end.rest() == RESTING
    front_end.wake = lambda: woken.append("woken")
    line._tell(messages.Told(Message("something was said")))
    assert woken == ["woken"]
    front_end.take("DRIVE 1, 40")
    assert front_end.rest() == KEEPING_UP, "the clock goes on while the arm moves"
