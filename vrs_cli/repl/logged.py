"""LOG: a terminal that also writes down what is typed and answered."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from vrs_cli.errors import FileError
from vrs_cli.interfaces.dialogue import Reading, Running, Terminal
from vrs_cli.values.questions import Answer, OnScreen, Question
from vrs_cli.values.replies import Message, Reply, Tone

if TYPE_CHECKING:
    from vrs_cli.render.transcript import Transcript


class LoggedTerminal:
    """`terminal`, with a transcript while one is wanted."""

    def __init__(self, terminal: Terminal) -> None:
        self._terminal = terminal
        self._transcript: Transcript | None = None

    @property
    def attended(self) -> bool:
        return self._terminal.attended

    @property
    def path(self) -> Path | None:
        """The file that is being written."""
        return None if self._transcript is None else self._transcript.path

    def begin(self, path: Path) -> None:
        """Write from now on. Raises FileError."""
        from vrs_cli.render.transcript import Transcript

        self.end()
        try:
            self._transcript = Transcript(path, time.monotonic)
        except OSError as error:
            raise FileError(f"{path} cannot be written: {(error.strerror or str(error)).lower()}") from None

    def end(self) -> None:
        if self._transcript is not None:
            transcript, self._transcript = self._transcript, None
            try:
                transcript.close()
            except OSError as error:
                self._failed(transcript.path, error)

    def typed(self, prompt: str, text: str) -> None:
        """Lines were typed."""
        for line in text.splitlines():
            self._keep(lambda transcript, line=line: transcript.typed(prompt, line))  # type: ignore[misc]

    # --- as a terminal ---

    def show(self, reply: Reply) -> None:
        self._terminal.show(reply)
        self._keep(lambda transcript: transcript.reply(reply))

    def type(self, text: str, newline: bool) -> None:
        self._terminal.type(text, newline)
        self._keep(lambda transcript: transcript.type(text + "\n" * newline))

    def progress(self, doing: Running | Reading) -> None:
        self._terminal.progress(doing)

    def ask(self, question: Question) -> Answer:
        answer = self._terminal.ask(question)
        if not isinstance(question, OnScreen):
            said = answer if isinstance(answer, str) else "Y" if answer else "N"
            self._keep(lambda transcript: transcript.typed(f"{question.text} ", said))
        return answer

    # --- writing ---

    def _keep(self, write: Callable[[Transcript], None]) -> None:
        """Write something, where a transcript is wanted. A disk that is full ends it, and nothing else."""
        if self._transcript is None:
            return
        try:
            write(self._transcript)
        except OSError as error:
            path, self._transcript = self._transcript.path, None
            self._failed(path, error)

    def _failed(self, path: Path, error: OSError) -> None:
        what = f"{path} is not complete: {(error.strerror or str(error)).lower()}"
        self._terminal.show(Message(what, Tone.ERROR))
