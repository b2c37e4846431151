"""Carry out instructions for signals, timers and reactions; for ending a program or a cycle; for tasks (EXECUTE, ABORT,
events); for motions (MOVE, APPRO, DRIVE ...); and for settings of motions (SPEED, modes, configurations, the hand,
TOOL, BASE, switches and parameters)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import partial
from math import radians

from vrs_cli.engine.settings import (
    ACCELERATION,
    DECELERATION,
    FULL_SPEED,
    JOINT_SPEED,
    MONITOR_SPEED,
    PROGRAM_SPEED,
    ROTATION_SPEED,
)
from vrs_cli.errors import IllegalJoint, IllegalSignal, IllegalValue
from vrs_cli.kinematics.joints import Arm, Elbow, Flag, Joints, Profile, Wrist
from vrs_cli.kinematics.transform import IDENTITY, Transform, compose, rotation_x, rotation_y, rotation_z, translation
from vrs_cli.language.run import effects
from vrs_cli.language.run.memory import Context, Handler, Wording, checked_seconds, transform
from vrs_cli.language.run.operations import shift
from vrs_cli.language.words.values import INPUTS, TRUE, integer, integer_between, plain, whole
from vrs_cli.values import commands

MAX_SKIPPED_STEPS = 9999  # maximum number of steps that RETURN n can skip after the CALL

# --- signals and reactions ---------------------------------------------------------------------------------------

_LOOK_AROUND = (effects.LookAround(),)


def _signal(context: Context, it: Wording, *numbers: float | None) -> Iterable[effects.Event]:
    signals, given = context.environment.signals, [number for number in numbers if number is not None]
    if it.stamp is not None:
        return (signals.request(given, it.stamp, it.text),)
    signals.write(*given, text=it.text)
    return _LOOK_AROUND


def _reset(context: Context, it: Wording) -> Iterable[effects.Event]:
    if it.stamp is not None:
        return (context.environment.signals.reset_request(it.stamp, it.text),)
    context.environment.signals.reset(it.text)
    return _LOOK_AROUND


def _bits(context: Context, it: Wording, first: float, count: float | None = None) -> Iterable[effects.Event]:
    context.environment.signals.write_bits(first, 1.0 if count is None else count, integer(it.value), it.text)
    return _LOOK_AROUND


def _react(
    immediate: bool,
    context: Context,
    _it: Wording,
    number: float,
    call: effects.CallProgram,
    given: float | None = None,
) -> None:
    signal, priority = (
        effects.checked_signal(number),
        effects.checked_priority(effects.DEFAULT_PRIORITY if given is None else given, 1),
    )
    context.environment.signals.read(signal)
    context.environment.program(call.name)
    context.reactions.set(effects.Reaction(signal, call.name, priority, immediate))


def _react_to_errors(context: Context, _it: Wording, call: effects.CallProgram | None = None) -> None:
    if call is not None:
        context.environment.program(call.name)
    context.reactions.on_error = None if call is None else call.name


def _ignore(context: Context, _it: Wording, number: float) -> None:
    signal = effects.checked_signal(number)
    context.environment.signals.read(signal)
    context.reactions.ignore(signal)


def _lock(context: Context, _it: Wording, priority: float) -> Iterable[effects.Event]:
    context.reactions.priority = effects.checked_priority(priority, 0)
    return _LOOK_AROUND


def _run_signal(context: Context, _it: Wording, number: float) -> Iterable[effects.Event]:
    return (effects.RunSignal(context.environment.signals.writable(effects.checked_signal(number))),)


# --- tasks -------------------------------------------------------------------------------------------------------


def checked_task(number: float) -> int:
    """Return the number of a task as an integer. Raises IllegalValue unless it is from 0 to LAST_TASK."""
    return integer_between(number, 0, effects.LAST_TASK, "task")


def _start(
    context: Context,
    _it: Wording,
    call: effects.CallProgram,
    cycles: float | None = None,
    step: float | None = None,
    task: float | None = None,
) -> Iterable[effects.Event]:
    number = None if task is None else checked_task(task)
    context.environment.program(call.name)
    times = 1 if cycles is None else whole(cycles) or 1  # 0 means one cycle, as V+ programs use it
    return (effects.StartTask(number, call, times, 1 if step is None else whole(step)),)


def _control(
    control: effects.TaskControl, _context: Context, _it: Wording, task: float | None = None
) -> Iterable[effects.Event]:
    return (effects.ControlTask(control, checked_task(task or 0.0)),)


def _wait_event(
    _context: Context, _it: Wording, event: float | None = None, seconds: float | None = None
) -> Iterable[effects.Event]:
    if seconds is not None:
        checked_seconds("a wait", seconds)
    return (effects.WaitEvent(event is not None or seconds is None, seconds),)


def _event(
    on: bool, _context: Context, _it: Wording, task: float | None = None, flag: float | None = None
) -> Iterable[effects.Event]:
    integer_between(1.0 if flag is None else flag, 1, 1, "flag")
    return (effects.SetEvent(None if task is None else checked_task(task), on),)


def _event_signal(context: Context, _it: Wording, number: float, level: float | None = None) -> Iterable[effects.Event]:
    """Choose the input signal that sets the task's event (INT.EVENT). `level`: the interrupt level on the bus of a real
    controller, which is checked but has no effect here."""
    integer_between(1.0 if level is None else level, 1, 2, "level")
    if whole(number) == 0:
        return (effects.EventSignal(None),)
    if whole(number) not in INPUTS:
        raise IllegalSignal(plain(number), f"INT.EVENT wants an input, {INPUTS[0]} to {INPUTS[-1]}, or 0")
    context.environment.signals.read(number)
    return (effects.EventSignal(whole(number)),)


TASKS: Mapping[str, Handler] = {
    "SIGNAL": _signal,
    "RESET": _reset,
    "BITS": _bits,
    "TIMER": lambda context, it, number: context.environment.timers.set(number, it.value, context.engine.now),
    "REACT": partial(_react, False),
    "REACTI": partial(_react, True),
    "REACTE": _react_to_errors,
    "IGNORE": _ignore,
    "LOCK": _lock,
    "RUNSIG": _run_signal,
    "RETURN": lambda _context, _it, steps=None: (
        effects.Return(integer_between(steps or 0.0, 0, MAX_SKIPPED_STEPS, "a number of steps of")),
    ),
    "RETURNE": lambda _context, _it: (effects.Return(mended=True),),
    "STOP": lambda _context, _it: (effects.Stop(),),
    "PAUSE": lambda _context, _it: (effects.Pause(),),
    "HALT": lambda _context, _it: (effects.Halt(),),
    "EXECUTE": _start,
    "PCEXECUTE": partial(_start, task=effects.PROCESS_CONTROL),
    **{control.value: partial(_control, control) for control in effects.TaskControl},
    "WAIT.EVENT": _wait_event,
    "SET.EVENT": partial(_event, True),
    "CLEAR.EVENT": partial(_event, False),
    "INT.EVENT": _event_signal,
    "RELEASE": lambda _context, _it, _task=None: (effects.Wait(lambda: True, 1),),
}


# --- motions ---------------------------------------------------------------------------------------------------------


def _move(
    straight: bool, _context: Context, it: Wording, place: Transform | Joints, hand: float | None = None
) -> Iterable[effects.Event]:
    """Move to a location (MOVE, MOVES; MOVET and MOVEST also operate the hand). `hand`: a number above 0 or TRUE opens
    the pneumatic hand, any other number closes it."""
    target = commands.PoseTarget(place) if isinstance(place, Transform) else commands.JointTarget(place)
    opening = None if hand is None else float(hand > 0.0 or hand == TRUE)
    return (commands.Move(target, straight, hand=opening, stamp=it.stamp, text=it.text),)


def _back_off(distance: float) -> Transform:
    """Return the displacement by `distance` [mm] along the negative Z axis of the tool."""
    return translation(0.0, 0.0, -distance / 1000.0)


def _approach(
    straight: bool, _context: Context, it: Wording, place: Transform | Joints, distance: float
) -> Iterable[effects.Event]:
    pose = compose(transform(place), _back_off(distance))
    return (commands.Move(commands.PoseTarget(pose), straight, stamp=it.stamp, text=it.text),)


def _depart(straight: bool, _context: Context, it: Wording, distance: float) -> Iterable[effects.Event]:
    return (commands.Move(commands.ToolOffsetTarget(_back_off(distance)), straight, stamp=it.stamp, text=it.text),)


def _drive(
    context: Context, it: Wording, joint: float, change: float, speed: float | None = None
) -> Iterable[effects.Event]:
    if not 0.5 <= joint < context.engine.model.joint_count + 0.5:
        raise IllegalJoint(plain(joint), f"joints are 1 to {context.engine.model.joint_count}")
    target = commands.JointOffsetTarget(whole(joint), context.environment.units.one_read(whole(joint), change))
    fraction = None if speed is None else JOINT_SPEED.check(speed) / FULL_SPEED
    return (commands.Move(target, False, speed=fraction, stamp=it.stamp, text=it.text),)


def _draw(context: Context, it: Wording, *distances: float | None) -> Iterable[effects.Event]:
    target = shift(context.engine.destination(context.engine.end).T_world_tool, *distances)
    return (commands.Move(commands.PoseTarget(target), True, stamp=it.stamp, text=it.text),)


def _move_joints(context: Context, it: Wording, *values: float | None) -> Iterable[effects.Event]:
    joints, units = list(context.engine.destination(context.engine.end).joints), context.environment.units
    if len(values) > len(joints):
        raise IllegalValue(f"JMOVE with {len(values)} values", f"the robot has {len(joints)} joints")
    for number, value in enumerate(values):
        if value is not None:
            joints[number] = units.one_read(number + 1, value)
    return (commands.Move(commands.JointTarget(tuple(joints)), False, stamp=it.stamp, text=it.text),)


ADDS, WORLD = 1, 2  # mode bits of ALTON: corrections add up; corrections are in world coordinates


def _alter_on(
    _context: Context, _it: Wording, _lun: float | None = None, mode: float | None = None
) -> Iterable[effects.Event]:
    bits = integer_between(mode or 0.0, 0, ADDS | WORLD, "ALTON mode")
    return (commands.SetAlter(commands.AlterMode(world=bool(bits & WORLD), adds=bool(bits & ADDS))),)


def _alter(
    _context: Context, it: Wording, _lun: float | None = None, *numbers: float | None
) -> Iterable[effects.Event]:
    *shift_by, rx, ry, rz = (number or 0.0 for number in (*numbers, *(None,) * 6)[:6])
    turn = compose(compose(rotation_x(radians(rx)), rotation_y(radians(ry))), rotation_z(radians(rz)))
    return (commands.Alter(shift(turn, *shift_by), it.text),)


# --- settings of motions -----------------------------------------------------------------------------------------

LAST_PROFILE = 8  # highest number of an acceleration profile (V+ Language Reference Guide, ACCEL)


def _speed(_context: Context, it: Wording, speed: float, rotation: float | None = None) -> Iterable[effects.Event]:
    if it.unit == "MONITOR":
        return (commands.SetMonitorSpeed(MONITOR_SPEED.check(speed)),)
    unit = commands.SpeedUnit.PERCENT if it.unit is None else commands.SpeedUnit(it.unit)
    if rotation is not None:
        ROTATION_SPEED.check(rotation)
    return (commands.SetSpeed(PROGRAM_SPEED[unit].check(speed), rotation, unit, it.always),)


def _swivel(
    context: Context, it: Wording, joint: float | None = None, value: float | None = None
) -> Iterable[effects.Event]:
    if joint is None:
        if value is not None:
            raise IllegalValue("SWIVEL of no joint", "name the joint that has the value: SWIVEL 3, 20")
        return (commands.SetSwivel(None, it.always),)
    if not 0.5 <= joint < context.engine.model.joint_count + 0.5:
        raise IllegalJoint(plain(joint), f"joints are 1 to {context.engine.model.joint_count}")
    number = whole(joint)
    end = None if value is None else context.environment.units.one_read(number, value)
    return (commands.SetSwivel(commands.Swivel(number, end), it.always),)


def _acceleration(
    context: Context,
    _it: Wording,
    profile: float | None = None,
    acceleration: float | None = None,
    deceleration: float | None = None,
) -> Iterable[effects.Event]:
    """Set the acceleration profile, the acceleration and the deceleration [%] (ACCEL). Omitted values are not
    changed."""
    if profile is not None:
        # use profile 0 (constant acceleration) for a number that has no profile (V+ Language Reference Guide, ACCEL)
        names = dict(enumerate(one.name for one in Profile))
        number = integer_between(profile, 0, LAST_PROFILE, "a profile of")
        yield commands.SetParameter("PROFILE", names.get(number, names[0]))
    if acceleration is not None or deceleration is not None:
        if deceleration is not None:
            DECELERATION.check(deceleration)
        given = context.engine.settings.acceleration * FULL_SPEED if acceleration is None else acceleration
        yield commands.SetAcceleration(ACCELERATION.check(given), deceleration)


def _payload(context: Context, _it: Wording, percent: float | None = None, joint: float | None = None) -> None:
    """Check the operands of PAYLOAD. They have no effect, because a virtual arm has no servo control that uses them."""
    if percent is not None and percent > FULL_SPEED:
        raise IllegalValue(
            f"PAYLOAD {plain(percent)}", "a load is 0 to 100 % of the largest, or negative: the usual one"
        )
    integer_between(joint or 0.0, 0, context.engine.model.joint_count, "joint")


def _mode(
    mode: commands.Mode, on: bool, _context: Context, it: Wording, tolerance: float | None = None
) -> Iterable[effects.Event]:
    if tolerance is not None and not tolerance > 0.0:
        raise IllegalValue(f"a tolerance of {plain(tolerance)}", "it must be greater than 0")
    return (commands.SetMode(mode, on, it.always, tolerance),)


def _hand(
    opening: float | None, immediate: bool, _context: Context, it: Wording, width: float | None = None
) -> Iterable[effects.Event]:
    return (commands.OperateHand(opening, immediate, it.text, None if width is None else width / 1000.0, it.stamp),)


def _base(_context: Context, _it: Wording, *numbers: float | None) -> Iterable[effects.Event]:
    *distances, turn = [number or 0.0 for number in (*numbers, *(None,) * 4)[:4]]
    return (commands.SetBase(compose(shift(IDENTITY, *distances), rotation_z(radians(turn)))),)


def _select(_context: Context, it: Wording, device: str) -> None:
    if not "ROBOT".startswith(device) or whole(it.value) != 1:
        raise IllegalValue(f"SELECT {device} = {plain(it.value)}", "there is one robot: SELECT ROBOT = 1")


def _configure(flag: Flag, _context: Context, _it: Wording) -> Iterable[effects.Event]:
    return (commands.SetConfiguration(flag),)


MODE_WORDS = {
    "COARSE": (commands.Mode.COARSE, True),
    "FINE": (commands.Mode.COARSE, False),
    "NULL": (commands.Mode.NULLING, True),
    "NONULL": (commands.Mode.NULLING, False),
    "CPON": (commands.Mode.CONTINUOUS_PATH, True),
    "CPOFF": (commands.Mode.CONTINUOUS_PATH, False),
    "INTON": (commands.Mode.INTEGRAL, True),
    "INTOFF": (commands.Mode.INTEGRAL, False),
    "SINGLE": (commands.Mode.SINGLE, True),
    "MULTIPLE": (commands.Mode.SINGLE, False),
    "OVERLAP": (commands.Mode.OVERLAP, True),
    "NOOVERLAP": (commands.Mode.OVERLAP, False),
}

_HANDS = {"OPEN": 1.0, "CLOSE": 0.0, "RELAX": None}

MOTIONS: Mapping[str, Handler] = {
    "MOVE": partial(_move, False),
    "MOVES": partial(_move, True),
    "MOVET": partial(_move, False),
    "MOVEST": partial(_move, True),
    "GO": partial(_move, False),
    "APPRO": partial(_approach, False),
    "APPROS": partial(_approach, True),
    "DEPART": partial(_depart, False),
    "DEPARTS": partial(_depart, True),
    "DRAW": _draw,
    "DRIVE": _drive,
    "JMOVE": _move_joints,
    "READY": lambda _context, it: (commands.Move(commands.NamedTarget("ready"), False, stamp=it.stamp, text=it.text),),
    "NEST": lambda _context, it: (commands.Move(commands.NamedTarget("nest"), False, stamp=it.stamp, text=it.text),),
    "ALIGN": lambda _context, it: (commands.Move(commands.AlignedTarget(), True, stamp=it.stamp, text=it.text),),
    "ALTON": _alter_on,
    "ALTER": _alter,
    **dict.fromkeys(("ALTOFF", "NOALTER"), lambda _context, _it, _lun=None: (commands.SetAlter(None),)),
    "DELAY": lambda _context, it, seconds: (commands.Delay(checked_seconds("a delay", seconds), it.text),),
    "BREAK": lambda _context, _it: (commands.Break(),),
    "BRAKE": lambda _context, _it: (commands.Brake(),),
    "SPEED": _speed,
    "DURATION": lambda _context, it, seconds: (
        commands.SetDuration(checked_seconds("a duration", seconds), it.always),
    ),
    "SWIVEL": _swivel,
    "ACCEL": _acceleration,
    "PAYLOAD": _payload,
    "ROBOT.OPR": lambda _context, _it, *_values: None,
    **{word: partial(_mode, mode, on) for word, (mode, on) in MODE_WORDS.items()},
    **{flag.name: partial(_configure, flag) for flags in (Arm, Elbow, Wrist) for flag in flags},
    **{word: partial(_hand, opening, False) for word, opening in _HANDS.items()},
    **{f"{word}I": partial(_hand, opening, True) for word, opening in _HANDS.items()},
    "GRASP": lambda _context, it, *_operands: (commands.OperateHand(0.0, True, it.text),),
    "TOOL": lambda _context, _it, tool=None: (commands.SetTool(IDENTITY if tool is None else transform(tool)),),
    "BASE": _base,
    "ENABLE": lambda _context, _it, *names: [commands.SetSwitch(name, True) for name in names],
    "DISABLE": lambda _context, _it, *names: [commands.SetSwitch(name, False) for name in names],
    "SWITCH": lambda _context, it, name: (commands.SetSwitch(name, bool(it.value)),),
    "PARAMETER": lambda _context, it, name: (commands.SetParameter(name, it.value),),
    "SELECT": _select,
    "CALIBRATE": lambda _context, _it: None,
}
