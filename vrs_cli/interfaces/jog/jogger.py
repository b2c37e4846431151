"""JOG: move the arm step by step, along or about one axis at a time. This module does not depend on keys or a screen.

In real time a step begins at once, interrupts the current motion, and replaces the scheduled motions. The call returns
while the arm moves. If the same key is pressed again before the arm has finished its step, the press is ignored, so
that the arm stops soon after the key is released; any other key takes effect at once. In virtual time a step is a
motion after all scheduled motions, and the call returns when the step has ended.

Steps of the tool are straight lines. If the arm cannot follow the line because a singularity is near, the step is
refused and the arm does not move.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import ceil, copysign, radians

from vrs_cli import errors
from vrs_cli.engine.engine import Engine
from vrs_cli.interfaces import dialogue, users
from vrs_cli.interfaces.station.operands import handles, real
from vrs_cli.interfaces.station.station import Station
from vrs_cli.kinematics import joints, transform
from vrs_cli.language.text.ast import Instruction, Variable
from vrs_cli.language.words.values import plain
from vrs_cli.values import commands, hand, questions, results

# [s] the next step of a held key may begin this long before the current step ends, so that the arm does not stop
NEXT_STEP_LEAD_S = 0.3
# [rad, m] refuse a step of the tool that moves a joint farther: a singularity is near
MAX_JOINT_JUMP = radians(45.0)
# try a step that would end in a contact with at most this many lengths, each half of the previous one
MAX_HALVED_STEPS = 7
SAME_JOINTS = 1e-9  # [rad] joints that change by less than this count as not moved
INCREMENT = 10.0  # [mm, deg] check a long step of the tool in pieces of this length
JOG_JOINTS_HINT = "jog the joints away from there first"
# [mm, deg] at the end of the reach, shorten a line by each of these lengths, the smallest first, until the joints can
# follow it
SHORTENINGS = (0.0, 0.1, 0.3, 1.0, 3.0, 10.0)
SMALLEST_PIECE = 0.5**13  # find the end of the reach within this fraction of a piece (INCREMENT) of a step
MAX_STEP = 1000.0  # [mm, deg] larger steps are refused
# [deg] rotations of the tool must be smaller: the arm would make a larger one in the other direction
MAX_TURN_DEG = 180.0
STEPS = (0.1, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)  # [mm, deg] sizes of steps that keys can select
SPEEDS = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)  # [%] speeds that keys can select
START_SPEED = 10.0  # [%] speed at which jogging with keys starts


UNITS: tuple[transform.Vector, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
AXES: Mapping[str, hand.Axis] = {
    axis.name: axis
    for frame in (hand.Frame.WORLD, hand.Frame.TOOL)
    for axis in (hand.Axis(frame, index) for index in range(6))
}
JOG_HINT = (
    "JOG 1, 5 turns joint 1 by 5 degrees; JOG Z, -20; axes are joints, X Y Z RX RY RZ, and TX ... TRZ of the tool"
)


@handles("JOG")
def jog(station: Station, it: Instruction) -> dialogue.Dialogue[None]:
    """Carry out JOG axis, amount; without arguments, open the screen on which keys jog the arm. Raises UsageError,
    IllegalValue, RobotNotAttached, MotionError."""
    station.tasks.check_robot_free()
    if it.arguments:
        axis, amount = _read_operands(station, it)
        if said := Jogger(station).step(axis, amount):
            yield results.Message(said, results.Tone.WARNING)
        return
    jogger, user_state = Jogger(station), station.user_state
    user_state.streams.pop(users.StreamKind.KEYS, None)
    question = questions.Jogging(jogger.joints, jogger.units, START_SPEED)
    if not (user_state.attended and (yield from user_state.show(jogger, question))):
        raise errors.UsageError(
            "JOG alone needs a terminal with keys", "JOG axis, amount" if user_state.attended else JOG_HINT
        )


def _read_operands(station: Station, it: Instruction) -> tuple[hand.Axis, float]:
    named, by = it.arguments if len(it.arguments) == 2 else (None, None)
    if named is None or by is None:
        raise errors.UsageError("JOG takes an axis and an amount, or nothing", JOG_HINT)
    amount = real(station, by)
    if not abs(amount) <= MAX_STEP:
        right = f"a number of mm or degrees, up to {MAX_STEP:g}"
        raise errors.IllegalValue(f"an amount of {plain(amount)}", right, value=amount, lower=-MAX_STEP, upper=MAX_STEP)
    name = named.name if isinstance(named, Variable) and named.indexes is None else plain(real(station, named))
    axis = axis_of(station.engine, name)
    if axis.turns and not abs(amount) < MAX_TURN_DEG:
        raise errors.IllegalValue(
            f"a turn of {plain(amount)} deg", f"the tool turns by less than {MAX_TURN_DEG:g} deg in a step"
        )
    return axis, amount


def axis_of(engine: Engine, name: str) -> hand.Axis:
    """Return the axis with this name (a joint number, X, TRZ ...). Raises IllegalJoint, UsageError."""
    if name.upper() in AXES:
        return AXES[name.upper()]
    count = engine.model.joint_count
    if not name.isdigit():
        raise errors.UsageError(f"there is no axis {name}", JOG_HINT)
    if not 1 <= int(name) <= count:
        raise errors.IllegalJoint(f"joint {name}", f"this robot has joints 1 to {count}")
    return hand.Axis(hand.Frame.JOINT, int(name) - 1)


class Jogger:
    """The control of a station's arm by steps. (A station is one robot with its programs, variables and clock.)
    `speed`: in percent of full speed. `said`: the message about the last key. `version`: the version of the timeline
    after the last key that moved the arm."""

    def __init__(self, station: Station, speed: float = 100.0) -> None:
        self.station, self.speed = station, speed
        self.engine = station.engine
        self.joints = self.engine.model.joint_count
        self.units = self.engine.model.units
        self._key: tuple[hand.Axis, float, float] | None = None  # axis, amount and speed of the current step
        self.said, self.version = "", -1
        self._goes_on = False  # whether the current step began before the previous step of the same key had ended

    def do(self, act: hand.Press | hand.StopJog | hand.Look) -> hand.Seen:
        """Carry out the action of a key. Return the resulting state of the robot, including the reason if the action
        failed."""
        try:
            self.station.settle()
            if isinstance(act, hand.Press):
                self.speed = act.speed
                self.said = self.press(act.axis, act.amount)
            elif isinstance(act, hand.StopJog):
                self.stop()
        except (errors.MotionError, errors.FileError) as error:
            self.said = str(error)
        self.version = self.engine.timeline.version if isinstance(act, hand.Press) else self.version
        return hand.Seen(self.engine.position(), self.engine.end, self.engine.clock.paused, self.said)

    def press(self, axis: hand.Axis, amount: float) -> str:
        """Carry out one of the many steps that a held key requests; ignore it while the arm still makes the previous
        step of this key. Any other key takes effect at once; if its step is impossible, the arm brakes. Return a
        message for the user, or "". Raises MotionError."""
        key, before, engine = (axis, amount, self.speed), self._key, self.engine
        left, self._key = engine.end - engine.now, key
        if left > 0.0 and key != before:
            # the opposite key cancels the current step: return to the point where it started
            takes_back = before is not None and before[:2] == (axis, -amount) and not self._goes_on
            begin = engine.destination(engine.end).joints if takes_back else engine.stopping_place()
            present, self._goes_on = engine.timeline, False
            try:
                return self._step_to_contact(begin, axis, amount)
            finally:
                if engine.timeline is present:
                    self.stop()
        if left > NEXT_STEP_LEAD_S:
            return ""
        self._goes_on = left > 0.0
        return self.step(axis, amount)

    def step(self, axis: hand.Axis, amount: float) -> str:
        """Move by `amount` [mm, deg], as far as the arm reaches, after all scheduled motions. Return a message for the
        user, or "". Raises MotionError (no power, or too near a singularity), and CollisionAhead if even a short step
        would end in a contact."""
        return self._step_to_contact(self.engine.destination(self.engine.end).joints, axis, amount)

    def _step_to_contact(self, begin: joints.Joints, axis: hand.Axis, amount: float) -> str:
        """Make a step from the joints `begin`. If it would end in a contact, try half of it, a quarter, and so on."""
        why = ""
        for _ in range(MAX_HALVED_STEPS):
            try:
                return self._step(begin, axis, amount) or why
            except errors.CollisionAhead as error:
                why, amount, refused = f"The arm stops before a contact: {error.detail}", 0.5 * amount, error
        raise refused

    def _step(self, begin: joints.Joints, axis: hand.Axis, amount: float) -> str:
        """Make a step as far as the arm reaches. A step of the tool is a straight line. If the joints cannot follow the
        whole line near the end of the reach, try shorter ones. Raises MotionError if the arm can follow none."""
        goal, part, why = self._farthest(begin, axis, amount)
        if joints.largest_change(begin, goal) <= SAME_JOINTS:
            return why or (f"This arm does not move along {axis.name}" if amount else "")
        way, pose = amount * part, self.engine.world_pose(begin)
        if axis.frame is hand.Frame.JOINT:
            self._go(goal, axis, way)
            return why
        for left_out in SHORTENINGS if why else (0.0,):
            by = way - copysign(left_out, way)
            if by * way <= 0.0:
                break
            try:
                self._go(step_pose(pose, axis, by), axis, by)
                break
            except (errors.StraightLineSingular, errors.JointOutOfRange, errors.LocationOutOfRange) as error:
                if not why or left_out == SHORTENINGS[-1]:
                    raise error.reworded(hint=JOG_JOINTS_HINT) from None
        return why

    def _go(self, goal: joints.Joints | transform.Transform, axis: hand.Axis, by: float) -> None:
        engine, speed, text = self.engine, self.speed / 100.0, f"JOG {axis.name}, {plain(round(by, 3))}"
        if engine.realtime:
            engine.redirect(goal, speed=speed, text=text)
            return
        target = commands.PoseTarget(goal) if isinstance(goal, transform.Transform) else commands.JointTarget(goal)
        self.station.settle(
            engine.begin(
                commands.Move(target, isinstance(goal, transform.Transform), speed=speed, text=text), program=False
            )
        )

    def stop(self) -> None:
        """Brake immediately."""
        self.engine.stop()
        if not self.engine.realtime:
            self.station.settle(self.engine.end)

    def _farthest(self, begin: joints.Joints, axis: hand.Axis, amount: float) -> tuple[joints.Joints, float, str]:
        """Return the joints at which a step ends, the fraction of the step that is possible, and the reason if this is
        not all of it."""
        if axis.frame is hand.Frame.JOINT:
            return self._turn_joint(begin, axis.index, self.engine.model.units.one_read(axis.index + 1, amount))
        pose, near, count = self.engine.world_pose(begin), begin, ceil(abs(amount) / INCREMENT) or 1
        # advance piece by piece; beyond the reach, halve the pieces
        reached, piece, why = 0.0, 1.0, ""
        while reached < count and piece > SMALLEST_PIECE:
            try:
                near = self._joints_near(step_pose(pose, axis, amount * (reached + piece) / count), near)
                reached += piece
            except errors.MotionError as error:
                if isinstance(error, errors.TooNear) and not why:
                    if not reached:
                        raise
                    return near, reached / count, f"The arm goes no farther along {axis.name}: {error.detail}"
                joint = f"joint {error.joint} " if isinstance(error, errors.JointOutOfRange) else ""
                why = why or f"The arm reaches no farther along {axis.name}: {joint}{error.detail}"
            piece = 0.5 * piece if why else piece
        return near, reached / count, why

    def _turn_joint(self, begin: joints.Joints, index: int, change: float) -> tuple[joints.Joints, float, str]:
        model = self.engine.model
        wanted = begin[index] + change
        value = min(max(wanted, model.lower[index]), model.upper[index])
        goal = (*begin[:index], value, *begin[index + 1 :])
        if value == wanted or not change:  # without a change, a joint may be just outside its range because of rounding
            return goal, 1.0, ""
        return (
            goal,
            (value - begin[index]) / change,
            f"Joint {index + 1} stops at the end of its range, {model.joint_text(index + 1, value, 1)}",
        )

    def _joints_near(self, pose: transform.Transform, begin: joints.Joints) -> joints.Joints:
        """Return the joints for a pose that are nearest to the joints `begin`. Raises MotionError for a pose out of
        reach, TooNear if a joint would jump near a singularity."""
        goal = self.engine.joints_for(pose, begin)
        if (change := joints.largest_change(begin, goal)) > MAX_JOINT_JUMP:
            joint = 1 + [abs(b - a) for a, b in zip(begin, goal, strict=True)].index(change)
            raise errors.TooNear(
                f"joint {joint} would move by {self.engine.model.joint_text(joint, change, 0)} for it",
                JOG_JOINTS_HINT,
                joint=joint,
                value=change,
                upper=MAX_JOINT_JUMP,
            )
        return goal


def step_pose(T_world_tool: transform.Transform, axis: hand.Axis, amount: float) -> transform.Transform:
    """Return the pose of the tool after a step along an axis [mm] or about it [deg]. A rotation about an axis of the
    world leaves the tool tip in place."""
    unit, T = UNITS[axis.index % 3], T_world_tool
    x, y, z = (1e-3 * amount * u for u in unit)
    step = transform.rotation_about(unit, radians(amount)) if axis.turns else transform.translation(x, y, z)
    if axis.frame is hand.Frame.TOOL:
        return transform.compose(T, step)
    moved = transform.compose(step, transform.at_position(T, 0.0, 0.0, 0.0))
    return transform.at_position(moved, T.px + moved.px, T.py + moved.py, T.pz + moved.pz)
