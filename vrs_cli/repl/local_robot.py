"""Create a shell's robot in this process, with features that remote robots do not have: a transcript (LOG), a
trajectory file (`--save`) and a recovery file."""

from __future__ import annotations

import time
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from vrs_cli.devices.outside import Outside
from vrs_cli.engine.clock import RobotClock
from vrs_cli.errors import FileError
from vrs_cli.files import journal
from vrs_cli.files.recovery import Recovery, left_files
from vrs_cli.interfaces.conversation.conversation import Conversation
from vrs_cli.interfaces.dialogue import Reading, Running, Terminal
from vrs_cli.interfaces.monitor.files import TORN, load
from vrs_cli.interfaces.port import local, port
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.station.operands import name_some
from vrs_cli.interfaces.tasks.limits import ATTENDED, OWN
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.language.text import ast, parser
from vrs_cli.render.progress import reading_progress
from vrs_cli.repl.front_end import FrontEnd
from vrs_cli.values import diagnostics, numbers, questions, results
from vrs_cli.values.replies import Plot, Reply, report

if TYPE_CHECKING:
    from vrs_cli.render.documents import Transcript


ROBOT = "; robot: "  # begins the first line of a recovery file, which names its robot
# if writing the recovery file took more than SLOW [s], wait REST times that duration before the next write
SLOW, REST = 0.1, 10.0
NOUNS = {".LOCATIONS": "location", ".REALS": "real", ".DOUBLES": "real", ".STRINGS": "string"}


class ShellRobot:
    """A robot in this process, with the front end that connects it with a terminal. The arguments after `terminal` are
    the fields of `shell.Local`. Raises VrsError."""

    def __init__(
        self,
        terminal: Terminal,
        model: RobotModel | None,
        file: str | None,
        recorder: Recorder | None,
        clock: RobotClock | None,
        recovery: Path | None,
        outside: Outside | None,
        dialect: diagnostics.Dialect | None,
        cell: str | None,
    ) -> None:
        self._file, self._terminal = file, LoggedTerminal(terminal)
        console = port.Console(terminal.attended)
        console.progress = terminal.progress
        limits = OWN if clock is None and not terminal.attended else ATTENDED
        session = Session(console, model, clock=clock, limits=limits, outside=outside)
        session.log, session.draw = self._terminal.log, _draw
        session.dialect = dialect or session.dialect
        session.user_state.lives = terminal.attended and clock is not None
        if cell is not None:
            from vrs_cli.files.cell_file import read_cell

            session.driver.surround(read_cell(cell))
        self.port = local.LocalPort(session, console)
        self.port.typed = self._log_typed
        self.front_end = FrontEnd(
            self._terminal, self.port, lambda text: terminal.show(results.Message(text, results.Tone.ERROR))
        )
        self.front_end.driven = self.port
        self.front_end.opening, self.front_end.after, self.front_end.closing = self._open, self._keep, self._close
        self._recovery_writer = (
            None if recovery is None else RecoveryWriter(self.port.user.conversation, recovery, self._terminal)
        )
        self._said = None if recorder is None else recorder.begin(session, self._terminal)

    def _open(self) -> None:
        if self._said is not None:
            self._terminal.show(self._said)
        if self._file is not None:
            self.port.user.conversation.perform(load(self.port.session, Path(self._file)))
            self.front_end.keep_up()
        if self._recovery_writer is not None:
            self._recovery_writer.offer()

    def _log_typed(self, text: str) -> None:
        if self._terminal.transcript is not None:
            self._terminal.log_typed(self.port.status().prompt, text)

    def _keep(self) -> None:
        """Write unsaved programs and variables to the recovery file."""
        try:
            if self._recovery_writer is not None:
                self._recovery_writer.keep()
        except Exception as error:
            self.front_end.note(error)

    def _close(self) -> None:
        for track in [] if self._terminal.attended else self.port.session.tasks.running:
            text = f"task {track.number}, {track.task.program}, ends with the shell at step {track.task.step}"
            self._terminal.show(results.Message(text, results.Tone.WARNING))
        self._terminal.log(None)
        if self._recovery_writer is not None:
            self._recovery_writer.forget()


def _draw(path: Path, plot: Plot) -> None:
    """Write a plot to a file. Raises UsageError if matplotlib is not installed, FileError if the file cannot be
    written."""
    from vrs_cli.render.plots import plot_curves

    plot_curves(path, plot)


# --- LOG ---


class LoggedTerminal:
    """A terminal that also writes a transcript while LOG is on."""

    def __init__(self, terminal: Terminal) -> None:
        self._terminal = terminal
        self.transcript: Transcript | None = None

    @property
    def attended(self) -> bool:
        return self._terminal.attended

    def log(self, path: Path | None) -> Path | None:
        """End the current transcript, and begin a new one in the file `path` (None: none). Return the path of the
        previous file, or None. Raises FileError if the new file cannot be written."""
        from vrs_cli.render.documents import Transcript

        before, self.transcript = self.transcript, None
        if before is not None:
            try:
                before.close()
            except OSError as error:
                self._tell_failure(before.path, error)
        if path is not None:
            try:
                self.transcript = Transcript(path)
            except OSError as error:
                raise FileError(f"{path} cannot be written: {(error.strerror or str(error)).lower()}") from None
        return None if before is None else before.path

    def log_typed(self, prompt: str, text: str) -> None:
        """Add typed lines to the transcript."""
        for line in text.splitlines():
            self._keep(lambda transcript, line=line: transcript.add_typed(prompt, line))  # type: ignore[misc]

    # --- the interface of a terminal ---

    def show(self, reply: Reply) -> None:
        self._terminal.show(reply)
        self._keep(lambda transcript: transcript.reply(reply))

    def type(self, text: str, newline: bool) -> None:
        self._terminal.type(text, newline)
        self._keep(lambda transcript: transcript.type(text + "\n" * newline))

    def progress(self, doing: Running | Reading) -> None:
        self._terminal.progress(doing)

    def ask(self, question: questions.Question) -> questions.Answer:
        answer = self._terminal.ask(question)
        if not isinstance(question, questions.OnScreen):
            said = answer if isinstance(answer, str) else "Y" if answer else "N"
            self._keep(lambda transcript: transcript.add_typed(f"{question.text} ", said))
        return answer

    # --- writing the transcript ---

    def _keep(self, write: Callable[[Transcript], None]) -> None:
        """If there is a transcript, add an entry to it. A full disk ends only the transcript."""
        if self.transcript is None:
            return
        try:
            write(self.transcript)
        except OSError as error:
            path, self.transcript = self.transcript.path, None
            self._tell_failure(path, error)

    def _tell_failure(self, path: Path, error: OSError) -> None:
        what = f"{path} is not complete: {(error.strerror or str(error)).lower()}"
        self._terminal.show(results.Message(what, results.Tone.ERROR))


# --- the recovery file ---


class RecoveryWriter:
    """The writer of a shell's recovery file. After each line that changes something, it writes all unsaved programs and
    variables."""

    def __init__(
        self,
        conversation: Conversation,
        folder: Path,
        terminal: Terminal,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._conversation, self._folder, self._terminal, self._clock = conversation, folder, terminal, clock
        self._recovery = Recovery(folder)
        self._kept: object = None
        self._not_before = 0.0

    def keep(self) -> None:
        """Write all unsaved work to the file, or remove the file if nothing is unsaved. After a slow write, wait some
        time before writing again."""
        session, unfinished = self._conversation.session, self._conversation.unfinished_text
        if not (unfinished or session.unstored.programs() or session.unstored.items()):
            self.forget()
            return
        from vrs_cli.files.store import store

        begun = self._clock()
        now = (session.unstored.state(), unfinished)
        if now == self._kept or begun < self._not_before:
            return
        worked = time.process_time()
        whose = f"{ROBOT}{session.engine.arm.model.name}\n"
        self._recovery.write(whose + store(session.environment, layout=session.layout) + unfinished)
        self._kept, took = now, time.process_time() - worked
        self._not_before = begun + REST * took if took > SLOW else begun

    def forget(self) -> None:
        """Remove the recovery file, because everything is stored or the user has left."""
        self._recovery.remove()
        self._kept = None

    def offer(self) -> None:
        """Ask whether to load the recovery files that other shells have left."""
        session, terminal = self._conversation.session, self._terminal
        for one in left_files(self._folder):
            first, _, rest = one.text.partition("\n")
            robot, text = (first.removeprefix(ROBOT), rest) if first.startswith(ROBOT) else ("", one.text)
            whose = f", robot {robot}" if robot not in ("", session.engine.arm.model.name) else ""
            today = one.written.date() == datetime.now().date()
            when = f"{one.written:%H:%M}" if today else f"{one.written:%d %b %Y %H:%M}"
            parts = parser.parse_file(text)[0].parts
            programs = list(dict.fromkeys(part.name for part in parts if isinstance(part, ast.Program)))
            said = [name_some("program", programs)] if programs else []
            said += [numbers.count(len(one.entries), NOUNS[one.name]) for one in parts if isinstance(one, ast.Section)]
            contents = ", ".join(said) or "nothing"
            if not terminal.ask(questions.Confirmation(f"Recovered from {when}{whose}: {contents}. Load (Y/N)?")):
                terminal.show(results.Message(f"Not loaded; LOAD {one.decline()} brings it back"))
                continue
            terminal.show(report(session.load_text(text), text))
            terminal.show(results.Message("Loaded, and not stored yet: STORE file stores all", results.Tone.WARNING))
            self.keep()
            self._recovery.wait()
            one.remove()


# --- the trajectory file ---


class Recorder:
    """The trajectory file that `--save` names. An existing file is read at once, so that a wrong file is refused before
    the first prompt. Raises FileError."""

    def __init__(self, path: str) -> None:
        self.path = path
        self._journal: journal.Journal | None = None
        self._show: Callable[[Reply], None] | None = None  # shows a message about an error
        with reading_progress(path) as progress:
            self._taken = journal.take_up(Path(path), progress)

    @property
    def model(self) -> RobotModel | None:
        """The robot that the existing file names; None for a new file."""
        return None if self._taken.recording is None else self._taken.recording.model

    def begin(self, session: Session, terminal: Terminal) -> results.Message:
        """Start to record a session in the file, and return a message about it. `terminal`: shows errors after the
        session has ended. Raises UsageError if the file belongs to another robot, FileError if it cannot be written."""
        engine, recording = session.engine, self._taken.recording
        self._show, self._terminal = session.terminal.show, terminal
        self._journal = journal.keep_journal(self._taken, session.engine, self._tell)
        session.journal = self._journal.path
        if recording is None:
            return results.Message(f"{self.path} is begun")
        commands = numbers.count(engine.book.history.commands, "command")
        torn = (TORN,) if recording.dropped_tail else ()
        wrong = "".join(f"{what}\n" for what in (*torn, *recording.warnings))
        return results.Message(f"{wrong}{self.path} goes on: {commands}, clock at {engine.now:.3f} s")

    def _tell(self, text: str) -> None:
        if self._show is not None:
            self._show(results.Message(text, results.Tone.ERROR))

    def close(self) -> bool:
        """Close the file, so that other processes may write it. Return whether all changes are in it."""
        if self._journal is None:
            self._taken.close()
            return True
        self._show = self._terminal.show
        try:
            self._journal.close()
        except FileError as error:
            self._tell(str(error))
        return self._journal.sound
