"""Show replies and ask questions on a terminal that a person uses; show long replies through a pager."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING, TextIO

from vrs_cli.interfaces.dialogue import Reading, Running
from vrs_cli.render import blocks, colours, plain
from vrs_cli.repl.interrupt import Ended
from vrs_cli.repl.loop import WANTED, yes_or_no
from vrs_cli.values import questions, replies, results

if TYPE_CHECKING:
    from vrs_cli.render.console import TerminalRenderer
    from vrs_cli.repl.front_end import FrontEnd


PROGRESS_DELAY_S = 0.5  # [s] time that a program runs before its progress is shown
REFRESH = 0.1  # [s] minimum time between two updates of the progress
CLEAR_LINE = "\r\x1b[K"


class ShellTerminal:
    """A terminal that a person uses. `read` asks for a line; it raises KeyboardInterrupt for Ctrl-C and EOFError for
    Ctrl-D. `renderer`: returns the object that draws replies. `screens`: the front end of the shell."""

    attended = True

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
        self.pager = ""  # the command that shows long replies; "" if there is no pager
        self.pages = False  # whether long replies may go through the pager
        self.palette = colours.COLOURS
        self.vi = False  # whether to use vi key bindings
        self.screens: FrontEnd
        self.leaving = False
        self.whole_lines = False  # whether to write only whole lines, because a prompt may be below the output
        self._begun = ""
        # while the editor is open: calls that show messages after it
        self._later: list[Callable[[], None]] | None = None
        self.last = ""  # the latest message, for the toolbar
        self._since: float | None = None
        self._refreshed = 0.0
        self._progress_shown = False
        self.echoed = False  # whether the terminal has echoed ^C

    @property
    def stream(self) -> TextIO:
        return self._stream or sys.stdout

    def interrupt(self) -> bool:
        """Stop the awaited command (Ctrl-C). Return False if no command is awaited."""
        self.echoed = True
        return self.screens.interrupt()

    def show(self, reply: replies.Reply) -> None:
        """Show a reply. If it is longer than the screen, it may go through the pager."""
        if self._later is not None:
            self._later.append(partial(self.show, reply))
            return
        self._clear_progress()
        self.last = latest(reply) or self.last
        if isinstance(reply, replies.Farewell):
            self.leaving = True
            return
        renderer = self._renderer()
        # no pager if a prompt is below, or if several lines were pasted
        if not (self.pager and self.pages) or self.whole_lines or not isinstance(reply, LONG):
            renderer.draw(reply)
            return
        text = renderer.to_text(reply)
        if text.count("\n") < renderer.console.height or not shown_by(self.pager, text):
            renderer.console.file.write(text)
            renderer.console.file.flush()

    def type(self, text: str, newline: bool) -> None:
        if self._later is not None:
            self._later.append(partial(self.type, text, newline))
            return
        self._clear_progress()
        self._begun += plain.visible(text) + ("\n" if newline else "")
        if self.whole_lines and not self._begun.endswith("\n"):
            return
        self.stream.write(self._begun)
        self.stream.flush()
        self._begun = ""

    def ask(self, question: questions.Question) -> questions.Answer:
        """Ask the user until there is an answer. Ctrl-C means no, and stops the program that asks."""
        self._clear_progress()
        if isinstance(question, questions.LineWanted):
            if question.wrong:
                self.type(question.wrong, True)
            try:
                return self._read(question.text or "? ")
            except (KeyboardInterrupt, EOFError):
                self.interrupt()
                raise KeyboardInterrupt from None
        if isinstance(question, questions.Parting):
            return self._parts(question)
        if isinstance(question, questions.Amendment):
            return self._answer(question)
        if isinstance(question, questions.OnScreen):
            return self._on_screen(question)
        while (agreed := yes_or_no((self._answer(question) or "").partition(";")[0].strip() or "N")) is None:
            self.type(WANTED, True)
        return agreed

    def _answer(self, question: questions.Amendment | questions.Confirmation) -> str | None:
        try:
            return self._read(f"{question.text} ")
        except (KeyboardInterrupt, EOFError):
            return None

    def _parts(self, question: questions.Parting) -> bool:
        """Ask whether to leave. Return True for Y, EXIT, QUIT or Ctrl-D, and False for N, Ctrl-C or an empty line."""
        if question.about:
            self.show(results.Message(question.about, results.Tone.WARNING))
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
            self.type(WANTED, True)

    def _on_screen(self, question: questions.OnScreen) -> bool | None:
        """Show a full screen until the user leaves it; return None if this terminal cannot show it. Messages that
        arrive while the editor is open are shown after it."""
        from prompt_toolkit.utils import is_dumb_terminal

        from vrs_cli.repl.player import play, show_motion

        screens = self.screens
        if isinstance(question, questions.Playing):
            recording = screens.fetch_recording(question)
            play(recording.arm, recording.timeline, 1.0)
        elif is_dumb_terminal():
            return None
        elif isinstance(question, questions.Editing):
            from vrs_cli.repl.screen_editor import ScreenEditor

            later = self._later = list[Callable[[], None]]()
            try:
                ScreenEditor(question, screens, self.palette, vi=self.vi).run()
            finally:
                self._later = None
                for say in later:
                    say()
        elif isinstance(question, questions.Jogging):
            from vrs_cli.repl.player import JogPanel

            JogPanel(
                screens.hand(question), question.speed, screens.watched_robot(), self._abort, screens.port.world
            ).run()
        elif (watched := screens.watched_robot()) is not None:
            show_motion(watched, screens.keep_up, self._abort, screens.port.world)
        else:
            return None
        return True

    def _abort(self) -> None:
        self.screens.abort()
        self.screens.keep_up()

    # --- progress ---

    def progress(self, doing: Running | Reading) -> None:
        """Show the time of a running program, or the fraction of a file that was read, but only at intervals and after
        an initial delay."""
        now = self._clock()
        self._since = now if self._since is None else self._since
        if now - self._since < PROGRESS_DELAY_S or now - self._refreshed < REFRESH:
            return
        self._refreshed = now
        self._progress_shown = True
        if isinstance(doing, Running):
            text = f"running, t = {doing.clock:.1f} s (Ctrl-C stops it)"
        else:
            text = f"reading {doing.path}, {doing.share:.0%} (Ctrl-C stops it)"
        self.stream.write(f"{CLEAR_LINE}{blocks.shorten(text, (self._renderer().page.width or len(text)) - 1)}")
        self.stream.flush()

    def end_progress(self) -> None:
        """Remove the progress of a line, because the line has been carried out."""
        self._clear_progress()
        self._since = None

    def _clear_progress(self) -> None:
        if self._progress_shown or self.echoed:
            self.stream.write(CLEAR_LINE)
            self._progress_shown = self.echoed = False


def latest(reply: replies.Reply) -> str:
    """Return a reply in short form for the toolbar: the first line of a message, or where a program stopped."""
    if isinstance(reply, results.Message):
        return reply.text.split("\n")[0]
    if isinstance(reply, results.ProgramStopped):
        return f"{reply.what} at {reply.program}, step {reply.step}"
    return ""


OPTIONS = {"LESS": "FRX"}  # for less, as git sets it: keep colours, quit if one screen is enough, do not clear
LONG = (
    replies.HelpOverview,
    replies.HelpTopic,
    replies.HelpPage,
    replies.ProgramText,
    replies.ProgramNames,
    replies.FileText,
    replies.FileTable,
    replies.LocationTable,
    replies.RealTable,
    replies.StringTable,
    replies.SettingTable,
    replies.WhereaboutsTable,
    replies.ComparisonTable,
    replies.MeasuredComparisonTable,
    replies.TimelineTable,
    replies.Plot,
)


def pager_of(wanted: bool | str, environment: Mapping[str, str]) -> str:
    """Return the command of the pager; "" if no pager is wanted or found. `wanted`: the user's setting `pager`."""
    command = wanted if isinstance(wanted, str) else environment.get("PAGER", "less") if wanted else ""
    try:
        words = shlex.split(command)
    except ValueError:
        return ""
    return command if words and shutil.which(words[0]) is not None else ""


def shown_by(pager: str, text: str) -> bool:
    """Show a string in a pager. Return whether the pager could be started."""
    try:
        subprocess.run(shlex.split(pager), input=text, encoding="utf-8", env={**OPTIONS, **os.environ}, check=False)
    except OSError:
        return False
    return True
