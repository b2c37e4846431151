"""Pictures of the arm for SHOW, as points and lines in the world, and pictures of explanations (WHY, EXPLAIN). This
module does not depend on a terminal.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise, product
from math import cos, dist, pi, sin
from typing import TYPE_CHECKING

from vrs_cli.engine.approximation import ToolPath
from vrs_cli.engine.position import destination_at, position_at
from vrs_cli.kinematics import transform
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.bodies import outermost
from vrs_cli.kinematics.joints import Joints
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values import world as cells
from vrs_cli.values.commands import Frames
from vrs_cli.values.replies import ArmPicture, BodyKind, PicturedBody

if TYPE_CHECKING:
    from vrs_cli.world.course import World, WorldCourse
from vrs_cli.errors import VrsError
from vrs_cli.language.text.ast import DoInstruction, Instruction
from vrs_cli.language.text.parser import parse_prompt
from vrs_cli.language.text.printer import expression_text
from vrs_cli.values.acts import Sketch, SketchBall
from vrs_cli.values.replies import ReachReport
from vrs_cli.values.results import ChainReport, MotionReport, Reach

BEFORE, AFTER = 10.0, 10.0  # durations of the past and the future path that are shown [s]
LINE_ERROR_M = 0.004  # error of the lines of the path [m]: less than a dot of a wide terminal
SAME_PLACE_M = 1e-6  # distance below which two corners count as one [m]

Lines = tuple[tuple[transform.Vector, ...], ...]


class Sight:
    """Makes pictures of one arm, in a cell or alone; data that does not change from picture to picture is kept."""

    def __init__(self, arm: RobotArm, world: World | None = None) -> None:
        self.arm, self._path, self._world = arm, ToolPath(arm, LINE_ERROR_M), world

    def picture(self, timeline: Timeline, t: float, stamped: bool = False) -> ArmPicture:
        """Return the picture of the robot at time t [s], with its past and planned path, and the bodies of its cell."""
        arm, frames = self.arm, timeline.locate(t)[0].motion.frames
        at = position_at(arm, timeline, t)
        links, joints = skeleton(arm, at.joints, frames)
        target = transform.position(destination_at(arm, timeline, t).T_world_tool) if at.moving else None
        past, planned = self._way(timeline, t, transform.position(at.T_world_tool))
        world = self._world
        seen = () if world is None else bodies(world.settings.scene, world.course(timeline), t)
        return ArmPicture(at, links, joints, past, planned, target, reach(arm, frames), stamped, seen)

    def _way(self, timeline: Timeline, t: float, tip: transform.Vector) -> tuple[Lines, Lines]:
        """Return the path before a time [s] and the path after it, as lines. The present segment is split: its first
        part is the last of the past lines, its second part the first of the future lines.
        """
        past, planned = list[tuple[transform.Vector, ...]](), list[tuple[transform.Vector, ...]]()
        for line in self._path.lines(timeline, t - BEFORE, t + AFTER):
            if line.end <= t:
                past.append(line.points)
            elif line.begin >= t:
                planned.append(line.points)
            else:
                before, after = line.split_at(t, tip)
                past.append(before)
                planned.append(after)
        return tuple(past), tuple(planned)


def reach(arm: RobotArm, frames: Frames) -> tuple[transform.Vector, ...]:
    """Return the outermost positions of the tool tip in the world [m]."""
    T_world_robot = transform.inverse(frames.base)
    return tuple(transform.moved_point(T_world_robot, p) for p in outermost(arm.model, transform.position(frames.tool)))


def skeleton(
    arm: RobotArm, q: Joints, frames: Frames
) -> tuple[tuple[transform.Vector, ...], tuple[transform.Vector, ...]]:
    """Return the corners of the links from the base to the tool tip, in the world [m], and the joints among them.

    A link goes along the axis of its joint first, and then across to the next one.
    """
    T_robot = arm.frames(q)
    corners, joints = list[transform.Vector](), list[transform.Vector]()
    for T, after in pairwise(T_robot):
        joints.append(transform.position(T))
        corners += [transform.position(T), _foot(T, transform.position(after))]
    corners += [transform.position(T_robot[-1]), transform.moved_point(T_robot[-1], transform.position(frames.tool))]
    T_world_robot = transform.inverse(frames.base)
    return tuple(_distinct_points(T_world_robot, corners)), tuple(_distinct_points(T_world_robot, joints))


def _foot(T: transform.Transform, p: transform.Vector) -> transform.Vector:
    """Return the point on the z axis of a frame that is nearest to a point."""
    origin, z = transform.position(T), (T.ax, T.ay, T.az)
    return transform.along(origin, z, transform.dot(transform.vector_difference(p, origin), z))


def _distinct_points(T: transform.Transform, points: Sequence[transform.Vector]) -> Iterator[transform.Vector]:
    """Yield points in another frame, omitting a point that equals the one before."""
    before: transform.Vector | None = None
    for p in points:
        if before is None or dist(p, before) > SAME_PLACE_M:
            yield transform.moved_point(T, p)
            before = p


# --- the cell ----------------------------------------------------------------------------------------------------

CIRCLE_POINTS = 8  # number of points that represent a circle


def bodies(scene: cells.CellScene, course: WorldCourse, t: float) -> tuple[PicturedBody, ...]:
    """Return the parts, fixtures and sensors of a cell at a time [s]."""
    found = [PicturedBody(BodyKind.FIXTURE, corners(one.shape, one.T_world_fixture)) for one in scene.fixtures]
    for part in scene.parts:
        state = course.state(part.name, t)
        if state.exists:
            found.append(PicturedBody(BodyKind.HELD if state.held else BodyKind.PART, corners(part.shape, state.pose)))
    for sensor in scene.sensors:
        on = bool(course.signal(abs(sensor.signal), t)) is (sensor.signal > 0)
        found.append(PicturedBody(BodyKind.SENSOR_ON if on else BodyKind.SENSOR, _region(sensor.region)))
    return tuple(found)


def corners(shape: cells.Shape, T: transform.Transform) -> tuple[transform.Vector, ...]:
    """Return points in the world whose convex hull is the shape, or an approximation of it [m]; `T`: the pose of the
    shape.
    """
    points: list[transform.Vector]
    match shape:
        case cells.BoxShape((x, y, z)):
            points = list(product((-0.5 * x, 0.5 * x), (-0.5 * y, 0.5 * y), (-0.5 * z, 0.5 * z)))
        case cells.CylinderShape(radius, height):
            points = [(x, y, z) for x, y in _circle(radius) for z in (-0.5 * height, 0.5 * height)]
        case cells.SphereShape(radius):
            ring = list(_circle(radius))
            points = [p for x, y in ring for p in ((x, y, 0.0), (x, 0.0, y), (0.0, x, y))]
        case cells.MeshShape(pieces):
            points = [p for piece in pieces for p in piece]
    return tuple(transform.moved_point(T, p) for p in points)


def _circle(radius: float) -> Iterator[tuple[float, float]]:
    for k in range(CIRCLE_POINTS):
        yield radius * cos(2.0 * pi * k / CIRCLE_POINTS), radius * sin(2.0 * pi * k / CIRCLE_POINTS)


def _region(region: cells.Beam | cells.Zone | cells.Proximity) -> tuple[transform.Vector, ...]:
    match region:
        case cells.Beam(begin, end):
            return begin, end
        case cells.Zone(T, size):
            return corners(cells.BoxShape(size), T)
        case cells.Proximity(place, direction, far):
            return place, transform.along(place, direction, far)


MOTIONS = frozenset({"MOVE", "MOVES", "MOVET", "MOVEST", "APPRO", "APPROS"})

Drawable = ReachReport | MotionReport | ChainReport


def sketch(report: Drawable) -> Sketch | None:
    """Return the picture of a report; None if the report has no picture."""
    if isinstance(report, ReachReport):
        return _sketch_of_reach(report)
    if isinstance(report, MotionReport):
        plan = report.plan
        if plan is None or not plan.path:
            return None
        balls = [SketchBall("end", plan.path[-1], "good")]
        balls += [SketchBall("contact", plan.contact.place, "bad")] if plan.contact is not None else []
        text = f"{report.text}: {plan.begin:.3f} to {plan.end:.3f} s, {1e3 * plan.length:.0f} mm"
        return Sketch(text, plan.path[-1], tuple(pairwise(plan.path)), balls=tuple(balls))
    frames = tuple(factor.product for factor in report.factors)
    return (
        Sketch(f"{report.text}, from the world on", transform.position(frames[-1]), frames=frames) if frames else None
    )


def _sketch_of_reach(report: ReachReport) -> Sketch:
    """Draw the straight line as far as the arm can follow it, and the limit that stops the arm there."""
    reach = report.reach
    stop = stopping_place(reach)
    balls = [SketchBall("stop", stop, "good" if reach.line.duration is not None else "stop")]
    for word, contact in (("move", report.move_contact), ("line", report.line_contact)):
        if contact is not None:
            balls.append(SketchBall(f"{word}_contact", contact.place, "bad"))
    refused = ((stop, reach.end),) if stop != reach.end else ()
    return Sketch(reach_text(report), stop, ((reach.begin, stop),), refused, tuple(balls))


def stopping_place(reach: Reach) -> transform.Vector:
    """Return the position at which the tool tip stops on the straight line [m]."""
    line = reach.line
    if line.duration is not None or line.length <= 0.0:
        return reach.end if line.duration is not None else reach.begin
    way = transform.vector_difference(reach.end, reach.begin)
    return transform.along(reach.begin, way, min((line.at or 0.0) / line.length, 1.0))


def reach_text(report: ReachReport) -> str:
    """Return the name of the location, and a sentence on whether the arm can follow the straight line to it."""
    line = report.reach.line
    if line.duration is None:
        return f"{report.name}: {line.trouble}"
    contact = report.line_contact or report.move_contact
    if contact is not None:
        return f"{report.name}: {'MOVES' if report.line_contact else 'MOVE'}: {contact.describe('after')}"
    way = "MOVE and MOVES" if report.reach.chosen is not None else "MOVES"
    return f"{report.name}: {way} go there, {1e3 * line.length:.0f} mm in {line.duration:.1f} s"


def place_of(text: str) -> str | None:
    """Return the target of a typed motion as an expression; None if the text is not a motion to a location."""
    try:
        statement = parse_prompt(text)
    except VrsError:
        return None
    it = statement.statement if isinstance(statement, DoInstruction) else statement
    if not isinstance(it, Instruction) or it.word not in MOTIONS or not it.arguments:
        return None
    place, *others = it.arguments
    if place is None:
        return None
    if not (it.word.startswith("APPRO") and others):
        return expression_text(place)
    back = "0" if others[0] is None else expression_text(others[0])  # distance along the axis of the tool
    return f"{expression_text(place)}:TRANS(0, 0, -({back}))"
