"""The evidence of a run: all that checks may look at. It can be taken while programs still run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from msgspec import Struct

from vrs_cli.engine.settings import Settings
from vrs_cli.files.store import may_be_called
from vrs_cli.interfaces.station.station import Station
from vrs_cli.interfaces.tasks.performing import TypedLine
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.language.run.signals import Cell
from vrs_cli.language.run.variables import Item
from vrs_cli.language.text.ast import Program
from vrs_cli.language.words.values import key_of
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.contacts import Contact
from vrs_cli.values.dialect import Dialect
from vrs_cli.values.numbers import Value
from vrs_cli.values.results import CommandRecord, ProgramFault, RunOutcome, RunResult

if TYPE_CHECKING:
    from vrs_cli.world.course import WorldCourse


class Evidence(Struct, frozen=True):
    """A run, or what there is of it so far.

    `started`: when the run began [s]; `clock`: the robot's time now [s]. `typed`: lines with the times at which they
    ended. `course`: of parts, sensors and rules; None where the cell has none. `contacts`: that were told, with the
    texts of their motions. `fault`: of the program; `outcome` None while it runs. `steps`: that programs have done.
    `programs`: of the submission that may run, as trees, without those that the exercise gives. `dialect`: in which
    they are read. `undone`: the commands that are taken back, and that REDO would do again.
    """

    arm: RobotArm
    timeline: Timeline
    commands: tuple[CommandRecord, ...]
    typed: tuple[TypedLine, ...]
    cell: Cell
    course: WorldCourse | None
    contacts: tuple[tuple[str, Contact], ...]
    started: float
    clock: float
    steps: int
    fault: ProgramFault | None
    outcome: RunOutcome | None
    programs: tuple[Program, ...]
    dialect: Dialect
    variables: Mapping[Item, Value]
    settings: Settings
    undone: int

    @property
    def end(self) -> float:
        """Return when the run is over: the clock, the last motion or the last event [s]."""
        return max(self.clock, self.timeline.last)


def evidence_of(
    station: Station,
    result: RunResult | None = None,
    *,
    given: frozenset[str] = frozenset(),
    typed: tuple[TypedLine, ...] | None = None,
) -> Evidence:
    """Return the evidence that a station has now. `result`: of the run, None while it goes on or where somebody types.

    `given`: the keys of the programs that the exercise gives. `typed`: all lines of a session, where it has had several
    runs; by default those of the last run.
    """
    engine, driver = station.engine, station.driver
    known = {key: one.program for key, one in station.environment.programs.items()}
    if result is not None and (main := known.get(key_of(station.last_program or ""))) is not None:
        known = {program.key: program for program in may_be_called([main], known)}
    return Evidence(
        arm=engine.arm,
        timeline=engine.timeline,
        commands=engine.book.records(),
        typed=driver.typed if typed is None else typed,
        cell=driver.cell,
        course=driver.course,
        contacts=tuple(station.contacts.contacts),
        started=0.0 if result is None else result.started,
        clock=engine.now,
        steps=station.tasks.steps_done,
        fault=None if result is None else result.fault,
        outcome=None if result is None else result.outcome,
        programs=tuple(program for key, program in known.items() if key not in given),
        dialect=station.dialect,
        variables=station.environment.values(),
        settings=engine.settings,
        undone=len(engine.book.history.undone),
    )
