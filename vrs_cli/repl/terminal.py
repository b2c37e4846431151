"""How a session talks at a terminal, with somebody there to answer; and where there is nobody (a pipe)."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING, TextIO

from vrs_cli.dialogue import replies
from vrs_cli.dialogue.questions import Amendment, Confirmation, LineWanted, Parting
from vrs_cli.dialogue.replies import Reply, is_error
from vrs_cli.errors import EndOfInput, UsageError
from vrs_cli.render.blocks import shortened
from vrs_cli.render.control import for_stream, visible
from vrs_cli.render.text import plain_text
from vrs_cli.repl.interrupt import Ended

if TYPE_CHECKING:
    from vrs_cli.interfaces.editor.screen import ScreenDraft
    from vrs_cli.interfaces.jog.jogger import Jogger
    from vrs_cli.kinematics.arm import RobotArm
    from vrs_cli.render.console import TerminalRenderer
    from vrs_cli.trajectory.timeline import Timeline

PATIENCE = 0.5  # [s] a program runs before its progress is shown
REFRESH = 0.1  # [s] between two lines of progress
CLEAR_LINE = "\r\x1b[K"


class PlainTerminal:
    """Replies and what programs type in one stream, in order; `lines` is the input that PROMPT reads on from.

    `failed`: some command could not be done; `leaving`: EXIT was said.
    """

    def __init__(self, stream: TextIO, lines: Iterator[str]) -> None:
        self.stream = stream
        self.lines = lines
        self.failed = False
        self.leaving = False

    def show(self, reply: Reply) -> None:
        self.failed = self.failed or is_error(reply)
        self.leaving = self.leaving or isinstance(reply, replies.Farewell)
        self._write(plain_text(reply))

    def type(self, text: str, newline: bool) -> None:
        self._write(text + ("\n" if newline else ""))

    def _write(self, text: str) -> None:
        self.stream.write(for_stream(text, self.stream))

    def ask(self, question: LineWanted) -> str:
        """The next line of the input. Raises EndOfInput."""
        prompt = question.text
        if prompt:
            self._write(prompt)
        try:
            answer = next(self.lines).rstrip("\r\n")
        except StopIteration:
            raise EndOfInput(f"PROMPT {prompt!r} has nothing more to read", "give the input one more line") from None
        if prompt:
            self.stream.write("\n")
        return answer

    def confirm(self, question: Confirmation) -> bool:  # noqa: ARG002 (nobody is there to be asked)
        return False


class ShellTerminal:
    """A terminal with somebody at it. `read` asks for a line (it is prompt-toolkit's, or a stand-in).

    `read` raises KeyboardInterrupt for Ctrl-C and EOFError for Ctrl-D. `interrupt` stops the running program.
    """

    def __init__(
        self,
        read: Callable[[str], str],
        renderer: Callable[[], TerminalRenderer],
        *,
        clock: Callable[[], float] = time.monotonic,
        stream: TextIO | None = None,
    ) -> None:
        self._read, self._renderer, self._clock = read, renderer, clock
        self._stream = stream
        self.interrupt: Callable[[], bool] = lambda: False
        self.line_left: Callable[[], None] = lambda: None  # a line of a program in SEE has been typed
        self.leaving = False
        self.last = ""  # the latest message, for the toolbar
        self._since: float | None = None
        self._refreshed = 0.0
        self._progress_shown = False
        self.echoed = False  # the terminal has shown ^C where the next answer begins

    @property
    def stream(self) -> TextIO:
        return self._stream or sys.stdout

    def show(self, reply: Reply) -> None:
        self._clear_progress()
        if isinstance(reply, replies.Farewell):
            self.leaving = True
        else:
            self._renderer().draw(reply)
        self.last = latest(reply) or self.last

    def play(self, arm: RobotArm, timeline: Timeline) -> None:
        """REPLAY: the trajectory at its own rate."""
        from vrs_cli.repl.player import play

        play(arm, timeline, 1.0)

    def type(self, text: str, newline: bool) -> None:
        self._clear_progress()
        self.stream.write(visible(text) + ("\n" if newline else ""))
        self.stream.flush()

    def ask(self, question: LineWanted) -> str:
        """One line for PROMPT. Ctrl-C stops the program; the line is empty then."""
        self._clear_progress()
        try:
            return self._read(question.text or "? ")
        except (KeyboardInterrupt, EOFError):
            if self.interrupt():
                return ""
            raise KeyboardInterrupt from None

    def change(self, question: Amendment) -> str | None:
        """An answer to `Change?`; None for Ctrl-C: leave things as they were."""
        return self._answer(question)

    def _answer(self, question: Amendment | Confirmation) -> str | None:
        try:
            return self._read(f"{question.text} ")
        except (KeyboardInterrupt, EOFError):
            return None

    def confirm(self, question: Confirmation) -> bool:
        """Asked until the answer is one: a line of a paste is none. An empty line and Ctrl-C are no."""
        self._clear_progress()
        while True:
            answer = (self._answer(question) or "").partition(";")[0].strip().upper()
            if answer in ("Y", "YES", "N", "NO", ""):
                return answer.startswith("Y")

    def leave(self, question: Parting) -> bool:
        """Whether the user leaves: Y, EXIT or QUIT, or Ctrl-D. Ctrl-C and an empty line are no."""
        while True:
            try:
                answer = self._read(f"{question.text} ").strip().upper()
            except Ended:
                raise
            except KeyboardInterrupt:
                return False
            except EOFError:
                return True
            if answer in ("Y", "YES", "EXIT", "QUIT"):
                return True
            if answer in ("N", "NO", ""):
                return False

    def see(self, draft: ScreenDraft) -> Iterable[Reply]:
        """SEE: the program fills the screen until the user leaves. Raises UsageError for a terminal that cannot."""
        from prompt_toolkit.utils import is_dumb_terminal

        if is_dumb_terminal():
            raise UsageError("SEE fills the screen, and this terminal cannot", f"EDIT {draft.name} edits line by line")
        from vrs_cli.repl.screen_editor import ScreenEditor

        ScreenEditor(draft, self.line_left).run()
        return draft.said

    def jog(self, jogger: Jogger) -> None:
        """JOG: the keys move the arm until the user leaves. Raises UsageError for a terminal that cannot."""
        from prompt_toolkit.utils import is_dumb_terminal

        if is_dumb_terminal():
            raise UsageError("JOG alone needs a terminal with keys", "JOG axis, amount")
        from vrs_cli.repl.jog_panel import JogPanel

        JogPanel(jogger).run()

    # --- progress ---

    def begin_progress(self) -> None:
        """A program starts, or a file is read that may be long."""
        self._since = self._clock()

    def progress(self, clock: float) -> None:
        """A running program has come to that time of the robot's clock [s]."""
        self._report(f"running, t = {clock:.1f} s (Ctrl-C stops it)")

    def reading(self, path: str, share: float) -> None:
        """So much of a file has been read, from 0 to 1."""
        self._report(f"reading {path}, {share:.0%} (Ctrl-C stops it)")

    def _report(self, text: str) -> None:
        """Show it in place of the last, not too often, and not before a while."""
        now = self._clock()
        if self._since is None or now - self._since < PATIENCE or now - self._refreshed < REFRESH:
            return
        self._refreshed = now
        self._progress_shown = True
        self.stream.write(f"{CLEAR_LINE}{shortened(text, (self._renderer().page.width or len(text)) - 1)}")
        self.stream.flush()

    def end_progress(self) -> None:
        """It has ended."""
        self._clear_progress()
        self._since = None

    def _clear_progress(self) -> None:
        if self._progress_shown or self.echoed:
            self.stream.write(CLEAR_LINE)
            self._progress_shown = self.echoed = False


def latest(reply: Reply) -> str:
    """What the toolbar keeps of a reply: the first line of a message."""
    if isinstance(reply, replies.Message):
        return reply.text.split("\n")[0]
    if isinstance(reply, replies.ProgramStopped):
        return f"{reply.what} at {reply.program}, step {reply.step}"
    return ""
