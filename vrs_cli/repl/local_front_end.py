"""A seat at a robot of this process."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import cast

from vrs_cli.devices.outside import Outside
from vrs_cli.engine.clock import RobotClock, WallClock
from vrs_cli.engine.position import Watched
from vrs_cli.files.trajectory_file import Recording
from vrs_cli.interfaces.actor.ticket import Ticket
from vrs_cli.interfaces.conversation.conversation import Conversation
from vrs_cli.interfaces.conversation.internal_error import internal_error
from vrs_cli.interfaces.dialogue import Dialogue, Terminal
from vrs_cli.interfaces.editor.screen import EditedProgram, ScreenDraft
from vrs_cli.interfaces.jog.jogger import JogArm, Jogger
from vrs_cli.interfaces.monitor.running import emergency_stop
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.tasks.limits import ATTENDED, OWN
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.repl.front_end import KEEPING_UP, RESTING, SHORTEST, Driven
from vrs_cli.repl.keeping import Keeper
from vrs_cli.repl.logged import LoggedTerminal
from vrs_cli.repl.recorder import Recorder
from vrs_cli.values.dialect import Dialect
from vrs_cli.values.questions import Editing, Jogging, Playing, Question
from vrs_cli.values.replies import Message, Plot, Reply, Tone


class LocalFrontEnd:
    """A session, what is typed in it, and the file that keeps what is in memory alone (in the folder `recovery`)."""

    def __init__(
        self,
        terminal: Terminal,
        model: RobotModel | None = None,
        file: str | None = None,
        recorder: Recorder | None = None,
        clock: RobotClock | None = None,
        recovery: Path | None = None,
        outside: Outside | None = None,
        dialect: Dialect | None = None,
        cell: str | None = None,
    ) -> None:
        self._log = LoggedTerminal(terminal)
        limits = OWN if clock is None and not terminal.attended else ATTENDED
        self.session = Session(self._log, model, clock=clock, limits=limits, outside=outside)
        self.session.log = self._log
        self.session.dialect = dialect or self.session.dialect
        if cell is not None:
            from vrs_cli.files.cell_file import read_cell

            self.session.driver.surround(read_cell(cell))
        self.session.draw = _draw
        self.session.user_state.lives = terminal.attended and clock is not None
        self.conversation = dialogue = Conversation(self.session)
        self.status, self.suggestions = dialogue.status, dialogue.suggestions
        self.signature = dialogue.signature
        self.interrupt = self.session.interrupt
        self._stops: deque[Ticket[None]] = deque()  # that were asked for by a key
        self.noted, self.failed = "", False
        self._file = file
        self._keeper = None if recovery is None else Keeper(self.conversation, recovery)
        self._recorded = None if recorder is None else recorder.begin(self.session)

    @property
    def interrupted(self) -> bool:
        return self.session.user_state.interrupted

    def begin(self) -> None:
        if self._recorded is not None:
            self.session.terminal.show(self._recorded)
        if self._file is not None:
            self.conversation.perform(self.conversation.load(self._file))
        if self._keeper is not None:
            self._keeper.offer()

    def take(self, text: str) -> None:
        if self._log.path is not None:
            self._log.typed(self.status().prompt, text)
        self._do(self.conversation.lines(text))

    def answer(self) -> None:
        self._do(self.conversation.answer())

    def was_cut(self) -> bool:
        return False

    def drop(self, what: str) -> None:
        """Nothing is lost on the way to a robot of this process."""

    def leave_entry(self, why: str = "") -> None:
        self._do(self.conversation.leave_entry(why))

    def leave(self) -> None:
        self._do(self.conversation.leave())

    def stop_program(self) -> None:
        self._do(self.conversation.stop_program())

    def abort(self) -> None:
        dialogue = emergency_stop(self.session)
        self._stops.append(self.session.actor.submit(dialogue, urgent=True, outlet=self._stopped))

    def _stopped(self, _ticket: Ticket[None], said: Reply | Question | None) -> None:
        if isinstance(said, Reply):
            self.session.terminal.show(said)

    def _do(self, dialogue: Dialogue[None]) -> None:
        self.noted = ""
        self.conversation.perform(dialogue)
        self._keep()

    def end(self) -> None:
        for track in [] if self.session.terminal.attended else self.session.tasks.running:
            text = f"task {track.number}, {track.task.program}, ends with the shell at step {track.task.step}"
            self.session.terminal.show(Message(text, Tone.WARNING))
        self._log.end()
        if self._keeper is not None:
            self._keeper.forget()

    def note(self, error: Exception) -> None:
        self.noted = internal_error(error).text

    @property
    def driven(self) -> Driven:
        return self

    def step(self) -> None:
        try:
            self.session.actor.step()
        except Exception as error:  # of a task that nobody waits for, which has ended with it
            self.session.terminal.show(internal_error(error))

    def wake(self) -> None:
        self.session.actor.wake()

    @property
    def withdrawn(self) -> bool:
        return self.session.driver.withdrawn

    def rest(self) -> float:
        """Until a task goes on, or the arm is elsewhere."""
        engine = self.session.engine
        clock, seen = engine.clock, RESTING if engine.now >= engine.end else KEEPING_UP
        due = clock.until(self.session.driver.peek()) if isinstance(clock, WallClock) else seen
        return min(max(due, SHORTEST), seen)

    def woken_by(self, wake: Callable[[], object]) -> None:
        """What happens here happens by the clock."""

    def keep_up(self) -> None:
        try:
            while self._stops:
                self.session.actor.finish(self._stops.popleft(), self.session.terminal)
            self.session.settle()
        except Exception as error:
            self.note(error)

    def page(self, question: Editing) -> EditedProgram:  # noqa: ARG002 (the program is at the desk)
        draft = cast(ScreenDraft, self.session.user_state.on_screen)
        draft.noted = self._keep
        return draft

    def hand(self, question: Jogging) -> JogArm:  # noqa: ARG002 (the arm is here)
        return cast(Jogger, self.session.user_state.on_screen)

    def recording(self, question: Playing) -> Recording:  # noqa: ARG002 (it has been read)
        return cast(Recording, self.session.user_state.on_screen)

    def watched(self) -> Watched:
        return self.session.engine

    def _keep(self) -> None:
        """What is in memory alone outlives the shell, wherever that can be written."""
        try:
            if self._keeper is not None:
                self._keeper.keep()
        except Exception as error:
            self.note(error)


def _draw(path: Path, plot: Plot) -> None:
    """Raises UsageError where there is no matplotlib, FileError."""
    from vrs_cli.render.plots import plot_curves

    plot_curves(path, plot)
