"""The supervisor: observer and designer in one, with programs, settings, branches and ABORT."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING
from weakref import finalize

from vrs_cli.engine.clock import SLICE
from vrs_cli.engine.engine import Event
from vrs_cli.engine.feed import Subscription
from vrs_cli.engine.position import PositionArrays, fill
from vrs_cli.errors import VrsError
from vrs_cli.files.program_file import find_program_file, read_program_file
from vrs_cli.interfaces.dialogue import Answers
from vrs_cli.interfaces.roles.designer import Designer
from vrs_cli.interfaces.roles.held import Held
from vrs_cli.interfaces.roles.observer import Observer
from vrs_cli.values.acts import (
    Assign,
    Compare,
    Define,
    Evaluate,
    Execute,
    Explain,
    Go,
    Goal,
    ListBranches,
    ListCommands,
    ListMotions,
    Redo,
    Rest,
    Undo,
    Valued,
)
from vrs_cli.values.motion import Target
from vrs_cli.values.numbers import Value
from vrs_cli.values.replies import BranchTable, ComparisonTable, ReachReport, Reply, TimelineTable
from vrs_cli.values.results import CommandRecord, Position, RunResult

if TYPE_CHECKING:
    from vrs_cli.kinematics.arrays import Floats


class Supervisor(Observer, Designer):
    """Holds a robot, here or afar (`held`). Metres, radians, seconds. What the robot refuses is raised as VrsError."""

    def __init__(self, held: Held) -> None:
        Observer.__init__(self, held)
        Designer.__init__(self, self._perform)
        self.held = held
        self._sent: list[Callable[[], object]] | None = None

    def _perform(self, motion: Go, issued: float | None) -> None:
        if self._sent is None:
            self.held.act(motion, issued=issued)
        else:
            self._sent.append(self.held.start(motion, issued))

    @contextmanager
    def without_waiting(self) -> Iterator[None]:
        """Motions are sent one after the other; the end waits for all. Raises what was refused first."""
        before, sent = self._sent, list[Callable[[], object]]()
        self._sent = sent
        try:
            yield
        finally:
            self._sent = before
            refused = _waited(sent)
        if refused is not None:
            raise refused

    # --- positions ---

    def at(self, t: float | None = None) -> Position:
        t = self.now if t is None else t
        found = super().at(t)
        return self.held.past((t,))[0] if t < self.held.begins else found

    def over(self, times: Floats) -> PositionArrays:
        found = super().over(times)
        gone = times < self.held.begins
        if gone.any():
            fill(found, gone, self.held.past(times[gone].tolist()))
        return found

    # --- lines ---

    def say(self, line: str, answer: Answers) -> tuple[Reply, ...]:
        """A line of the prompt; what is answered, and typed. `answer`: to what it asks. Raises LineRefused."""
        return self.held.say(line, answer)

    # --- motions ---

    def wait(self) -> None:
        """Wait until the robot stands: in real time as long as that takes. Others may ask for something meanwhile.

        Raises ClockPaused where the clock stands.
        """
        while (rate := self.held.rate) is not None and (left := self.timeline.end - self.now) > 0.0:
            time.sleep(min(left / rate, SLICE))
        self.held.act(Rest())

    def abort(self) -> None:
        """Stop the program and the motion now, before all else that was asked for."""
        self.held.abort()

    def undo(self, count: int) -> None:
        """Take the last motion commands back. Raises UsageError where there are not so many."""
        self.held.act(Undo(count))

    def redo(self, count: int) -> None:
        """Do again what `undo` took back."""
        self.held.act(Redo(count))

    def explain(self, target: Target, name: str) -> ReachReport:
        """Why a motion to a target from here is possible or not. `name`: how the report calls it."""
        return self.held.act(Explain(Goal.of(target), name))

    # --- programs and variables ---

    def define(self, text: str, where: str = "line ") -> tuple[str, ...]:
        """Put the programs and variables of a text in memory; the names of its programs.

        Raises ProgramNotExecutable for a text with mistakes, which names the first; `where` stands before its line.
        """
        return self.held.act(Define(text, where)).names

    def load(self, path: str | Path) -> tuple[str, ...]:
        """Put the programs and variables of a file in memory; the names of its programs.

        Raises NonexistentFile, FileError, and ProgramNotExecutable for a file with mistakes.
        """
        found = find_program_file(Path(path))
        return self.define(read_program_file(found), f"{found}:")

    def execute(self, program: str, cycles: int, answer: Answers) -> RunResult:
        """Execute a program in memory; `answer`: to its PROMPTs. What goes wrong in it is in the result.

        Raises UndefinedName, ProgramNotExecutable, ArgumentMismatch.
        """
        return self.held.act(Execute(program, cycles), answer)

    def value(self, expression: str) -> Value:
        """What an expression is now. Raises LineRefused, ProgramError."""
        return self.held.act(Evaluate(expression)).value

    def assign(self, variable: str, value: Value) -> None:
        """Give a variable, or an element of an array, a value. Raises UsageError, LineRefused, TypeMismatch."""
        self.held.act(Assign(variable, Valued.of(value)))

    # --- the timeline, and other courses of events ---

    def commands(self) -> tuple[CommandRecord, ...]:
        """All motion commands that hold."""
        return self.held.act(ListCommands()).commands

    def motions(self) -> TimelineTable:
        """The timeline as a table."""
        return self.held.act(ListMotions())

    def branches(self) -> BranchTable:
        """All branches, main first."""
        return self.held.act(ListBranches())

    def compare(self, a: str, b: str) -> ComparisonTable:
        """Two branches side by side. Raises UsageError where there is none of a name."""
        return self.held.act(Compare(a, b))

    def subscribe(self) -> Subscription[Event]:
        """The timeline, and every change of it from then on; it ends with the robot."""
        subscription = self.held.subscribe()
        finalize(self, subscription.end)
        return subscription


def _waited(sent: Iterable[Callable[[], object]]) -> VrsError | None:
    """Wait for all; what was refused first."""
    refused = None
    for wait in sent:
        try:
            wait()
        except VrsError as error:
            refused = refused or error
    return refused
