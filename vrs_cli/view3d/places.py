"""Places in a scene: the named locations of a robot, small frames with their names; and WHY as a picture, the straight
line to a place as far as the arm can follow it, and what stops it there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from textwrap import fill

import numpy as np
from viser import SceneApi

from vrs_cli.engine.position import world_pose
from vrs_cli.interfaces.session.sketches import Drawable, place_of, sketch
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import RobotModel, levers
from vrs_cli.kinematics.transform import Transform, Vector, along, position, subtracted, unit_quaternion
from vrs_cli.net.messages import At, Done, ServerMessage
from vrs_cli.net.socket_port import SocketPort
from vrs_cli.values.acts import Evaluate, Explain, Goal, Valued
from vrs_cli.values.motion import Frames, JointTarget, PoseTarget
from vrs_cli.values.replies import NamedLocation, ReachReport
from vrs_cli.view3d.parts import Rooted, Shown, gathered
from vrs_cli.view3d.paths import THICK

LONG = 0.055  # of the reach: the axes
NEAR = 0.01  # of the reach: names of places so near to each other stand in one label


class PlacesView(Rooted):
    """Nodes /places ...; a precision point is where its joints bring the tool."""

    def __init__(self, scene: SceneApi, model: RobotModel) -> None:
        self._scene = scene
        _, (self._reach, *_) = levers(model)
        self._root = scene.add_frame("/places", show_axes=False)
        self._drawn: tuple[tuple[str, Transform], ...] = ()

    def show(self, shown: Shown) -> None:
        found = shown.surveyed
        if found is None or found.places is None:
            return
        frames = Frames(found.base, found.tool)
        places = tuple((row.name, T) for row in found.places.rows if (T := _pose(shown.arm, row, frames)) is not None)
        if places != self._drawn:
            self._drawn = places
            self._draw()

    def _draw(self) -> None:
        visible = self.visible
        self._root.remove()
        self._root = self._scene.add_frame("/places", show_axes=False, visible=visible)
        if not self._drawn:
            return
        poses = [T for _, T in self._drawn]
        add_frames(self._scene, "/places/frames", poses, LONG * self._reach)
        named = gathered(((position(T), name) for name, T in self._drawn), NEAR * self._reach)
        for k, (place, names) in enumerate(named.items()):
            self._scene.add_label(f"/places/{k}", "\n".join(names), position=place, anchor="top-left")


def add_frames(scene: SceneApi, name: str, poses: Sequence[Transform], long: float) -> None:
    """Add frames at poses in the world, with axes so long [m]."""
    turns, places = np.array([unit_quaternion(T) for T in poses]), np.array([position(T) for T in poses])
    scene.add_batched_axes(name, turns, places, axes_length=long, axes_radius=0.03 * long)


def _pose(arm: RobotArm, row: NamedLocation, frames: Frames) -> Transform | None:
    """The pose in the world; None for joints of another robot, and for what is not defined."""
    if row.pose is not None:
        return row.pose
    if row.joints is None or len(row.joints) != arm.model.joint_count:
        return None
    joints: Joints = row.joints
    return world_pose(arm, frames, joints)


# --- why a place cannot be reached -----------------------------------------------------------------------------------


GOOD, BAD, STOP = (52, 150, 82), (214, 48, 49), (140, 20, 20)
BALL = 0.02  # of the reach
DASH = 0.02  # of the reach: a dash of what cannot be, and the gap behind it
WIDTH, LINES = 44, 8  # characters of a line of the label; how many of them at most
MOODS = {"good": GOOD, "bad": BAD, "stop": STOP}


class Reasons:
    """Nodes /why ...: of the explanation that came last, until the robot does something else."""

    def __init__(self, scene: SceneApi, model: RobotModel) -> None:
        self._scene = scene
        _, (self._reach, *_) = levers(model)
        self._root = scene.add_frame("/why", show_axes=False)
        self.report: Drawable | None = None
        self._drawn: Drawable | None = None
        self._since = -1  # the version of the timeline for which it was asked

    def explain(self, report: Drawable) -> None:
        """Show it from now on."""
        self.report = report

    def show(self, shown: Shown) -> None:
        if self.report is not self._drawn:
            self._drawn, self._since = self.report, shown.timeline.version
            self._draw()
        elif self._drawn is not None and shown.timeline.version != self._since:
            self.report = self._drawn = None
            self._draw()

    def _draw(self) -> None:
        self._root.remove()
        self._root = self._scene.add_frame("/why", show_axes=False)
        drawn = None if self._drawn is None else sketch(self._drawn)
        if drawn is None:
            return
        self._line("followed", drawn.followed, GOOD)
        self._line("refused", [one for line in drawn.refused for one in dashes(*line, DASH * self._reach)], BAD)
        for name, place, mood in drawn.balls:
            self._scene.add_icosphere(f"/why/{name}", BALL * self._reach, MOODS[mood], subdivisions=2, position=place)
        if drawn.frames:
            add_frames(self._scene, "/why/frames", drawn.frames, LONG * self._reach)
        text = fill(drawn.text, WIDTH, max_lines=LINES, placeholder=" ...")
        self._scene.add_label("/why/reason", text, position=drawn.at, anchor="bottom-left")

    def _line(self, name: str, parts: Sequence[tuple[Vector, Vector]], colour: tuple[int, int, int]) -> None:
        points = np.array(parts, dtype=np.float32).reshape(-1, 2, 3)
        if len(points):
            self._scene.add_line_segments(f"/why/{name}", points, colour, thickness=THICK * self._reach)


def dashes(a: Vector, b: Vector, long: float) -> list[tuple[Vector, Vector]]:
    """The dashes of a line, with gaps as long as they are."""
    way = subtracted(b, a)
    count = round(float(np.linalg.norm(way)) / long)
    marks = [along(a, way, k / count) for k in range(count + 1)] if count else []
    return list(zip(marks[1::2], marks[2::2], strict=False))


def explain_refusal(robot: SocketPort, told: Callable[[ReachReport], None], text: str) -> None:
    """Ask the robot why a typed motion was refused; `told` gets the report. Only motions to a place have a picture."""
    name = place_of(text)

    def evaluated(message: ServerMessage) -> None:
        found = message.found if isinstance(message, Done) else None
        value = found.location or found.joints if isinstance(found, Valued) else None
        if value is not None and name is not None:
            goal = Goal.of(PoseTarget(value) if isinstance(value, Transform) else JointTarget(value))
            robot.post(lambda id: At(id, Explain(goal, name)), explained)

    def explained(message: ServerMessage) -> None:
        if isinstance(message, Done) and isinstance(message.found, ReachReport):
            told(message.found)

    if name is not None:
        robot.post(lambda id: At(id, Evaluate(name)), evaluated)
