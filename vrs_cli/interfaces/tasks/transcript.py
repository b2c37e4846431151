"""What programs type: on the terminal as it comes, and in lines for the result of a run."""

from __future__ import annotations

from vrs_cli.dialogue.talk import Terminal
from vrs_cli.engine.engine import Engine
from vrs_cli.interfaces.tasks.limits import Limits, Spent


class Transcript:
    """`lines` are those that have ended since the run began."""

    def __init__(self, engine: Engine, terminal: Terminal) -> None:
        self.lines: list[str] = []
        self._engine, self._terminal = engine, terminal
        self._line = ""
        self._spent = Spent("max_output", "type")

    def begin(self, limits: Limits) -> None:
        self.lines, self._line = [], ""
        self._spent.begin(limits)

    def count(self, text: str, newline: bool = False) -> None:
        """Text is about to be typed. Raises LimitReached."""
        self._spent.add(len(text.encode("utf-8", "replace")) + newline)

    def show(self, text: str, newline: bool) -> None:
        """Nothing on the terminal where the switch MESSAGES is off. Raises LimitReached."""
        self.count(text, newline)
        self._put(text, newline)

    def _put(self, text: str, newline: bool) -> None:
        if self._engine.settings.switch("MESSAGES"):
            self._terminal.type(text, newline)
        *lines, self._line = (self._line + text + ("\n" if newline else "")).split("\n")
        self.lines += lines

    def end_line(self) -> None:
        """The end of a line that is not ended yet."""
        if self._line:
            self._put("", newline=True)
