"""The terminal of a batch run: TYPE goes out as it happens, PROMPT reads standard input, nobody answers questions."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, TextIO

from msgspec import Struct

from vrs_cli.errors import EndOfInput
from vrs_cli.render.control import for_stream

if TYPE_CHECKING:
    from vrs_cli.dialogue.questions import Confirmation, LineWanted
    from vrs_cli.dialogue.replies import Reply
    from vrs_cli.render.progress import RunProgress


class BatchTerminal(Struct, frozen=True):
    """Writes to `output`; `quiet` leaves out all but what programs TYPE."""

    output: TextIO
    progress: RunProgress
    quiet: bool = False

    def type(self, text: str, newline: bool) -> None:
        """TYPE output."""
        self._write(f"{text}\n" if newline else text)

    def show(self, reply: Reply) -> None:
        """An answer of the session."""
        from vrs_cli.render.text import plain_text

        if not self.quiet:
            self._write(plain_text(reply))

    def ask(self, question: LineWanted) -> str:
        """One line of standard input. Raises EndOfInput, which names the PROMPT."""
        self._write(question.text)
        line = sys.stdin.readline()
        if not sys.stdin.isatty():
            self._write("\n")  # no terminal has shown the end of the line
        if not line:
            raise EndOfInput(f"PROMPT {question.text!r} has nothing more to read", "give its answers on standard input")
        return line.rstrip("\r\n")

    def confirm(self, question: Confirmation) -> bool:  # noqa: ARG002 (of the Terminal protocol)
        """No: nobody is there to say yes."""
        return False

    def _write(self, text: str) -> None:
        self.progress.hide()
        self.output.write(for_stream(text, self.output))
        self.output.flush()
