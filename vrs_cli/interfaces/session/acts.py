"""Carry out acts: requests that carry exact numbers, unlike a prompt line with its rounded digits. An act is a value
that can be sent over a connection; `act_on` carries it out in a session, for users with the role that the command with
the same effect requires. One act, a survey, tells a front end several times a second the state of the robot without its
timeline."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
from itertools import islice
from secrets import token_hex
from typing import Any, NamedTuple, TypeVar, cast
from weakref import WeakKeyDictionary

from vrs_cli.engine import book, feed
from vrs_cli.errors import IllegalValue, ProgramNotExecutable, UsageError
from vrs_cli.files.trajectory_file import trajectory_lines
from vrs_cli.interfaces import recording, targets, users
from vrs_cli.interfaces.dialogue import Dialogue, beside, beside_if, in_parts
from vrs_cli.interfaces.editor.buffer import program_text
from vrs_cli.interfaces.monitor import explaining, locations
from vrs_cli.interfaces.monitor.programs import program_names
from vrs_cli.interfaces.monitor.timeline import branch_table, comparison, timeline_table
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.station.operands import PLACES
from vrs_cli.interfaces.tasks.tasks import PendingInput, Track
from vrs_cli.kinematics import joints, transform
from vrs_cli.language.run import memory, runtime
from vrs_cli.language.text import ast, parser
from vrs_cli.language.words import functions, instructions, monitor, values
from vrs_cli.language.words.word import Role
from vrs_cli.values import acts, commands, diagnostics, replies, results
from vrs_cli.wire import codec, messages, steered

T = TypeVar("T", covariant=True)

# limits of a survey: if a list is longer, the survey contains its first rows, and the number of the others
MAX_PLACES = 100  # maximum number of locations of each kind
MAX_PROGRAMS = 200
MAX_TASKS = 8

MAX_STEPS_AT_ONCE = 100  # let another thread print programs with more steps
MAX_SEGMENTS = 2000  # show only the last segments of a branch, at most this many


TARGETS = acts.FollowChunk | acts.Steer | acts.DragTool  # `TargetControl` checks who may send them


def act_on(session: Session, act: results.Act[T]) -> Dialogue[T]:
    """Carry out an act in a session. Return its result. Raises RoleWanted, LeaseHeld, UsageError for an act that must
    wait until the program stops, and other VrsErrors."""
    if isinstance(act, acts.Say):
        return cast(T, (yield from session.answers(act.line)))
    row = ACTS[type(act)]
    if not isinstance(act, TARGETS):
        session.check_may(row.said, row.role)
        session.settle()  # first let the tasks carry out all events up to now
        if session.running or session.elsewhere:
            users.check_goes_beside(row.said, row.role, elsewhere=session.elsewhere)
    return cast(T, (yield from session.on_branch(row.role, row.dialogue(session, act))))


def _go(session: Session, act: acts.Go) -> None:
    acts._finite(() if act.executed is None else (act.executed,))
    _fraction(act.speed)
    move = users.move_of(act, session.user_state.times)
    session.engine.clock.advance(session.engine.begin(move, program=False, issued=session.user_state.issued))


def _follow(session: Session, act: acts.FollowChunk) -> Dialogue[results.FollowReport]:
    _fraction(act.speed)
    return in_parts(targets.TargetControl(session).follow(act))


def _steer(session: Session, act: acts.Steer) -> None:
    acts._finite(act.joints + (act.velocity or ()) + (act.lasting,))
    _fraction(act.speed)
    targets.TargetControl(session).steer(act)


def _fraction(speed: float | None) -> float | None:
    """Return `speed`, a fraction of the nominal speed. Raises IllegalValue if it is not in (0, 1]."""
    if speed is not None and not 0.0 < speed <= 1.0:
        raise IllegalValue(f"{speed:g} of nominal speed", "more than 0, at most 1", value=speed)
    return speed


def _rest(session: Session, _act: acts.Rest) -> None:
    clock = session.engine.clock
    if clock.paused or not clock.realtime:
        session.engine.perform(commands.Break())


def _through_history(work: book.Parts[tuple[str, ...]]) -> Dialogue[None]:
    """Carry out the steps of UNDO or REDO one by one, so that the actor can do other work in between."""
    yield from in_parts(work)


def _explain(session: Session, act: acts.Explain) -> Dialogue[replies.ReachReport]:
    target = act.goal.target
    if not isinstance(target, commands.PoseTarget | commands.JointTarget):
        raise UsageError("WHY of no place", "WHY explains a location")
    return locations.explain_reach(session, target, act.name)


def _why_refused(session: Session, act: acts.WhyRefused) -> Dialogue[acts.Sketch | None]:
    if (name := explaining.place_of(act.text)) is None:
        return None
    value = runtime.evaluate(session.environment, session.engine, _expression(session, name))
    if not isinstance(value, tuple):
        return None
    target = commands.PoseTarget(value) if isinstance(value, transform.Transform) else commands.JointTarget(value)
    return explaining.sketch((yield from locations.explain_reach(session, target, name)))


def _boundary(session: Session, _act: acts.Boundary) -> Dialogue[acts.BoundaryCurves]:
    """Return the curves that outline the reach of the tool tip in the current configuration. Raises IllegalValue for an
    arm whose first joint is prismatic."""
    arm, engine = session.engine.arm, session.engine
    if arm.model.units.slides(1):
        raise IllegalValue("the boundary of an arm whose first joint slides", "an arm that turns about its first axis")
    configuration, tip = arm.configuration(engine.position().joints), transform.position(engine.frames.tool)

    def curves() -> acts.BoundaryCurves:
        from vrs_cli.kinematics.reach_outline import lines_of, outline

        lines = tuple(lines_of(outline(arm, configuration, tip)))
        return acts.BoundaryCurves(lines, (arm.model.lower[0], arm.model.upper[0]))

    return beside(curves)


def _assign(session: Session, act: acts.Assign) -> None:
    target = _expression(session, act.variable)
    if not isinstance(target, ast.Variable) or target.grouped:
        raise UsageError(f"{act.variable} is no variable", "a name, or row[3]")
    (reference,) = runtime.arguments_of(session.environment, session.engine, (target,))
    assert reference is not None
    reference.assign(act.value.value)


def _expression(session: Session, text: str) -> ast.Expression:
    """Parse an expression. Raises LineRefused, and UsageError if the string is a command or contains more than one
    expression."""
    if (
        text.split()[:1]
        and text.split()[0].upper()
        in (monitor.COMMANDS.keys() | instructions.INSTRUCTIONS.keys()) - functions.FUNCTIONS.keys()
    ):
        raise UsageError(
            f"{text} is no expression", "one variable or one expression", in_python=f"do({text!r}) does it"
        )
    line = parser.parse_prompt(f"TYPE {text}", session.names())
    typed = line.statement if isinstance(line, ast.DoInstruction) else None
    arguments = typed.arguments if isinstance(typed, ast.Instruction) else ()
    if len(arguments) != 1 or arguments[0] is None:
        raise UsageError(f"{text} is no expression", "one variable or one expression")
    return arguments[0]


def _define(session: Session, act: acts.Define) -> Dialogue[acts.Defined]:
    loaded = yield from session.read_file(act.text)
    before = dict(session.programs)
    session.take(loaded)
    if wrong := [one for one in loaded.diagnostics if one.severity is diagnostics.Severity.ERROR]:
        more = f", and {len(wrong) - 1} more mistakes" if len(wrong) > 1 else ""
        raise ProgramNotExecutable(f"{act.where}{wrong[0].span.line}: {wrong[0].message}{more}")
    return acts.Defined(tuple(stored.name for key, stored in session.programs.items() if before.get(key) is not stored))


def _execute(session: Session, act: acts.Execute) -> Dialogue[results.RunResult]:
    yield from session.compile_program(act.program)
    return (yield from session.wait(session.begin(act.program, cycles=act.cycles)))


def _record(session: Session, _act: acts.Record) -> Dialogue[acts.Recorded]:
    engine = session.engine
    course = engine.model, engine.book.initial, engine.book.deltas.copy(), engine.measured.view
    return acts.Recorded((yield from beside(lambda: b"".join(trajectory_lines(*course)))))


def _record_program(session: Session, act: acts.RecordProgram) -> Dialogue[acts.Defined]:
    begin, end = acts._finite((act.begin, act.end))
    arm, timeline = session.engine.arm, session.engine.timeline
    text = yield from beside(
        lambda: recording.recorded_program(arm, timeline, begin, end, act.name, recording.RECORDED)
    )
    return (yield from _define(session, acts.Define(text)))


def _look_at_program(session: Session, act: acts.LookAtProgram) -> Dialogue[acts.ProgramSource]:
    program = session.environment.program(act.program).program
    text = yield from beside_if(len(program.steps) > MAX_STEPS_AT_ONCE, lambda: program_text(program))
    return acts.ProgramSource(program.name, text)


def _list_commands(session: Session, _act: acts.ListCommands) -> Dialogue[acts.CommandList]:
    return acts.CommandList((yield from beside(session.engine.book.all_records())))


# --- a survey -------------------------------------------------------------------------------------------------------


def survey(session: Session, act: acts.Survey) -> acts.Surveyed:
    """Return the state of the robot without its timeline, for a front end. A list that the front end already has is
    left out: each list has a mark (a short string that identifies its contents), and the front end sends the marks of
    the lists that it has."""
    branches, places = session.branches, _places(session)
    rows = tuple(islice(program_names(session.programs), MAX_PROGRAMS))
    programs = acts.ProgramList(len(session.programs) - len(rows), rows=rows)
    # a stored program never changes, so a random mark identifies this version
    stored = session.programs.get(values.key_of(act.program))
    mark = "" if stored is None else _marks.setdefault(stored, token_hex(4))
    # the names make the marks of two empty lists different
    marks = (codec.mark_of(("places", places)), codec.mark_of(("programs", programs)), mark)
    engine, settings = session.engine, session.engine.settings
    frames, speed = engine.frames, settings.speed.always
    return acts.Surveyed(
        None if marks[0] in act.known else places,
        None if marks[1] in act.known else programs,
        marks,
        tuple(map(_task, islice((track for track in session.tasks.in_order() if not track.at_prompt), MAX_TASKS))),
        tuple(acts.BranchSeen(row, branches.book(row.name).timeline.version) for row in branch_table(session).rows),
        session.environment.signals.on,
        frames.base,
        frames.tool,
        settings.monitor_speed,
        speed.value,
        speed.unit.value,
        "" if session.lease is None else session.lease.holder,
        session.warned_untrue[: acts.MAX_UNTRUE],
        tuple(sorted(step for key, step in session.tasks.breakpoints if key == values.key_of(act.program))),
    )


def show_branch(session: Session, act: messages.ShowBranch) -> Dialogue[messages.BranchShown]:
    left = session.branches.bookmark_of(act.name)
    timeline, settings = left.book.timeline, left.settings
    pieces = steered.LinePieces(session.engine.arm).within(act.joints)
    first, end = max(len(timeline) - MAX_SEGMENTS, 0), len(timeline)
    return beside(
        lambda: messages.BranchShown(
            messages.snapshot_record(feed.Snapshot.part(timeline, settings, first, end), pieces)
        )
    )


def _places(session: Session) -> acts.LocationList:
    rows = tuple(
        replies.NamedLocation.of(name, cast(joints.Joints | transform.Transform, value))
        for kind in PLACES
        for name, value in session.environment.first_variables(kind, MAX_PLACES)
    )
    return acts.LocationList(sum(map(session.environment.count, PLACES)) - len(rows), rows=rows)


_marks: WeakKeyDictionary[memory.StoredProgram, str] = WeakKeyDictionary()


def _task(track: Track) -> acts.TaskRow:
    task, pending = track.task, track.pending
    asks = pending.question.text if isinstance(pending, PendingInput) else ""
    return acts.TaskRow(
        track.number, task.program, task.state.value, None if task.is_over else task.step, track.running, asks
    )


# --- all acts -------------------------------------------------------------------------------------------------------


class _Row(NamedTuple):
    """A row of the table of acts. `said`: the name of the act in messages; `role`: the role that it needs; `do`:
    returns the result of the act, or a dialogue that returns it."""

    said: str
    role: Role
    do: Callable[[Session, Any], object]

    def dialogue(self, session: Session, act: results.Act[Any]) -> Dialogue[object]:
        found = self.do(session, act)
        return (yield from found) if isinstance(found, Generator) else found


def _as(word: str, do: Callable[[Session, Any], object]) -> _Row:
    """Return the row of an act that has the same effect as the command or instruction `word`."""
    return _Row(word, users.role_of(word), do)


ACTS: Mapping[type[results.Act[Any]], _Row] = {
    acts.Go: _as("MOVE", _go),
    acts.FollowChunk: _as("MOVE", _follow),
    acts.Steer: _as("MOVE", _steer),
    acts.DragTool: _as("MOVE", lambda session, act: targets.TargetControl(session).drag(act.pose)),
    acts.ResyncBody: _as("RESYNC", lambda session, act: session.resync(stops=act.stops)),
    acts.Rest: _as("BREAK", _rest),
    acts.Undo: _as("UNDO", lambda session, act: _through_history(session.engine.undo_in_parts(act.count))),
    acts.Redo: _as("REDO", lambda session, act: _through_history(session.engine.redo_in_parts(act.count))),
    acts.Explain: _as("WHY", _explain),
    acts.WhyRefused: _as("WHY", _why_refused),
    acts.Boundary: _Row("the reach", Role.OBSERVER, _boundary),
    acts.Compare: _as("COMPARE", lambda session, act: comparison(session, act.a, act.b)),
    acts.Evaluate: _Row(
        "a look at a value",
        Role.OBSERVER,
        lambda session, act: acts.Valued.of(
            runtime.evaluate(session.environment, session.engine, _expression(session, act.expression))
        ),
    ),
    acts.Assign: _Row(users.CHANGE, Role.SUPERVISOR, _assign),
    acts.Define: _as("LOAD", _define),
    acts.Execute: _as("EXECUTE", _execute),
    acts.ListCommands: _as("TIMELINE", _list_commands),
    acts.ListBranches: _Row("a look at the branches", Role.OBSERVER, lambda session, _act: branch_table(session)),
    acts.ListMotions: _as("TIMELINE", lambda session, _act: timeline_table(session)),
    acts.LookAtParts: _as("PARTS", lambda session, act: locations.part_table(session, act.time)),
    acts.LookAtProgram: _Row("a look at a program", Role.OBSERVER, _look_at_program),
    acts.RecordProgram: _as("LOAD", _record_program),
    acts.Record: _Row("a look at the trajectory", Role.OBSERVER, _record),
    acts.Survey: _Row("a survey", Role.OBSERVER, survey),
    messages.ShowBranch: _Row("a look at a branch", Role.OBSERVER, show_branch),
}
