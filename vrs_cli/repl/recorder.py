"""`--save T.vrst` of the shell: every motion of a session in a file, which is written on if it is there."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from vrs_cli.errors import FileError
from vrs_cli.files.journal import Journal, keep_journal, take_up
from vrs_cli.interfaces.dialogue import Terminal
from vrs_cli.interfaces.monitor.files import TORN
from vrs_cli.interfaces.session.session import Session
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.render.progress import reading
from vrs_cli.values.numbers import count
from vrs_cli.values.replies import Message, Reply, Tone


class Recorder:
    """Takes and reads the file at once, so that a wrong one is refused before the first prompt. Raises FileError."""

    def __init__(self, path: str) -> None:
        self.path = path
        self._journal: Journal | None = None
        self._show: Callable[[Reply], None] | None = None  # where something is told
        with reading(path) as progress:
            self._taken = take_up(Path(path), progress)

    @property
    def model(self) -> RobotModel | None:
        """The robot of the file that is there."""
        return None if self._taken.recording is None else self._taken.recording.model

    def begin(self, session: Session, terminal: Terminal) -> Message:
        """Write from now on; return what to show of it. `terminal`: shows what goes wrong when the session is over.

        Raises UsageError for a file of another robot, FileError.
        """
        engine, recording = session.engine, self._taken.recording
        self._show, self._terminal = session.terminal.show, terminal
        self._journal = keep_journal(self._taken, session.engine, self._tell)
        session.journal = self._journal.path
        if recording is None:
            return Message(f"{self.path} is begun")
        commands = count(engine.book.history.commands, "command")
        torn = (TORN,) if recording.dropped_tail else ()
        wrong = "".join(f"{what}\n" for what in (*torn, *recording.warnings))
        return Message(f"{wrong}{self.path} goes on: {commands}, clock at {engine.now:.3f} s")

    def _tell(self, text: str) -> None:
        if self._show is not None:
            self._show(Message(text, Tone.ERROR))

    def close(self) -> bool:
        """The session is over: the last look at the file, which others may write then. Whether all is in the file that
        was asked for."""
        if self._journal is None:
            self._taken.close()
            return True
        self._show = self._terminal.show
        try:
            self._journal.close()
        except FileError as error:
            self._tell(str(error))
        return self._journal.sound
