"""What every check is judged by: the evidence, and beside it the rounding, the given locations and the model's run."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from math import floor
from typing import TYPE_CHECKING

from msgspec import Struct

from vrs_cli.engine.settings import Settings
from vrs_cli.files.store import may_be_called
from vrs_cli.interfaces.station.station import Station
from vrs_cli.interfaces.tasks.performing import TypedLine
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.transform import Transform, Vector, compose, position
from vrs_cli.language.run.signals import Cell
from vrs_cli.language.run.variables import Item
from vrs_cli.language.text.ast import Program
from vrs_cli.language.words.values import key_of
from vrs_cli.teach.exercise_text import FixedPlace, GivenPlace, Place
from vrs_cli.teach.tip import Piece, tip_pieces
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.diagnostics import Dialect
from vrs_cli.values.numbers import Value
from vrs_cli.values.results import CommandRecord, ProgramFault, RunOutcome, RunResult
from vrs_cli.values.world import Contact

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


NOISE_DIGITS = 6  # of a value counted in roundings: what lies behind them is noise of floats
NOISE = 5e-7  # roundings: half of the last such digit
SLACK = 1e-6  # roundings


class Rounding(Struct, frozen=True):
    """The step to which values are rounded: lengths [mm], angles [deg], times [s]."""

    mm: float = 0.1
    deg: float = 0.1
    s: float = 0.01


class Verdict(Struct, frozen=True):
    """`share`: the part of the points that is earned, from 0 to 1. `at`: the time that shows the reason [s]."""

    share: float
    reason: str
    at: float | None = None


def rounded(value: float, step: float) -> float:
    """Return the nearest multiple of a step, half a step upwards; noise of floats next to a half decides nothing."""
    count = floor(round(value / step, NOISE_DIGITS) + 0.5)
    return round(count * step, 12) + 0.0


def exceeds(value: float, most: float, step: float) -> bool:
    """Return whether a value, rounded to a step, is more than the step above what is allowed."""
    return rounded(value, step) / step > most / step + 1.0 + SLACK


def largest(most: float, step: float) -> float:
    """Return the value from which on values exceed what is allowed; `exceeds` draws the same line."""
    return (floor(most / step + 1.0 + SLACK) + 0.5 - NOISE) * step


def smallest(least: float, step: float) -> float:
    """Return the value below which values fall short of what is wanted."""
    return -largest(-least, step)


def falls_short(value: float, least: float, step: float) -> bool:
    """Return whether a value, rounded to a step, is more than the step below what is wanted."""
    return exceeds(-value, -least, step)


def written(value: float, step: float) -> str:
    """Return a rounded value with the decimals of its step: `23.4`."""
    decimals = next((count for count in range(7) if abs(step * 10**count - round(step * 10**count)) < SLACK), 7)
    return f"{rounded(value, step):.{decimals}f}"


def written_place(place: Vector, step: float) -> str:
    """Return a place given in metres as `[0.0, 550.0, -250.0]` in mm."""
    return f"[{', '.join(written(1000.0 * x, step) for x in place)}]"


HALF = 0.5  # of the points: for what is nearly right
NEAR = 5.0  # times the distance that is allowed: nearly right
MORE = 1.1  # times a limit of speed or time: nearly right
PRECISION = 0.1  # of the rounding: searches are so precise


class Basis(Struct, frozen=True):
    """`locations`: that are given, as the variant has them. `model`: the evidence of the model's run in this variant;
    None where no check compares with it.
    """

    rounding: Rounding = Rounding()
    locations: Mapping[Item, Value] = {}
    model: Evidence | None = None

    def place(self, place: Place, of_model: Transform | None = None) -> Transform:
        """Return T_world_place; `of_model`: where the model's run has it. Raises ValueError where that is not known."""
        if isinstance(place, FixedPlace):
            return place.T
        if not isinstance(place, GivenPlace):
            if of_model is None:
                raise ValueError("the model's run is not known")
            return of_model
        found: Transform | None = None
        for item in place.items:
            value = self.locations.get(item)
            if not isinstance(value, Transform):
                raise ValueError(f"{place.text} is no given location")
            found = value if found is None else compose(found, value)
        assert found is not None
        return found

    def point(self, place: Place) -> Vector:
        """Return where a place is in the world [m]."""
        return position(self.place(place))


class JudgedRun(Struct, frozen=True, dict=True):
    """A run that checks judge. What several of them need is computed once."""

    evidence: Evidence
    basis: Basis

    @property
    def mm(self) -> float:
        """Return the rounding of lengths [mm]."""
        return self.basis.rounding.mm

    @property
    def s(self) -> float:
        """Return the rounding of times [s]."""
        return self.basis.rounding.s

    @property
    def precision(self) -> float:
        """Return how precise searches for lengths are [m]."""
        return 1e-3 * PRECISION * self.mm

    def said(self, place: Vector) -> str:
        """Return a place in mm, for a reason."""
        return written_place(place, self.mm)

    @cached_property
    def tip(self) -> list[Piece]:
        """The place of the tool's tip in the course of the run."""
        return self.pieces(0)

    @cached_property
    def velocity(self) -> list[Piece]:
        """The velocity of the tip."""
        return self.pieces(1)

    @cached_property
    def acceleration(self) -> list[Piece]:
        """The acceleration of the tip."""
        return self.pieces(2)

    def pieces(self, order: int) -> list[Piece]:
        """Return the tip's place, or a derivative of it, from the beginning of the run to its end."""
        it = self.evidence
        return tip_pieces(it.arm, it.timeline, it.started, it.end, order)
