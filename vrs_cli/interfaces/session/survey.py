"""A survey: what a robot has beside its timeline, for a front end that shows it several times a second. It is cheap.

Lists have their first rows and the number of the other rows. A list that the front end has already is left out: each
list has a mark, which the front end gives back.
"""

from __future__ import annotations

from itertools import islice
from typing import cast
from weakref import WeakKeyDictionary

from vrs_cli.engine.snapshot import Snapshot
from vrs_cli.interfaces.dialogue import Dialogue, beside, beside_if
from vrs_cli.interfaces.editor.lines import listed
from vrs_cli.interfaces.monitor.programs import directory
from vrs_cli.interfaces.monitor.timeline import branch_table
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.tasks.tasks import PendingInput, Track
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import Transform
from vrs_cli.language.run.memory import StoredProgram
from vrs_cli.language.text.printer import program_header
from vrs_cli.language.words.values import Kind, key_of
from vrs_cli.values.acts import BranchSeen, LocationList, ProgramList, StepList, Survey, Surveyed, TaskRow
from vrs_cli.values.replies import ListedStep, NamedLocation
from vrs_cli.wire.codec import mark_of
from vrs_cli.wire.snapshots import BranchShown, ShowBranch, snapshot_record

MOST_PLACES = 100  # of a kind
MOST_PROGRAMS = 200
MOST_STEPS = 100  # of the program that is asked for
MOST_TASKS = 8
MOST_SEGMENTS = 2000  # of a branch, the last ones


def survey(session: Session, act: Survey) -> Dialogue[Surveyed]:
    """Survey the robot in one step of it."""
    text = yield from _text(session, act)
    branches, places = session.branches, _places(session)
    rows = tuple(islice(directory(session.programs), MOST_PROGRAMS))
    programs = ProgramList(len(session.programs) - len(rows), rows=rows)
    marks = mark_of(places), mark_of(programs), "" if text is None else mark_of(text)
    engine, settings = session.engine, session.engine.settings
    frames, speed = engine.frames, settings.speed.always
    return Surveyed(
        None if marks[0] in act.known else places,
        None if marks[1] in act.known else programs,
        None if marks[2] in act.known else text,
        marks,
        tuple(map(_task, islice((track for track in session.tasks.in_order() if not track.at_prompt), MOST_TASKS))),
        tuple(BranchSeen(row, branches.book(row.name).timeline.version) for row in branch_table(session).rows),
        session.environment.signals.on,
        frames.base,
        frames.tool,
        settings.monitor_speed,
        speed.value,
        speed.unit.value,
        "" if session.lease is None else session.lease.holder,
    )


def show_branch(session: Session, act: ShowBranch) -> Dialogue[BranchShown]:
    left = session.branches.left(act.name)
    timeline, settings = left.book.timeline, left.settings

    def work() -> BranchShown:
        first = max(len(timeline) - MOST_SEGMENTS, 0)
        segments = tuple(timeline[index] for index in range(first, len(timeline)))
        return BranchShown(snapshot_record(Snapshot(timeline.version, segments, settings, first)))

    return beside(work)


def _places(session: Session) -> LocationList:
    rows: list[NamedLocation] = []
    count = 0
    for kind in (Kind.LOCATION, Kind.PRECISION):
        count += session.environment.count(kind)
        rows += (
            NamedLocation.of(name, cast("Transform | Joints", value))
            for name, value in session.environment.first_variables(kind, MOST_PLACES)
        )
    return LocationList(count - len(rows), rows=tuple(rows))


def _text(session: Session, act: Survey) -> Dialogue[StepList | None]:
    """The steps of the program that is asked for; None where it is not there."""
    yield from ()
    stored = session.programs.get(key_of(act.program))
    if stored is None:
        return None
    long = len(stored.program.steps) > MOST_STEPS
    steps = yield from beside_if(long, lambda: _steps(stored))
    first = max(act.first, 1) - 1
    rows = steps[first : first + MOST_STEPS]
    more = max(len(steps) - first, 0) - len(rows)
    return StepList(more, name=stored.name, header=program_header(stored.program), rows=rows)


_listed: WeakKeyDictionary[StoredProgram, tuple[ListedStep, ...]] = WeakKeyDictionary()


def _steps(stored: StoredProgram) -> tuple[ListedStep, ...]:
    """List a program, which does not change, once."""
    steps = _listed.get(stored)
    if steps is None:
        steps = _listed[stored] = listed(stored.analysis)
    return steps


def _task(track: Track) -> TaskRow:
    task, pending = track.task, track.pending
    asks = pending.question.text if isinstance(pending, PendingInput) else ""
    step = None if task.ended else task.step
    return TaskRow(track.number, task.program, task.state.value, step, track.running, asks)
