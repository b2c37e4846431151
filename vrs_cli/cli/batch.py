"""The terminal of a batch run: TYPE goes out as it happens, PROMPT reads standard input, nobody answers
other questions."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, TextIO

from msgspec import Struct

from vrs_cli.dialogue.questions import LineWanted
from vrs_cli.dialogue.talk import Running
from vrs_cli.errors import EndOfInput
from vrs_cli.render.control import for_stream

if TYPE_CHECKING:
    from vrs_cli.dialogue.questions import Answer, Question
    from vrs_cli.dialogue.replies import Reply
    from vrs_cli.dialogue.talk import Reading
    from vrs_cli.render.progress import RunProgress


class BatchTerminal(Struct, frozen=True):
    """Writes to `output`; `quiet` leaves out all but what programs TYPE."""

    output: TextIO
    alive: RunProgress
    quiet: bool = False
    attended: bool = False

    def progress(self, doing: Running | Reading) -> None:
        """The line on standard error."""
        if isinstance(doing, Running):
            self.alive(doing.clock)

    def type(self, text: str, newline: bool) -> None:
        """TYPE output."""
        self._write(f"{text}\n" if newline else text)

    def show(self, reply: Reply) -> None:
        """An answer of the session."""
        from vrs_cli.render.text import plain_text

        if not self.quiet:
            self._write(plain_text(reply))

    def ask(self, question: Question) -> Answer:
        """One line of standard input; no other question is answered. Raises EndOfInput, which names the PROMPT."""
        if not isinstance(question, LineWanted) or (question.wrong and not sys.stdin.isatty()):
            return None
        self._write(f"{question.wrong}\n" if question.wrong else "")
        self._write(question.text)
        line = sys.stdin.readline()
        if not sys.stdin.isatty():
            self._write("\n")  # no terminal has shown the end of the line
        if not line:
            raise EndOfInput(f"PROMPT {question.text!r} has nothing more to read", "give its answers on standard input")
        return line.rstrip("\r\n")

    def _write(self, text: str) -> None:
        self.alive.hide()
        self.output.write(for_stream(text, self.output))
        self.output.flush()
