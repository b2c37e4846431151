"""`--save T.vrst` of the shell: every motion of a session in a file, which is written on if it is there."""

from __future__ import annotations

from pathlib import Path

from vrs_cli.files.atomic import check_writable
from vrs_cli.files.continuing import keep_journal
from vrs_cli.files.trajectory_file import Recording, read_trajectory
from vrs_cli.interfaces.monitor.files import TORN
from vrs_cli.interfaces.replies import Message
from vrs_cli.interfaces.session import Session
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.render.progress import reading


class Recorder:
    """Reads the file at once, so that a wrong one is refused before the first prompt. Raises FileError."""

    def __init__(self, path: str) -> None:
        check_writable(path)
        self.path = path
        self._recording: Recording | None = None
        if Path(path).exists():
            with reading(path) as progress:
                self._recording = read_trajectory(path, progress)

    @property
    def model(self) -> RobotModel | None:
        """The robot of the file that is there."""
        return None if self._recording is None else self._recording.model

    def begin(self, session: Session) -> Message:
        """Write from now on; what is said of it. Raises UsageError for a file of another robot, FileError."""
        engine = session.engine
        keep_journal(self.path, self._recording, engine)
        session.journal = Path(self.path)
        if self._recording is None:
            return Message(f"{self.path} is begun")
        commands = len(engine.history.done)
        torn = f"{TORN}\n" if self._recording.dropped_tail else ""
        return Message(
            f"{torn}{self.path} goes on: {commands} command{'s' if commands != 1 else ''}, clock at {engine.now:.3f} s"
        )
