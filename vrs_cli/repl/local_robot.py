"""The robot of a shell in this process, and what only such a robot has: a transcript (LOG), a trajectory file
(`--save`) and a recovery file.
"""

from __future__ import annotations

from pathlib import Path

from vrs_cli.devices.outside import Outside
from vrs_cli.engine.clock import RobotClock
from vrs_cli.interfaces.dialogue import Terminal
from vrs_cli.interfaces.port.local import Console, LocalPort
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.tasks.limits import ATTENDED, OWN
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.repl.front_end import FrontEnd
from vrs_cli.repl.keeping import Keeper
from vrs_cli.repl.logged import LoggedTerminal
from vrs_cli.repl.recorder import Recorder
from vrs_cli.values.dialect import Dialect
from vrs_cli.values.replies import Message, Plot, Tone


class ShellRobot:
    """Makes a robot, and its front end at a terminal; the other arguments are those of `Local`. Raises VrsError."""

    def __init__(
        self,
        terminal: Terminal,
        model: RobotModel | None,
        file: str | None,
        recorder: Recorder | None,
        clock: RobotClock | None,
        recovery: Path | None,
        outside: Outside | None,
        dialect: Dialect | None,
        cell: str | None,
    ) -> None:
        self._file, self._terminal = file, LoggedTerminal(terminal)
        console = Console(terminal.attended)
        console.progress = terminal.progress
        limits = OWN if clock is None and not terminal.attended else ATTENDED
        session = Session(console, model, clock=clock, limits=limits, outside=outside)
        session.log, session.draw = self._terminal, _draw
        session.dialect = dialect or session.dialect
        session.user_state.lives = terminal.attended and clock is not None
        if cell is not None:
            from vrs_cli.files.cell_file import read_cell

            session.driver.surround(read_cell(cell))
        self.port = LocalPort(session, console)
        self.port.typed = self._typed
        self.front_end = FrontEnd(self._terminal, self.port, lambda text: terminal.show(Message(text, Tone.ERROR)))
        self.front_end.driven = self.port
        self.front_end.opening, self.front_end.after, self.front_end.closing = self._open, self._keep, self._close
        conversation = self.port.user.conversation
        self._keeper = None if recovery is None else Keeper(conversation, recovery, self._terminal)
        self._said = None if recorder is None else recorder.begin(session, self._terminal)

    def _open(self) -> None:
        if self._said is not None:
            self._terminal.show(self._said)
        if self._file is not None:
            conversation = self.port.user.conversation
            conversation.perform(conversation.load(self._file))
            self.front_end.keep_up()
        if self._keeper is not None:
            self._keeper.offer()

    def _typed(self, text: str) -> None:
        if self._terminal.path is not None:
            self._terminal.typed(self.port.status().prompt, text)

    def _keep(self) -> None:
        """What is in memory alone outlives the shell, wherever that can be written."""
        try:
            if self._keeper is not None:
                self._keeper.keep()
        except Exception as error:
            self.front_end.note(error)

    def _close(self) -> None:
        for track in [] if self._terminal.attended else self.port.session.tasks.running:
            text = f"task {track.number}, {track.task.program}, ends with the shell at step {track.task.step}"
            self._terminal.show(Message(text, Tone.WARNING))
        self._terminal.end()
        if self._keeper is not None:
            self._keeper.forget()


def _draw(path: Path, plot: Plot) -> None:
    """Raises UsageError where there is no matplotlib, FileError."""
    from vrs_cli.render.plots import plot_curves

    plot_curves(path, plot)
