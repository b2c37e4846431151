"""Define the data of checks: the evidence of a run, the rounding of measured values, and verdicts.

A value is rounded before it is compared, so that the last bits of a float never decide. It passes if it exceeds its
limit by at most one step of the rounding. Numbers here have the units of an exercise: mm, degrees, seconds.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cached_property, reduce
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
    """The recorded facts about a run that has ended or still goes on.

    `started`: when the run began [s]. `clock`: the robot's time now [s]. `typed`: lines printed with TYPE, each with
    the time at which it was complete. `course`: the history of the states of parts, sensors and rules; None if the cell
    has none of these. `contacts`: reported contacts, each with the text of its motion. `fault`: the error of the
    program. `outcome`: None while the program runs. `steps`: number of executed steps. `programs`: the parsed programs
    that can run, without those that the exercise gives. `dialect`: the dialect of these programs. `undone`: the undone
    commands, which REDO would repeat.
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
        """Return the end of the run: the latest of the clock, the end of the last motion and the last event [s]."""
        return max(self.clock, self.timeline.last)


def evidence_of(
    station: Station,
    result: RunResult | None = None,
    *,
    given: frozenset[str] = frozenset(),
    typed: tuple[TypedLine, ...] | None = None,
) -> Evidence:
    """Return the current evidence of a station.

    `result`: the result of the run; None while it runs or in a session. `given`: keys of the programs that the exercise
    gives. `typed`: all lines printed in a session with several runs; by default the lines of the last run.
    """
    engine, driver = station.engine, station.driver
    known = {key: one.program for key, one in station.environment.programs.items()}
    if result is not None and (main := known.get(key_of(station.last_program or ""))) is not None:
        known = {program.key: program for program in may_be_called([main], known)}
    return Evidence(
        arm=engine.arm,
        timeline=engine.timeline,
        commands=engine.book.records(),
        typed=driver.typed_lines if typed is None else typed,
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


NOISE_DIGITS = 6  # decimals kept of a value counted in rounding steps; later digits are floating-point noise
NOISE = 5e-7  # [rounding steps] half a unit of the last kept decimal: how far below .5 still rounds up
SLACK = 1e-6  # [rounding steps] tolerance of a comparison, against floating-point errors


class Rounding(Struct, frozen=True):
    """The rounding steps of lengths [mm], angles [deg] and times [s]."""

    mm: float = 0.1
    deg: float = 0.1
    s: float = 0.01


class Verdict(Struct, frozen=True):
    """The result of a check. `share`: the earned share of the points, from 0 to 1. `at`: the time in the run at which
    the reason can be seen [s]."""

    share: float
    reason: str
    at: float | None = None


def round_to(value: float, step: float) -> float:
    """Return the nearest multiple of a step; a half is rounded up, even if floating-point errors make it slightly
    smaller."""
    return round(floor(round(value / step, NOISE_DIGITS) + 0.5) * step, 12) + 0.0


def exceeds(value: float, most: float, step: float) -> bool:
    """Return whether a value, rounded to a step, is more than one step above the maximum."""
    return round_to(value, step) / step > most / step + 1.0 + SLACK


def largest(most: float, step: float) -> float:
    """Return the threshold for a value before rounding, above which `exceeds` is true."""
    return (floor(most / step + 1.0 + SLACK) + 0.5 - NOISE) * step


def smallest(least: float, step: float) -> float:
    """Return the threshold for a value before rounding, below which `falls_short` is true."""
    return -largest(-least, step)


def falls_short(value: float, least: float, step: float) -> bool:
    """Return whether a value, rounded to a step, is more than one step below the minimum."""
    return exceeds(-value, -least, step)


def figure(value: float, step: float) -> str:
    """Return a value as text with the decimals of a rounding step: `23.4`."""
    decimals = next((count for count in range(7) if abs(step * 10**count - round(step * 10**count)) < SLACK), 7)
    return f"{round_to(value, step):.{decimals}f}"


HALF = 0.5  # share of the points that a nearly correct result earns
NEAR = 5.0  # a result is nearly correct up to this many times the allowed distance
MORE = 1.1  # a result is nearly correct up to this multiple of a limit of speed or time
PRECISION = 0.1  # precision of searches, as a fraction of the rounding step


def share_within(value: float, most: float, step: float, nearly: float = NEAR) -> float:
    """Return the earned share for a value that should not exceed `most`: 1 up to `most`, HALF up to `nearly` times
    `most`."""
    if not exceeds(value, most, step):
        return 1.0
    return 0.0 if exceeds(value, nearly * most, step) else HALF


def compound_pose(items: Iterable[Item], values: Mapping[Item, Value]) -> Transform | None:
    """Return the pose of a compound such as `table:corner`; None if one of its parts is not a location."""
    found = [values.get(item) for item in items]
    poses = [value for value in found if isinstance(value, Transform)]
    return reduce(compose, poses) if len(poses) == len(found) else None


class Basis(Struct, frozen=True):
    """The reference values with which a run is compared. `locations`: the given locations of the variant. `model`: the
    evidence of the model solution in this variant; None if no check needs it."""

    rounding: Rounding = Rounding()
    locations: Mapping[Item, Value] = {}
    model: Evidence | None = None

    def place(self, place: Place, of_model: Transform | None = None) -> Transform:
        """Return the pose T_world_place of a place. `of_model`: the pose in the run of the model solution. Raises
        ValueError if the pose is unknown."""
        match place:
            case FixedPlace():
                return place.T
            case GivenPlace():
                found, missing = compound_pose(place.items, self.locations), f"{place.text} is no given location"
            case _:
                found, missing = of_model, "the model's run is not known"
        if found is None:
            raise ValueError(missing)
        return found

    def point(self, place: Place) -> Vector:
        """Return the position of a place in the world [m]."""
        return position(self.place(place))


class JudgedRun(Struct, frozen=True, dict=True):
    """A run to be judged by checks. Values that several checks need are computed once."""

    evidence: Evidence
    basis: Basis

    @property
    def mm(self) -> float:
        """Return the rounding step of lengths [mm]."""
        return self.basis.rounding.mm

    @property
    def s(self) -> float:
        """Return the rounding step of times [s]."""
        return self.basis.rounding.s

    @property
    def precision(self) -> float:
        """Return the precision of searches for lengths [m]."""
        return 1e-3 * PRECISION * self.mm

    def place_text(self, place: Vector) -> str:
        """Return a position given in metres as `[0.0, 550.0, -250.0]` in mm."""
        return f"[{', '.join(figure(1000.0 * x, self.mm) for x in place)}]"

    @cached_property
    def tip(self) -> list[Piece]:
        """Return the position of the tool's tip over the run."""
        return self.pieces(0)

    @cached_property
    def velocity(self) -> list[Piece]:
        """Return the velocity of the tip over the run."""
        return self.pieces(1)

    @cached_property
    def acceleration(self) -> list[Piece]:
        """Return the acceleration of the tip over the run."""
        return self.pieces(2)

    def pieces(self, order: int) -> list[Piece]:
        """Return the tip's position over the whole run, or its derivative of the given order."""
        it = self.evidence
        return tip_pieces(it.arm, it.timeline, it.started, it.end, order)
