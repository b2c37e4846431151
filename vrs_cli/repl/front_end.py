"""The front end of a shell at one port: lines go in; what is said is shown, and asked, at a terminal.

Nothing is given twice by itself: of a line that was on its way when the connection was cut the user is told what became
of it.
"""

from __future__ import annotations

import tempfile
from collections import deque
from collections.abc import Callable
from functools import partial
from pathlib import Path

from vrs_cli.engine.feed import Inbox
from vrs_cli.engine.position import Watched
from vrs_cli.errors import EndOfInput, RequestRefused, VrsError
from vrs_cli.files.trajectory_file import Recording, read_trajectory
from vrs_cli.interfaces.conversation.complete import Signature, signature
from vrs_cli.interfaces.conversation.internal_error import internal_error
from vrs_cli.interfaces.dialogue import Running, Terminal
from vrs_cli.interfaces.port.port import FarHand, MakeRequest, Outlet, Port, answer_to, check_end
from vrs_cli.repl.piped import KEEPING_UP, RESTING, SHORTEST, Driven
from vrs_cli.values.acts import Attend, Findings, KeepDraft, Kept, LeaveEntry, ReadDraft, Say, StopProgram
from vrs_cli.values.diagnostics import Diagnostic
from vrs_cli.values.hand import Look, Seen
from vrs_cli.values.questions import Answer, Editing, Jogging, Playing, PromptStatus, Question, Suggestion
from vrs_cli.values.replies import Farewell, Message, Reply, Tone, refusal
from vrs_cli.values.tagged import Act
from vrs_cli.wire import messages
from vrs_cli.wire.messages import Abort, Asked, At, Done, How, Line, Refused, ServerMessage

AT_ONCE = 1.0  # [s] that the answer to a look is waited for: a key does not wait longer
COMING_BACK = 60.0  # [s] that a file is waited for
MAX_CHARS = 50_000  # of one message over a connection


class FrontEnd:
    """`told` hears what concerns the connection, and nobody shows at the terminal. `noted`: an error where nothing can
    be printed; `interrupted`: Ctrl-C was heard in the last line; `failed`: something was not done, and `told` has it.
    """

    def __init__(self, terminal: Terminal, port: Port, told: Callable[[str], None]) -> None:
        self.terminal, self.port, self.told = terminal, port, told
        self.interrupted = self.failed = False
        self.noted = ""
        # lines that are no VAL-II: each function carries out a line that is its own, and returns whether it did
        self.own_lines: list[Callable[[str], bool]] = []
        self.taken: Callable[[], None] = lambda: None  # is called when a line has been carried out
        self.kept_up: Callable[[], None] = lambda: None  # is called after `keep_up`, unless a line is carried out
        # `repl/connection.py`: hears messages about the connection
        self.hear_connection: Callable[[ServerMessage], None] = lambda _message: None
        self.driven: Driven | None = None  # a robot of this process, whose time goes on while a line is waited for
        self.opening: Callable[[], None] = lambda: None  # what comes before the first line
        self.after: Callable[[], None] = lambda: None  # is called after each command
        self.closing: Callable[[], None] = port.close  # the user has left
        self._heard: Inbox[ServerMessage] = Inbox()
        self._later: deque[ServerMessage] = deque()  # for when the user has no question before him
        self._status = PromptStatus()
        self._waits = self._asks = False
        self._breaks = self._count_breaks()  # when the last line was taken
        self._withdrawn: set[int] = set()
        self._question = 0  # that is before the user
        self.wake: Callable[[], object] = int  # is called, from any thread, when `keep_up` has something to do
        port.listen(self.come)

    # --- what is done: each returns when it is done, and whatever went wrong has been shown ---

    def take(self, text: str) -> None:
        """Carry out a line, or several that were pasted together."""
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
        """Put the questions that programs have."""
        self.act(Attend())

    def was_cut(self) -> bool:
        """Return whether the connection is cut, or was since the last line was taken: what was typed meanwhile is not
        to be taken, for it would be done later than whoever typed it expects.
        """
        return not self.port.open or self._breaks != self._count_breaks()

    def _count_breaks(self) -> int:
        """Return a person expects nothing any more of a line that is quiet for long; a pipe waits."""
        return self.port.cuts + self.port.stalls * self.terminal.attended

    def drop(self, what: str) -> None:
        """Tell that this was typed and is not taken."""
        self.lose(f"not given, for the connection was cut meanwhile: {what}")

    def leave_entry(self, why: str = "") -> None:
        """Forget what is typed of a program, unless a user who is asked wants to go on with it."""
        if self.port.open:  # else the server forgets it by itself
            self.act(LeaveEntry(why))

    def leave(self) -> None:
        """Ctrl-D: as EXIT, from which no error keeps the user. A robot behind a connection goes on for others: nothing
        is lost.
        """
        end = None if self.port.name else self.do(lambda id: At(id, Say("EXIT")), None)
        if end is None or end.refusal is not None:
            self.terminal.show(Farewell())

    def stop_program(self) -> None:
        """Stop the program that runs beside an empty line; its end is told when the arm stands."""
        self.act(StopProgram())

    def abort(self) -> None:
        """Stop the robot before all else that is asked of it; `keep_up` shows what was stopped. Safe in a signal
        handler.
        """
        self.port.post(Abort, self.come)

    def act(self, act: Act[None]) -> None:
        self.do(lambda id: At(id, act))

    def do(self, make: MakeRequest, line: str | None = "") -> Done | Refused | None:
        """Send a command; show what is said of it, and ask what is asked, until it has ended. Return its end; None if
        that was not waited for. A refusal of a `line` is shown; None: it is not shown.
        """
        self.noted = ""
        self._waits = True
        try:
            id = self.port.begin(make, self.come)
            while True:
                message = self._later.popleft() if self._later else self.port.take(self._heard)
                assert message is not None, "it waits as long as that takes"
                if isinstance(message, Done | Refused) and message.id == id:
                    if line is not None:
                        self._ended(message, line)
                    return message
                self._hear(message)
        except RequestRefused as error:
            self.lose(str(error))
        except BrokenPipeError:
            raise  # whoever read us has gone
        except (Exception, KeyboardInterrupt) as error:
            self.interrupted |= isinstance(error, KeyboardInterrupt)
            if why := self.port.give_up(error):
                self.lose(why)
            self.keep_up()
        finally:
            self._waits = False
            self.after()
        return None

    def _ended(self, end: Done | Refused, line: str) -> None:
        if end.refusal is None:
            return
        if end.seq or not self.port.name:
            self._show(_shown(end, line))
        else:  # no robot has said it
            self.lose(str(end.refusal.error()))

    def lose(self, why: str) -> None:
        """Tell that something was not done."""
        self.failed = True
        self.told(why)

    # --- what comes ---

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
                self._ended(message, "")
            case _:
                self.hear_connection(message)

    def _show(self, reply: Reply) -> None:
        """Show a reply; if that fails, show the error of vrs in its place."""
        try:
            self.terminal.show(reply)
        except BrokenPipeError:
            raise
        except Exception as error:
            self.terminal.show(internal_error(error))

    def forget_questions(self) -> None:
        """The robot has forgotten the questions that were asked over an earlier connection, and counts them anew."""
        self._withdrawn = {self._question} - {0}

    def _ask(self, asked: Asked) -> None:
        """Have a question answered."""
        self._asks, self._question = True, asked.number
        try:
            answer = answer_to(asked, self._answered)
        finally:
            self._asks, self._question = False, 0
        self.interrupted |= answer.how is How.INTERRUPTED
        self.port.tell(answer)

    def _answered(self, question: Question) -> Answer:
        """Ask a question; a screen that cannot be filled is told, and counts as left."""
        try:
            return self.terminal.ask(question)
        except (EndOfInput, BrokenPipeError):
            raise
        except VrsError as error:
            self.terminal.show(Message(str(error), Tone.ERROR))
        except Exception as error:
            self.terminal.show(internal_error(error))
        return True

    # --- Ctrl-C ---

    def interrupt(self) -> bool:
        """Stop what is waited for; whether it comes to an end by itself. A question that is open is answered with
        Ctrl-C. Safe in a signal handler.
        """
        if not self._waits or self._asks:
            return False
        self.interrupted = True
        return self.port.interrupt()

    # --- while a line is typed ---

    def note(self, error: Exception) -> None:
        """Keep an error for the toolbar."""
        self.noted = internal_error(error).text

    def status(self) -> PromptStatus:
        self._status = self.port.status()
        return self._status

    def signature(self, text: str, *, steps: bool = False) -> Signature | None:
        """Return the signature of the word that is typed last; `steps`: in a program, whatever is open."""
        return signature(text, self.port.program, at_prompt=not (self._status.in_program or steps))

    def suggestions(self, text: str, everything: bool) -> list[Suggestion]:
        """Suggest words that may come next after a text. Raises an error of vrs itself in this process."""
        end = self.end_of(lambda id: messages.Complete(id, text, everything))
        if isinstance(end, Refused):
            end.refusal.error()
        return list(end.choices) if isinstance(end, messages.Completed) else []

    def end_of(self, make: MakeRequest, seconds: float = AT_ONCE) -> ServerMessage | None:
        """Send a request of which nothing is shown, and return its end; None where that does not come in time."""
        found: Inbox[ServerMessage] = Inbox()
        try:
            self.port.begin(make, found.put)
        except RequestRefused:
            return None
        return self.port.take(found, seconds)

    @property
    def withdrawn(self) -> bool:
        """Return whether the question that is before the user waits for no answer any more."""
        return self._question in self._withdrawn

    def rest(self) -> float:
        """Return how long nothing happens that somebody would see [s], unless something comes from elsewhere."""
        now = self.status()
        return min(max(self.port.due, SHORTEST), KEEPING_UP if now.clock < now.end else RESTING)

    def come(self, message: ServerMessage) -> None:
        """Something is there to be looked at, perhaps in the thread of a connection."""
        self._heard.put(message)
        self.wake()

    def keep_up(self) -> None:
        """Let happen, or show, what has become due while nobody was looking. What belongs to a command whose question
        is before the user comes after it.
        """
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

    # --- what fills the screen ---

    def hand(self, question: Jogging) -> FarHand:
        """Return the arm of JOG. Raises RequestRefused if the robot does not answer."""
        seen = self.end_of(lambda id: At(id, Look()))
        if not isinstance(seen, Done) or not isinstance(seen.found, Seen):
            raise RequestRefused("the robot does not answer", "JOG again")
        return FarHand(self.begin, question.joints, question.units, seen.found)

    def begin(self, make: MakeRequest, outlet: Outlet) -> int:
        """Send a request beside the one that is waited for; what is due is done."""
        id = self.port.begin(make, outlet)
        self.keep_up()
        self.after()
        return id

    def recording(self, question: Playing) -> Recording:
        """Return the trajectory of REPLAY: its file comes here, unless the robot of this process has it."""
        if isinstance(self.port.on_screen, Recording):
            return self.port.on_screen
        fetched = self.end_of(lambda id: messages.Get(id, question.path), COMING_BACK)
        if not isinstance(fetched, messages.Fetched):
            raise RequestRefused(f"{question.path} does not come from the robot", "REPLAY again")
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / Path(question.path).name
            path.write_bytes(fetched.data)
            return read_trajectory(path)

    def watched(self) -> Watched | None:
        """Return the robot, to be looked at as it moves; None where nothing is seen of it."""
        try:
            return self.port.follow()
        except RequestRefused:
            return None


def _shown(end: Done | Refused, line: str) -> Reply:
    """Return the reply for a refusal."""
    assert end.refusal is not None, "it was refused"
    try:
        return refusal(end.refusal.error(), line)
    except Exception as error:  # an error of vrs in this process
        return internal_error(error)


def _parts(text: str) -> list[str]:
    """Divide pasted text into messages of whole lines."""
    parts, size = [""], 0
    for line in text.splitlines(keepends=True):
        if size and size + len(line) > MAX_CHARS:
            parts.append("")
            size = 0
        parts[-1] += line
        size += len(line)
    return parts


Found = Callable[[tuple[Diagnostic, ...]], None]  # is told the mistakes in a text


class DraftPage:
    """The program of SEE while it is edited. One look at its text is on its way at a time, and the last text is looked
    at.
    """

    def __init__(self, question: Editing, front_end: FrontEnd) -> None:
        self.name, self.text, self.row, self.dialect = question.name, question.text, question.row, question.dialect
        self._front_end = front_end
        self._latest: tuple[str, Found] | None = None
        self._looking = False

    def look(self, text: str, found: Found) -> None:
        """Tell `found` what is wrong with a text, at once or when that has come."""
        self._latest = text, found
        if not self._looking:
            self._send()

    def _send(self) -> None:
        assert self._latest is not None, "there is something to look at"
        (text, found), self._latest, self._looking = self._latest, None, True

        def hear(end: ServerMessage) -> None:
            self._looking = False
            if isinstance(end, Done) and isinstance(end.found, Findings):
                found(end.found.findings)
            if self._latest is not None:
                self._send()

        try:
            self._front_end.begin(lambda id: At(id, ReadDraft(text)), hear)
        except RequestRefused:  # there is no connection: the text is looked at when it changes again
            self._looking = False

    def save(self, text: str) -> str:
        """Store the program; what is said of it. Raises VrsError."""
        end = self._front_end.end_of(lambda id: At(id, KeepDraft(text)), COMING_BACK)
        if end is not None:
            check_end(end)
        if not isinstance(end, Done) or not isinstance(end.found, Kept):
            raise RequestRefused("the robot does not answer", "store it again")
        self._front_end.after()
        self.name = end.found.name
        return end.found.said
