"""Run the loop of the shell: read a line, send it, show the replies and ask the robot's questions, until the user
leaves.

`run_loop` reads lines, at a prompt or from a pipe, and passes each to `Exchange.take`. The exchange sends the line to
the robot's port (the interface for requests to a robot), receives messages (`_hear`), shows replies and asks questions
at the terminal, until the robot has completed the line. Ctrl-C stops the line that is being carried out (`interrupt`),
Ctrl-X the robot (`abort`). Between lines, `keep_up` shows messages that arrive without a request.

No line is sent twice: if the connection was cut while a line was on its way, a message says what became of it.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager
from functools import partial
from typing import Protocol, TextIO

from vrs_cli.engine.feed import Inbox
from vrs_cli.errors import EndOfInput, RequestRefused, VrsError
from vrs_cli.interfaces.dialogue import Reading, Running, Terminal, internal_error
from vrs_cli.interfaces.port.port import MakeRequest, Port, answer_to
from vrs_cli.render.plain import for_stream
from vrs_cli.render.text import plain_text
from vrs_cli.repl.interrupt import Ended, stoppable
from vrs_cli.repl.piped import QUESTION, Driven, lines_of_pipe
from vrs_cli.values import acts, replies, results
from vrs_cli.values.questions import Answer, Confirmation, LineWanted, Question, end_of_input
from vrs_cli.values.replies import Farewell, Reply, is_error, refusal
from vrs_cli.wire import messages
from vrs_cli.wire.messages import Abort, Asked, At, Done, How, Line, Refused, ServerMessage

MAX_CHARS = 50_000  # maximum length of a message over a connection; longer pasted text is sent in several messages


class LineReader(Protocol):
    """A source of a user's lines: a prompt or a pipe."""

    def read(self) -> str | None:
        """Return the next line, QUESTION if a program asks, or None if the user leaves or the input ends."""

    def interruptible(self) -> AbstractContextManager[object]:
        """Return a context in which Ctrl-C stops the command that is being carried out."""

    def goes_on(self) -> bool:
        """Call this method after each line. Return whether another line is to be read."""


def run_loop(reader: LineReader, exchange: Exchange, line: str | None) -> None:
    """Carry out lines, starting with `line`, until the user leaves. Errors in a line do not end the loop; at a prompt,
    Ctrl-C does not end it either."""
    while line is not None:
        try:
            with reader.interruptible():
                if line == QUESTION:
                    exchange.answer()
                else:
                    exchange.take(line)
            line = reader.read() if reader.goes_on() else None
        except Ended:
            raise
        except KeyboardInterrupt:  # Ctrl-C between two lines: it ends a pipe, not a prompt
            if not exchange.terminal.attended:
                raise
            line = reader.read()


class PlainTerminal:
    """A terminal without a person: writes replies and the output of programs to one stream, in order.

    `lines`: the input, which also contains the answers to questions. A line that is not a valid answer is carried out
    as a command. `failed`: whether a command could not be carried out. `leaving`: whether EXIT was given.
    """

    attended = False

    def __init__(self, stream: TextIO, lines: Iterable[str]) -> None:
        self.stream = stream
        self._lines = iter(lines)
        self._back: list[str] = []  # a line that was not an answer, to be read again
        self.failed = False
        self.leaving = False
        self._entered = ""

    def next_line(self) -> str | None:
        """Return the next line of the input, or None at its end."""
        return self._back.pop() if self._back else next(self._lines, None)

    def show(self, reply: Reply) -> None:
        self.failed = self.failed or is_error(reply)
        self.leaving = self.leaving or isinstance(reply, replies.Farewell)
        self._write(plain_text(reply))

    def type(self, text: str, newline: bool) -> None:
        self._write(text + ("\n" if newline else ""))

    def _write(self, text: str) -> None:
        self.stream.write(for_stream(text, self.stream))

    def progress(self, doing: Running | Reading) -> None:
        """Do nothing: nobody watches the progress."""

    def ask(self, question: Question) -> Answer:
        """Return the answer in the next line of the input; None if that line is not a valid answer. Raises EndOfInput
        if a program wants a line and there is none."""
        if isinstance(question, LineWanted):
            return self._line(question)
        if not isinstance(question, Confirmation):
            return None
        self._write(question.text)
        self.stream.flush()
        line = self.next_line()
        self.stream.write("\n")
        agreed = None if line is None else yes_or_no(line)
        if line is not None and agreed is None:
            self._back.append(line)
        return agreed

    def _line(self, question: LineWanted) -> str | None:
        if question.wrong:
            self._back.append(self._entered)
            return None
        if question.text:
            self._write(question.text)
            self.stream.flush()
        line = self.next_line()
        if line is None:
            raise end_of_input(question)
        if question.text:
            self.stream.write("\n")
        self._entered = line
        return line.rstrip("\r\n")


ANSWERS = {"Y": True, "YES": True, "N": False, "NO": False}
WANTED = "Y or N"  # the reply to an answer that is neither yes nor no


def yes_or_no(line: str) -> bool | None:
    """Return the answer in a line to a question (Y/N): True for yes, False for no, None for anything else. A comment
    may follow."""
    return ANSWERS.get(line.partition(";")[0].strip().upper())


class PipeReader:
    """The reader of a pipe's lines; replies go to `sink`. `make`: returns the exchange with the robot. `live`: whether
    the robot is in this process and keeps running while the reader waits for a line."""

    def __init__(self, make: MakeExchange, source: Iterable[str], sink: TextIO, live: bool) -> None:
        lines = lines_of_pipe(source) if live else None
        self._sink, self.terminal = sink, PlainTerminal(sink, _without_byte_order_mark(lines or source))
        self.exchange = make(self.terminal)
        if lines is not None:
            lines.robot, lines.after = self.exchange.driven, self._show_changes

    def _show_changes(self) -> None:
        self.exchange.keep_up()
        self._sink.flush()

    def read(self) -> str | None:
        line = self.terminal.next_line()
        return None if line is None else line.rstrip("\r\n")

    def interruptible(self) -> AbstractContextManager[object]:
        return stoppable(self.exchange.interrupt)

    def goes_on(self) -> bool:
        self._sink.flush()
        if self.exchange.was_cut():
            self.exchange.drop("the lines after this one")
            return False
        return not (self.terminal.leaving or self.exchange.interrupted)


def run_on_pipe(make: MakeExchange, source: Iterable[str], sink: TextIO, *, live: bool) -> int:
    """Run the shell without a terminal: nothing is echoed, and the next line answers a question. Return 1 if a line
    could not be carried out, else 0.

    A wrong line does not prevent later lines; EXIT, Ctrl-C and a cut of the connection do. Raises KeyboardInterrupt for
    a Ctrl-C while the shell waits for the next line.
    """
    reader = PipeReader(make, source, sink, live)
    exchange = reader.exchange
    with reader.interruptible():
        exchange.opening()
    run_loop(reader, exchange, reader.read())
    with reader.interruptible():
        exchange.leave_entry("the input ended: ")
    exchange.closing()
    return int(reader.terminal.failed or exchange.failed or exchange.interrupted)


def _without_byte_order_mark(source: Iterable[str]) -> Iterator[str]:
    """Yield lines without the byte order mark that some systems write before the first line."""
    for number, line in enumerate(source):
        yield line if number else line.removeprefix("\ufeff")


class Exchange:
    """The exchange between a user and a robot: sends lines to a port, and shows messages and questions at a terminal.

    `notify`: a function that is called with messages about the connection. `interrupted`: whether Ctrl-C was pressed
    during the last line. `failed`: whether a line was not carried out (`notify` got the reason). `noted`: an error that
    the toolbar shows.
    """

    def __init__(self, terminal: Terminal, port: Port, notify: Callable[[str], None]) -> None:
        self.terminal, self.port, self.notify = terminal, port, notify
        self.interrupted = self.failed = False
        self.noted = ""
        # functions for lines that are not in VAL-II; each carries out the lines that it knows, and returns whether it
        # did
        self.own_lines: list[Callable[[str], bool]] = []
        self.taken: Callable[[], None] = lambda: None  # called after each line
        self.kept_up: Callable[[], None] = lambda: None  # called after `keep_up`, unless a line is being carried out
        # called with messages about the connection (`repl/connection.py`)
        self.hear_connection: Callable[[ServerMessage], None] = lambda _message: None
        # a robot in this process; its due actions are carried out while the reader waits for a line
        self.driven: Driven | None = None
        self.opening: Callable[[], None] = lambda: None  # called before the first line
        self.after: Callable[[], None] = lambda: None  # called after each command
        self.closing: Callable[[], None] = port.close  # called after the user has left
        self._heard: Inbox[ServerMessage] = Inbox()
        self._later: deque[ServerMessage] = deque()  # messages that are handled after the open question
        self._waits = self._asks = False
        self._breaks = self._count_breaks()  # number of connection losses when the last line was taken
        self._withdrawn: set[int] = set()
        self._question = 0  # the number of the open question; 0 if no question is open
        self.wake: Callable[[], object] = int  # called, from any thread, when messages wait for `keep_up`
        port.listen(self.receive)

    # --- actions: each method returns when the robot has finished, and shows any error itself ---

    def take(self, text: str) -> None:
        """Carry out a line, or several lines that were pasted together."""
        self.interrupted = False
        self._breaks = self._count_breaks()
        if any(take(text) for take in self.own_lines):
            return
        *parts, last = _parts(text) if self.port.name else [text]
        for part in parts:
            end = self.do(partial(Line, text=part, more=True), part)
            if end is None or not end.seq or self.interrupted:
                return
        self.do(partial(Line, text=last), last)
        self.taken()

    def answer(self) -> None:
        """Ask the user the questions of programs that wait for an answer."""
        self.act(acts.Attend())

    def was_cut(self) -> bool:
        """Return whether the connection was lost since the last line was taken. Lines typed after the loss must not be
        carried out, because they would take effect later than the user expects."""
        return not self.port.open or self._breaks != self._count_breaks()

    def _count_breaks(self) -> int:
        """Return how often the connection was lost. For a person also count stalls (long silences), after which the
        person no longer expects the line to be carried out. A pipe can wait."""
        return self.port.cuts + self.port.stalls * self.terminal.attended

    def drop(self, what: str) -> None:
        """Report that a typed line will not be sent."""
        self.lose(f"not given, for the connection was cut meanwhile: {what}")

    def leave_entry(self, why: str = "") -> None:
        """Drop the program that is being typed, unless the user wants to continue typing it."""
        if self.port.open:  # after a loss of connection the server drops the program itself
            self.act(acts.LeaveEntry(why))

    def leave(self) -> None:
        """End the shell like EXIT (Ctrl-D), even if an error occurs. A robot behind a connection keeps running for
        others, so nothing is lost."""
        end = None if self.port.name else self.do(lambda id: At(id, acts.Say("EXIT")), None)
        if end is None or end.refusal is not None:
            self.terminal.show(Farewell())

    def stop_program(self) -> None:
        """Stop the program that runs while the prompt is empty. A message follows when the arm is at rest."""
        self.act(acts.StopProgram())

    def abort(self) -> None:
        """Stop the robot; this request overtakes all others. `keep_up` shows what was stopped. A signal handler may
        call this method."""
        self.port.post(Abort, self.receive)

    def act(self, act: results.Act[None]) -> None:
        self.do(lambda id: At(id, act))

    def do(self, make: MakeRequest, line: str | None = "") -> Done | Refused | None:
        """Send a command, and show messages and ask questions until the command has ended. Return its final answer, or
        None if the wait was given up.

        `line`: the typed line, which is shown with a refusal; None to show no refusal.
        """
        self.noted = ""
        self._waits = True
        try:
            id = self.port.begin(make, self.receive)
            while True:
                message = self._later.popleft() if self._later else self.port.take(self._heard)
                assert message is not None, "it waits as long as that takes"
                if isinstance(message, Done | Refused) and message.id == id:
                    if line is not None:
                        self._show_end(message, line)
                    return message
                self._hear(message)
        except RequestRefused as error:
            self.lose(str(error))
        except BrokenPipeError:
            raise  # nobody reads the output any more
        except (Exception, KeyboardInterrupt) as error:
            self.interrupted |= isinstance(error, KeyboardInterrupt)
            if why := self.port.give_up(error):
                self.lose(why)
            self.keep_up()
        finally:
            self._waits = False
            self.after()
        return None

    def _show_end(self, end: Done | Refused, line: str) -> None:
        if end.refusal is None:
            return
        if not end.seq and self.port.name:  # not the robot but the connection has refused the line
            self.lose(str(end.refusal.error()))
            return
        try:
            reply = refusal(end.refusal.error(), line)
        except Exception as error:  # an internal error of this process
            reply = internal_error(error)
        self._show(reply)

    def lose(self, why: str) -> None:
        """Report that something was not carried out."""
        self.failed = True
        self.notify(why)

    # --- messages ---

    def _hear(self, message: ServerMessage) -> None:
        match message:
            case messages.Told(reply):
                self._show(reply)
            case messages.Typed(text, newline):
                self.terminal.type(text, newline)
            case Asked(number):
                if number not in self._withdrawn:
                    self._ask(message)
            case messages.Withdrawn(number):
                self._withdrawn.add(number)
            case messages.Status(around):
                if self._waits and around.running:
                    self.terminal.progress(Running(around.clock))
            case Done() | Refused():
                self._show_end(message, "")
            case _:
                self.hear_connection(message)

    def _show(self, reply: Reply) -> None:
        """Show a reply. If this fails, show the internal error instead."""
        try:
            self.terminal.show(reply)
        except BrokenPipeError:
            raise
        except Exception as error:
            self.terminal.show(internal_error(error))

    def forget_questions(self) -> None:
        """Forget the questions of an earlier connection: the robot has dropped them, and counts new ones from 1 again.
        A question that is still open no longer needs an answer."""
        self._withdrawn = {self._question} - {0}

    def _ask(self, asked: Asked) -> None:
        """Ask a question and send the answer."""
        self._asks, self._question = True, asked.number
        try:
            answer = answer_to(asked, self._ask_terminal)
        finally:
            self._asks, self._question = False, 0
        self.interrupted |= answer.how is How.INTERRUPTED
        self.port.tell(answer)

    def _ask_terminal(self, question: Question) -> Answer:
        """Return the terminal's answer. If a full screen cannot be shown, show the reason and treat the screen as
        closed."""
        try:
            return self.terminal.ask(question)
        except (EndOfInput, BrokenPipeError):
            raise
        except VrsError as error:
            self.terminal.show(results.Message(str(error), results.Tone.ERROR))
        except Exception as error:
            self.terminal.show(internal_error(error))
        return True

    # --- Ctrl-C ---

    def interrupt(self) -> bool:
        """Stop the awaited command (Ctrl-C). Return whether the command will end. Ctrl-C at an open question is the
        answer to that question instead. A signal handler may call this method."""
        if not self._waits or self._asks:
            return False
        self.interrupted = True
        return self.port.interrupt()

    # --- between lines ---

    def note(self, error: Exception) -> None:
        """Store an error for the toolbar."""
        self.noted = internal_error(error).text

    @property
    def question_is_withdrawn(self) -> bool:
        """True if the current question no longer needs an answer."""
        return self._question in self._withdrawn

    def receive(self, message: ServerMessage) -> None:
        """Store a message that has arrived, and wake the prompt. The thread of a connection may call this method."""
        self._heard.put(message)
        self.wake()

    def keep_up(self) -> None:
        """Carry out all due actions and show their messages. Leave questions, and the final answer to an awaited
        command, to `do`."""
        try:
            while (message := self.port.take(self._heard, 0.0)) is not None:
                if isinstance(message, Asked) or (self._waits and isinstance(message, Done | Refused)):
                    self._later.append(message)
                else:
                    self._hear(message)
            if not self._waits:
                self.kept_up()
        except BrokenPipeError:
            raise
        except Exception as error:
            self.note(error)


def _parts(text: str) -> list[str]:
    """Divide pasted text into messages of complete lines, each at most MAX_CHARS long unless a single line is
    longer."""
    parts, size = [""], 0
    for line in text.splitlines(keepends=True):
        if size and size + len(line) > MAX_CHARS:
            parts.append("")
            size = 0
        parts[-1] += line
        size += len(line)
    return parts


MakeExchange = Callable[[Terminal], Exchange]
