"""What programs type: on the terminal as it comes, and in lines for the result of a run."""

from __future__ import annotations

from vrs_cli.engine.engine import Engine
from vrs_cli.interfaces.terminal import Console


class Transcript:
    """`lines` are those that have ended since the run began."""

    def __init__(self, engine: Engine, console: Console) -> None:
        self.lines: list[str] = []
        self._engine, self._console = engine, console
        self._line = ""

    def begin(self) -> None:
        self.lines, self._line = [], ""

    def show(self, text: str, newline: bool) -> None:
        """Nothing on the terminal where the switch MESSAGES is off."""
        if self._engine.parameters.switch("MESSAGES"):
            self._console.type(text, newline)
        *lines, self._line = (self._line + text + ("\n" if newline else "")).split("\n")
        self.lines += lines

    def end_line(self) -> None:
        """The end of a line that is not ended yet."""
        if self._line:
            self.show("", newline=True)
