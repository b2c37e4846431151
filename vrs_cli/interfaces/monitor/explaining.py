"""EXPLAIN, and pictures of the arm. EXPLAIN describes motions before they are made, locations, and the last change of
the timeline; it changes nothing. A separate engine (`Engine.aside`) plans the motion by the same code as a real motion,
but only the record of that engine keeps the result. The pictures, of the arm for SHOW and of explanations (WHY,
EXPLAIN), consist of points and lines in the world. This module does not depend on a terminal."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import accumulate, pairwise, product
from math import cos, dist, pi, sin
from typing import TYPE_CHECKING, cast

from msgspec.structs import replace

from vrs_cli.engine import approximation, book, explaining, position, targets
from vrs_cli.engine.engine import Engine
from vrs_cli.errors import TypeMismatch, VrsError
from vrs_cli.interfaces.dialogue import Dialogue, beside
from vrs_cli.interfaces.station.operands import evaluator
from vrs_cli.interfaces.station.station import Station
from vrs_cli.interfaces.tasks.performing import by_robot_clock
from vrs_cli.kinematics import transform
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import link_pose
from vrs_cli.language.run import effects, runtime
from vrs_cli.language.text import ast, parser, printer
from vrs_cli.language.words import monitor, values
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values import acts, commands, replies, reports, results
from vrs_cli.values import scene as scenes

if TYPE_CHECKING:
    from vrs_cli.world.course import World, WorldCourse

BEFORE, AFTER = 10.0, 10.0  # [s] a picture shows the path of the tool this long before and after its time
LINE_ERROR_M = 0.004  # [m] maximum distance of drawn lines from the path: smaller than a dot of a wide terminal
SAME_PLACE_M = 1e-6  # [m] corners nearer to each other than this are drawn as one


class Sight:
    """A maker of pictures of one arm and of its cell, if it has one. It keeps data that is the same in all pictures."""

    def __init__(self, arm: RobotArm, world: World | None = None) -> None:
        self.arm, self._path, self._world = arm, approximation.ToolPath(arm, LINE_ERROR_M), world

    def picture(self, timeline: Timeline, t: float, stamped: bool = False) -> replies.ArmPicture:
        """Return a picture of the robot at time t [s]: its arm, the past and the planned path of its tool, and the
        bodies of its cell. `stamped`: whether the user asked for a certain time."""
        arm, frames = self.arm, timeline.locate(t)[0].motion.frames
        at = position.position_at(arm, timeline, t)
        links, joints = skeleton(arm, at.joints, frames)
        target = transform.position(position.destination_at(arm, timeline, t).T_world_tool) if at.moving else None
        lines = self._path.lines(timeline, t - BEFORE, t + AFTER)
        # the current line is split at t: its first part ends the past path, its second part begins the planned path
        split = [line.split_at(t, transform.position(at.T_world_tool)) for line in lines if line.begin < t < line.end]
        past = (*(line.points for line in lines if line.end <= t), *(before for before, _ in split))
        planned = (*(after for _, after in split), *(line.points for line in lines if line.begin >= t))
        seen = () if self._world is None else bodies(self._world.settings.scene, self._world.course(timeline), t)
        return replies.ArmPicture(at, links, joints, past, planned, target, reach(arm, frames), stamped, seen)


def reach(arm: RobotArm, frames: commands.Frames) -> tuple[transform.Vector, ...]:
    """Return the outermost points that the tool tip can reach, in the world [m]."""
    from vrs_cli.kinematics.reach_outline import outermost  # imported here because it loads numpy

    T_world_robot = transform.inverse(frames.base)
    return tuple(transform.moved_point(T_world_robot, p) for p in outermost(arm.model, transform.position(frames.tool)))


def skeleton(
    arm: RobotArm, q: Joints, frames: commands.Frames
) -> tuple[tuple[transform.Vector, ...], tuple[transform.Vector, ...]]:
    """Return the corners of the drawn links from the base to the tool tip, and the positions of the joints, both in the
    world [m]. A link is drawn first along the axis of its joint, then across to the next axis."""
    T_robot = arm.frames(q)
    corners, joints = list[transform.Vector](), list[transform.Vector]()
    for T, after in pairwise(T_robot):
        origin, z = transform.position(T), (T.ax, T.ay, T.az)
        height = transform.dot(transform.vector_difference(transform.position(after), origin), z)
        joints.append(origin)
        corners += [origin, transform.along(origin, z, height)]
    corners += [transform.position(T_robot[-1]), transform.moved_point(T_robot[-1], transform.position(frames.tool))]
    T_world_robot = transform.inverse(frames.base)
    return tuple(_distinct_points(T_world_robot, corners)), tuple(_distinct_points(T_world_robot, joints))


def _distinct_points(T: transform.Transform, points: Sequence[transform.Vector]) -> Iterator[transform.Vector]:
    """Yield the points transformed by T, leaving out each point that equals the previous one."""
    before: transform.Vector | None = None
    for p in points:
        if before is None or dist(p, before) > SAME_PLACE_M:
            yield transform.moved_point(T, p)
            before = p


# --- the cell ----------------------------------------------------------------------------------------------------

CIRCLE_POINTS = 8  # a circle is drawn as a polygon with this many corners


def bodies(scene: scenes.CellScene, course: WorldCourse, t: float) -> tuple[replies.PicturedBody, ...]:
    """Return the parts, fixtures and sensors of a cell as they are at time t [s]. `course`: the states of the parts
    over time."""
    pictured, kinds = replies.PicturedBody, replies.BodyKind
    states = ((part, course.state(part.name, t)) for part in scene.parts)
    signals = ((one, bool(course.signal(abs(one.signal), t)) is (one.signal > 0)) for one in scene.sensors)
    return (
        *(pictured(kinds.FIXTURE, corners(one.shape, one.T_world_fixture)) for one in scene.fixtures),
        *(
            pictured(kinds.HELD if state.held else kinds.PART, corners(part.shape, state.pose))
            for part, state in states
            if state.exists
        ),
        *(pictured(kinds.SENSOR_ON if on else kinds.SENSOR, _region(one.region)) for one, on in signals),
    )


def corners(shape: scenes.Shape, T: transform.Transform) -> tuple[transform.Vector, ...]:
    """Return points in the world [m] whose convex hull is the shape, or approximates it. `T`: the pose of the shape."""
    points: list[transform.Vector]
    match shape:
        case scenes.BoxShape((x, y, z)):
            points = list(product((-0.5 * x, 0.5 * x), (-0.5 * y, 0.5 * y), (-0.5 * z, 0.5 * z)))
        case scenes.CylinderShape(radius, height):
            points = [(x, y, z) for x, y in _circle(radius) for z in (-0.5 * height, 0.5 * height)]
        case scenes.SphereShape(radius):
            ring = list(_circle(radius))
            points = [p for x, y in ring for p in ((x, y, 0.0), (x, 0.0, y), (0.0, x, y))]
        case scenes.MeshShape(pieces):
            points = [p for piece in pieces for p in piece]
    return tuple(transform.moved_point(T, p) for p in points)


def _circle(radius: float) -> Iterator[tuple[float, float]]:
    for k in range(CIRCLE_POINTS):
        yield radius * cos(2.0 * pi * k / CIRCLE_POINTS), radius * sin(2.0 * pi * k / CIRCLE_POINTS)


def _region(region: scenes.Beam | scenes.Zone | scenes.Proximity) -> tuple[transform.Vector, ...]:
    match region:
        case scenes.Beam(begin, end):
            return begin, end
        case scenes.Zone(T, size):
            return corners(scenes.BoxShape(size), T)
        case scenes.Proximity(place, direction, far):
            return place, transform.along(place, direction, far)


MOTIONS = frozenset({"MOVE", "MOVES", "MOVET", "MOVEST", "APPRO", "APPROS"})

Drawable = replies.ReachReport | replies.MotionReport | replies.ChainReport


def sketch(report: Drawable) -> acts.Sketch | None:
    """Return the picture of a report as lines, balls and frames; None if there is nothing to draw."""
    if isinstance(report, replies.ReachReport):
        return _sketch_of_reach(report)
    if isinstance(report, replies.MotionReport):
        if (plan := report.plan) is None or not plan.path:
            return None
        balls = [acts.SketchBall("end", plan.path[-1], "good")]
        balls += [acts.SketchBall("contact", plan.contact.place, "bad")] if plan.contact is not None else []
        text = f"{report.text}: {plan.begin:.3f} to {plan.end:.3f} s, {1e3 * plan.length:.0f} mm"
        return acts.Sketch(text, plan.path[-1], tuple(pairwise(plan.path)), balls=tuple(balls))
    frames = tuple(factor.product for factor in report.factors)
    return (
        acts.Sketch(f"{report.text}, from the world on", transform.position(frames[-1]), frames=frames)
        if frames
        else None
    )


def _sketch_of_reach(report: replies.ReachReport) -> acts.Sketch:
    """Draw the straight line to a location as far as the arm can follow it, the point where the arm must stop, and
    contacts."""
    reach = report.reach
    stop = stopping_place(reach)
    balls = [acts.SketchBall("stop", stop, "good" if reach.line.duration is not None else "stop")]
    balls += [
        acts.SketchBall(f"{word}_contact", contact.place, "bad")
        for word, contact in (("move", report.move_contact), ("line", report.line_contact))
        if contact is not None
    ]
    refused = ((stop, reach.end),) if stop != reach.end else ()
    return acts.Sketch(reach_text(report), stop, ((reach.begin, stop),), refused, tuple(balls))


def stopping_place(reach: reports.Reach) -> transform.Vector:
    """Return the point on the straight line to a location at which the tool tip must stop [m]."""
    line = reach.line
    if line.duration is not None or line.length <= 0.0:
        return reach.end if line.duration is not None else reach.begin
    way = transform.vector_difference(reach.end, reach.begin)
    return transform.along(reach.begin, way, min((line.at or 0.0) / line.length, 1.0))


def reach_text(report: replies.ReachReport) -> str:
    """Return the name of the location, and a sentence that says whether the arm can go there, and if not, why."""
    line = report.reach.line
    if line.duration is None:
        return f"{report.name}: {line.trouble}"
    if (contact := report.line_contact or report.move_contact) is not None:
        return f"{report.name}: {'MOVES' if report.line_contact else 'MOVE'}: {contact.describe('after')}"
    way = "MOVE and MOVES" if report.reach.chosen is not None else "MOVES"
    return f"{report.name}: {way} go there, {1e3 * line.length:.0f} mm in {line.duration:.1f} s"


def place_of(text: str) -> str | None:
    """Return the target of a typed motion instruction as a VAL-II expression; None if the line is not a motion to a
    location."""
    try:
        statement = parser.parse_prompt(text)
    except VrsError:
        return None
    it = statement.statement if isinstance(statement, ast.DoInstruction) else statement
    if not isinstance(it, ast.Instruction) or it.word not in MOTIONS or not it.arguments:
        return None
    place, *others = it.arguments
    if place is None:
        return None
    if not (it.word.startswith("APPRO") and others):
        return printer.expression_text(place)
    # how far in front of the location the motion ends, along the tool's axis [mm]
    back = "0" if others[0] is None else printer.expression_text(others[0])
    return f"{printer.expression_text(place)}:TRANS(0, 0, -({back}))"


# --- EXPLAIN ----------------------------------------------------------------------------------------------------------


def explain(station: Station, it: ast.ExplainCommand) -> Dialogue[None]:
    """Carry out EXPLAIN. Raises VrsError if a value is missing or is of the wrong kind."""
    asked = it.statement
    if it.topic == "SPLICE":
        yield explaining.splice(station.engine.book)
    elif asked is None:
        yield replies.ExplainOverview(
            tuple(replies.Explainable(row.form, row.summary) for row in monitor.EXPLAINED_ALL)
        )
    elif not isinstance(asked, ast.Show):
        yield (yield from _motion(station, asked))
    elif it.topic == "OAT":
        T = _pose(station, asked.expression, "OAT")
        angles, vertical = transform.to_oat(T), T.ax * T.ax + T.ay * T.ay < transform.POLE * transform.POLE
        text = printer.expression_text(asked.expression)
        yield replies.AnglesReport(text, T, angles, transform.oat_turns(*angles), vertical=vertical)
    elif it.topic == "IK":
        goal, text = (
            commands.PoseTarget(_pose(station, asked.expression, "IK")),
            printer.expression_text(asked.expression),
        )
        stand = station.engine.standpoint
        yield (yield from beside(lambda: explaining.inverse_report(stand, goal, text)))
    else:
        yield _chain(station, asked.expression)


# --- a motion --------------------------------------------------------------------------------------------------------


def _motion(station: Station, statement: ast.Statement) -> Dialogue[replies.MotionReport | results.Message]:
    engine, text = station.engine, printer.statement_text(statement)
    aside, before = engine.aside(), engine.timeline
    requests = tuple(_requests(station, aside, statement))
    notes = list[str]()
    aside.postponed.append(lambda one: notes.append(one.sentence))

    def plan_motion() -> replies.MotionPlan | None:
        for request in requests:
            aside.begin(by_robot_clock(request, station.user_state.times), program=False)
        deltas = aside.book.deltas
        return explaining.motion_plan(engine.arm, before, deltas[-1]) if len(deltas) else None

    try:
        plan = yield from beside(plan_motion)
        if plan is None:
            return results.Message(f"{text} moves nothing")
        delta = aside.book.deltas[-1]
        if engine.settings.switch("COLLISION"):
            station.contacts.check(before, delta, engine.settings)
        contact, later = station.contacts.of_change(before, delta, engine.settings)
    except VrsError as error:
        return replies.MotionReport(text, engine.now, None, str(error), station.units)
    if contact is not None:
        notes.append(f"{contact.describe()}{later}")
    plan = replace(plan, displaced=book.displacement(aside.book, before), contact=contact, notes=tuple(notes))
    return replies.MotionReport(text, engine.now, plan, units=station.units)


def _requests(station: Station, aside: Engine, statement: ast.Statement) -> Iterator[commands.Request]:
    """Yield the requests to the robot that a motion instruction makes. Raises VrsError if an argument has no value."""
    memory = station.environment
    # restored afterwards, so that the real motion will use the same random numbers
    kept = memory.random.getstate(), memory.last_error
    try:
        task = runtime.statement_task(memory, aside, statement)
        event = task.resume()
        while not isinstance(event, effects.ProgramCompleted):
            if isinstance(event, effects.Failed):
                raise event.error
            if isinstance(event, commands.Request):
                yield event
            event = task.resume()
    finally:
        memory.random.setstate(kept[0])
        memory.last_error = kept[1]


# --- locations -------------------------------------------------------------------------------------------------------


def _pose(station: Station, expression: ast.Expression, topic: str) -> transform.Transform:
    """Return the value of an expression, a transformation. `topic`: the topic of EXPLAIN, for the error message. Raises
    TypeMismatch for any other kind of value."""
    found = evaluator(station, expression)()
    if isinstance(found, transform.Transform):
        return found
    text, kind = printer.expression_text(expression), values.kind_of_value(found).value
    raise TypeMismatch(f"{text} is a {kind}", f"EXPLAIN {topic} explains a transformation, as TRANS or a compound")


def _chain(station: Station, expression: ast.Expression) -> replies.ChainReport:
    engine, text = station.engine, printer.expression_text(expression)
    found, frames = evaluator(station, expression)(), engine.frames
    if not isinstance(found, tuple):
        raise TypeMismatch(
            f"{text} is a {values.kind_of_value(found).value}", "EXPLAIN explains a location, or a motion"
        )
    if not isinstance(found, transform.Transform):
        targets.check_joint_count(engine.model, found)
        return replies.ChainReport(text, _links(engine, found), (), found, station.units)
    named = (
        (printer.expression_text(part), cast(transform.Transform, evaluator(station, part)()))
        for part in _factors(expression)
    )
    factors = _multiply("world", [(name, name, T) for name, T in named])
    goal = ("BASE", "world", frames.base), (text, "tool", found), ("TOOL^-1", "flange", transform.inverse(frames.tool))
    return replies.ChainReport(text, factors, _multiply("robot", goal), units=station.units)


def _factors(expression: ast.Expression) -> Iterator[ast.Expression]:
    """Yield the factors of a compound transformation, from left to right."""
    if isinstance(expression, ast.Binary) and expression.operator == ":":
        yield from _factors(expression.left)
        yield from _factors(expression.right)
    else:
        yield expression


def _multiply(outer: str, parts: Sequence[tuple[str, str, transform.Transform]]) -> tuple[replies.Factor, ...]:
    """Return the factors of a product of transformations, each with the product up to it. `outer`: the frame on the
    left; each of `parts` is a name, an inner frame, and the transformation to it from the previous frame."""
    frames = (outer, *(inner for _, inner, _ in parts))
    products = accumulate((T for _, _, T in parts), transform.compose)
    return tuple(
        replies.Factor(name, frame, inner, T, product)
        for frame, (name, inner, T), product in zip(frames, parts, products, strict=False)
    )


def _links(engine: Engine, q: Joints) -> tuple[replies.Factor, ...]:
    """Return the transformations from the world to the tool at the joints q: BASE, the links of the arm, and TOOL."""
    frames, model, count = engine.frames, engine.model, len(q)
    links = [(f"A{i}", f"frame {i}" if i < count else "flange", link_pose(model, i, x)) for i, x in enumerate(q, 1)]
    base = [("base of the arm", "frame 0", model.base)] if model.base != transform.IDENTITY else []
    return _multiply(
        "world", [("BASE^-1", "robot", transform.inverse(frames.base)), *base, *links, ("TOOL", "tool", frames.tool)]
    )
