"""How a session talks: with somebody there, and with nobody."""

from collections.abc import Callable, Iterable
from io import StringIO

import pytest

from vrs_cli.errors import EndOfInput
from vrs_cli.interfaces.dialogue import Running
from vrs_cli.interfaces.session.session import Session
from vrs_cli.render.console import TerminalRenderer
from vrs_cli.repl.loop import PlainTerminal
from vrs_cli.repl.terminal import PROGRESS_DELAY_S, REFRESH, ShellTerminal
from vrs_cli.values.questions import Confirmation, LineWanted, Parting
from vrs_cli.values.replies import Farewell
from vrs_cli.values.results import Message, ProgramStopped, Tone

CTRL_C = "\x03"


def reader(answers: Iterable[str], asked: list[str]) -> Callable[[str], str]:
    """Answers in their order; CTRL_C is what prompt-toolkit makes of that key."""
    waiting = iter(answers)

    def read(question: str) -> str:
        asked.append(question)
        answer = next(waiting)
        if answer == CTRL_C:
            raise KeyboardInterrupt
        return answer

    return read


class Person:
    """A shell terminal on a string, its answers and its clock in the hands of the test."""

    def __init__(self, *answers: str) -> None:
        self.stream, self.asked, self.now = StringIO(), list[str](), 0.0
        self.terminal = ShellTerminal(
            reader(answers, self.asked),
            lambda: TerminalRenderer(self.stream, width=80),
            clock=lambda: self.now,
            stream=self.stream,
        )

    @property
    def text(self) -> str:
        return self.stream.getvalue()


# --- with nobody there ---


def plain(*lines: str) -> PlainTerminal:
    return PlainTerminal(StringIO(), iter(lines))


def text_of(terminal: PlainTerminal) -> str:
    assert isinstance(terminal.stream, StringIO)
    return terminal.stream.getvalue()


def test_replies_and_types_come_in_order() -> None:
    terminal = plain()
    terminal.type("a", False)
    terminal.type("b", True)
    terminal.show(Message("done"))
    assert text_of(terminal) == "ab\ndone\n"


def test_a_terminal_shows_the_escape_codes_of_strings_and_a_pipe_takes_them() -> None:
    person, terminal = Person(), plain()
    person.terminal.type("\x1b[31mred", True)
    terminal.type("\x1b[31mred", True)
    assert person.text == "^[[31mred\n"
    assert text_of(terminal) == "\x1b[31mred\n"


def test_an_error_is_remembered_for_the_exit_status() -> None:
    terminal = plain()
    terminal.show(Message("done"))
    terminal.show(Message("odd", Tone.WARNING))
    assert not terminal.failed
    terminal.show(ProgramStopped("*Undefined value* x", "p", 1, "y = x", Tone.ERROR))
    terminal.show(Message("done"))
    assert terminal.failed


def test_prompt_reads_on_in_the_input() -> None:
    terminal = plain("5\n", "6\r\n")
    assert [terminal.ask(LineWanted("How many? ")), terminal.ask(LineWanted(""))] == ["5", "6"]
    assert text_of(terminal) == "How many? \n"


def test_prompt_at_the_end_of_the_input() -> None:
    with pytest.raises(EndOfInput, match="How many"):
        plain().ask(LineWanted("How many?"))


def test_nobody_answers() -> None:
    assert plain().ask(Confirmation("Are you sure (Y/N)?")) is None


@pytest.mark.parametrize(
    ("line", "answer"), [("Y\n", True), ("no ; not yet\n", False), ("WHERE\n", None), ("\n", None)]
)
def test_a_line_of_a_pipe_that_is_no_answer_is_left_for_the_next(line: str, answer: bool | None) -> None:
    terminal = plain(line)
    assert terminal.ask(Confirmation("Are you sure (Y/N)?")) is answer
    assert text_of(terminal) == "Are you sure (Y/N)?\n"
    assert list(iter(terminal.next_line, None)) == ([] if answer is not None else [line])


# --- with somebody there ---


@pytest.mark.parametrize(
    ("answer", "agreed"),
    [("Y", True), (" yes", True), ("Y ;sure", True), ("; Y", False), ("n", False), ("", False), (CTRL_C, False)],
)
def test_questions(answer: str, agreed: bool) -> None:
    person = Person(answer)
    assert person.terminal.ask(Confirmation("Are you sure (Y/N)?")) is agreed
    assert person.asked == ["Are you sure (Y/N)? "]


def test_what_is_no_answer_is_asked_again() -> None:
    person = Person("FOR i = 1 TO 3", "Yellow", "y")
    assert person.terminal.ask(Confirmation("Sure?"))
    assert person.asked == ["Sure? "] * 3
    assert person.text == "Y or N\n" * 2


def test_who_does_not_say_whether_he_leaves_is_told_how() -> None:
    person = Person("leave", "N")
    assert not person.terminal.ask(Parting("Leave (Y/N)?"))
    assert person.asked == ["Leave (Y/N)? "] * 2
    assert person.text == "Y or N\n"


def test_ctrl_c_at_a_prompt_stops_the_program() -> None:
    person = Person(CTRL_C)
    stopped: list[bool] = []
    person.terminal.interrupt = lambda: not stopped.append(True)
    with pytest.raises(KeyboardInterrupt):
        person.terminal.ask(LineWanted("How many?"))
    assert stopped == [True]


def test_the_latest_message_is_kept() -> None:
    person = Person()
    person.terminal.show(Message("Program completed\nand more"))
    person.terminal.show(Farewell())
    assert (person.terminal.last, person.terminal.leaving) == ("Program completed", True)


def test_the_echo_of_ctrl_c_is_taken_away() -> None:
    person = Person()
    person.terminal.echoed = True
    person.terminal.show(Message("interrupted"))
    person.terminal.show(Message("done"))
    assert person.text == "\r\x1b[Kinterrupted\ndone\n"


def test_a_long_line_of_the_prompt_shows_the_clock_too() -> None:
    person = Person()
    session = Session(person.terminal)

    def clock() -> float:
        person.now += 1.0
        return person.now

    person.terminal._clock = clock
    session.perform("DELAY 3")
    assert "running, t = 3.0 s" in person.text


def test_a_short_run_shows_no_progress() -> None:
    person = Person()
    person.terminal.progress(Running(0.0))
    person.now = PROGRESS_DELAY_S / 2
    person.terminal.progress(Running(3.0))
    person.terminal.end_progress()
    assert person.text == ""


def test_a_long_run_shows_the_clock_now_and_then_and_takes_it_away() -> None:
    person = Person()
    person.terminal.progress(Running(0.0))
    for beat in range(10):
        person.now = PROGRESS_DELAY_S + beat * REFRESH * 0.501  # every second one is due
        person.terminal.progress(Running(float(beat)))
    assert person.text.count("running") == 5
    assert "t = 8.0 s" in person.text
    person.terminal.type("hello", True)
    assert person.text.endswith("\r\x1b[Khello\n")
    person.terminal.end_progress()
    person.now += 10.0
    person.terminal.progress(Running(99.0))
    assert "99" not in person.text
