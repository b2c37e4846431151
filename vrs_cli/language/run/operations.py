"""Define the functions of VAL-II (SIN, TRANS, $MID ...), and the tables in which compiled programs find them.

Arguments and results that are numbers are in millimetres and degrees; transformations and joint positions are in metres
and radians. An omitted argument is None. Sources: V+ Language Reference; val2 section 5.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Mapping
from datetime import datetime, timedelta
from functools import reduce
from math import cos, fmod, radians, sin, sqrt
from operator import or_

from vrs_cli.errors import ArithmeticOverflow, IllegalValue, NegativeSquareRoot, TypeMismatch, UndefinedValue, VrsError
from vrs_cli.kinematics import transform
from vrs_cli.kinematics.joints import Arm, Configuration, Elbow, Flag, Joints, Wrist
from vrs_cli.language.run.effects import CLOSED, NO_WAIT, OPENED, checked_unit
from vrs_cli.language.run.formats import encode
from vrs_cli.language.run.memory import ROBOT_NUMBER, TICK, Context, in_range, speed, state
from vrs_cli.language.run.variables import Reference
from vrs_cli.language.words import values
from vrs_cli.values.numbers import LIMIT, Value
from vrs_cli.version import __version__

# --- arithmetic --------------------------------------------------------------------------------------------------


def truth(condition: bool) -> float:
    """Return a truth value as a number: -1 for TRUE, 0 for FALSE."""
    return values.TRUE if condition else values.FALSE


def square_root(x: float) -> float:
    if x < 0.0:
        raise NegativeSquareRoot(f"SQRT({values.plain(x)})", "the argument must not be negative")
    return sqrt(x)


_SINES: tuple[Callable[[float], float], ...] = (sin, cos, lambda x: -sin(x), lambda x: -cos(x))


HALF_RIGHT_ANGLE = math.nextafter(45.0, 0.0)  # [deg] from this angle on, `values.quadrant` rounds up to a right angle
DEGREE = math.pi / 180.0


def sine(angle: float) -> float:
    """Return the sine of an angle [degrees], exact at multiples of a right angle. The result is the same as with
    `values.quadrant` (see `cosine`), but is computed faster."""
    turned = fmod(angle, 360.0)
    positive = turned if turned >= 0.0 else -turned
    if positive < HALF_RIGHT_ANGLE:
        x = sin(positive * DEGREE)
    elif positive < 135.0:
        x = cos((positive - 90.0) * DEGREE)
    elif positive < 225.0:
        x = -sin((positive - 180.0) * DEGREE)
    elif positive < 315.0:
        x = -cos((positive - 270.0) * DEGREE)
    else:
        x = sin((positive - 360.0) * DEGREE)
    return x + 0.0 if turned >= 0.0 else 0.0 - x


def cosine(angle: float) -> float:
    right_angles, rest = values.quadrant(angle)
    return _SINES[(right_angles + 1) % 4](rest) + 0.0


def tangent(angle: float) -> float:
    if (adjacent := cosine(angle)) == 0.0:
        raise ArithmeticOverflow(f"TAN({values.plain(angle)})", "the tangent of a right angle is infinite")
    return sine(angle) / adjacent


def modulo(a: float, b: float) -> float:
    """Return `a MOD b` for operands rounded to integers; the result has the sign of a. Raises ArithmeticOverflow if b
    is 0."""
    dividend, divisor = values.integer(a), values.integer(b)
    if divisor == 0:
        raise ArithmeticOverflow(f"{values.plain(a)} MOD {values.plain(b)}", "the divisor is 0")
    return float(math.fmod(dividend, divisor)) + 0.0


def power(a: float, b: float) -> float:
    """Return `a ** b`. Raises ArithmeticOverflow if the result is too large, IllegalValue if a is negative and b is not
    a whole number."""
    if a < 0.0 and b != math.trunc(b):
        raise IllegalValue(f"{values.plain(a)} ** {values.plain(b)}", "a negative number has whole powers only")
    try:
        return float(a**b)
    except (OverflowError, ZeroDivisionError):
        raise ArithmeticOverflow(f"{values.plain(a)} ** {values.plain(b)}") from None


# --- bits --------------------------------------------------------------------------------------------------------

_BCD_DIGITS = 6  # maximum number of decimal digits in BCD: four bits each, in a number of 24 bits


def from_bcd(x: float) -> float:
    text = format(values.integer_between(x, 0, values.INTEGER_HIGH, "DCB of"), "x")
    if not text.isdecimal():
        raise IllegalValue(f"DCB({values.plain(x)})", "every four bits must be a digit from 0 to 9")
    return float(int(text))


def bit_mask(*bits: float) -> float:
    return float(reduce(or_, (1 << (values.integer_between(bit, 1, 24, "bit") - 1) for bit in bits), 0))


def signals_on(context: Context, *numbers: float) -> float:
    states = [context.environment.signals.observe(number) for number in numbers]
    return truth(all(states))


# --- locations ---------------------------------------------------------------------------------------------------


NULL_ANGLES = (90.0, -90.0, 0.0)  # [deg] the angles O, A, T of the identity transformation (val2 section 6.2)


def _or(number: float | None, default: float) -> float:
    return default if number is None else number


def trans(*numbers: float | None) -> transform.Transform:
    x, y, z = (_or(number, 0.0) / 1000.0 for number in numbers[:3])
    angles = numbers[3:]
    if all(angle is None for angle in angles):
        return transform.translation(x, y, z)  # avoids the rounding errors of the default angles 90 and -90
    o, a, t = map(_or, angles, NULL_ANGLES)
    return transform.from_oat(x, y, z, radians(o), radians(a), radians(t))


def precision_point(context: Context, *joints: float | None) -> Joints:
    dof = context.engine.model.joint_count
    if any(joint is not None for joint in joints[dof:]):
        raise IllegalValue(f"{len(joints)} joint values", f"the robot has {dof} joints")
    return context.environment.units.read(_or(joint, 0.0) for joint in (*joints, *(None,) * dof)[:dof])


def shift(
    T: transform.Transform, dx: float | None = None, dy: float | None = None, dz: float | None = None
) -> transform.Transform:
    x, y, z = transform.position(T)
    return transform.at_position(T, x + _or(dx, 0.0) / 1000.0, y + _or(dy, 0.0) / 1000.0, z + _or(dz, 0.0) / 1000.0)


def _direction(v: transform.Vector, problem: str) -> transform.Vector:
    if (length := math.hypot(*v)) < 1e-9:
        raise IllegalValue(f"FRAME: {problem}", "give three positions that are not on one line")
    return v[0] / length, v[1] / length, v[2] / length


def frame(
    a: transform.Transform, b: transform.Transform, c: transform.Transform, d: transform.Transform | None
) -> transform.Transform:
    x = _direction(
        transform.vector_difference(transform.position(b), transform.position(a)),
        "the first two positions are the same",
    )
    z = _direction(
        transform.cross(x, transform.vector_difference(transform.position(c), transform.position(a))),
        "the third position is on the line of the first two",
    )
    y = transform.cross(z, x)
    origin = transform.position(a if d is None else d)
    return transform.Transform(
        x[0], y[0], z[0], origin[0], x[1], y[1], z[1], origin[1], x[2], y[2], z[2], origin[2]
    )  # fmt: skip


# --- strings -----------------------------------------------------------------------------------------------------


def code_of(text: str, index: float | None) -> float:
    place = _from_one(_or(index, 1.0), "a string")
    return float(ord(text[place - 1])) if place <= len(text) else -1.0


def position_of(text: str, part: str, start: float | None) -> float:
    first = max(values.whole(_or(start, 1.0)), 1)
    return float(text.find(part, first - 1) + 1) if part else 0.0


def middle(text: str, first: float, count: float | None) -> str:
    start = _from_one(first, "a string")
    size = len(text) if count is None else max(values.whole(count), 0)
    return text[start - 1 : start - 1 + size]


def decode(source: Reference, separators: str, mode: float | None) -> str:
    """Remove the part before the first separator (if `mode` is above 0: the leading separators) from a string variable,
    and return the removed part ($DECODE)."""
    text = source.value()
    assert isinstance(text, str)
    wanted = values.whole(_or(mode, 0.0)) > 0
    size = next((i for i, c in enumerate(text) if (c in separators) is not wanted), len(text))
    source.assign(text[size:])
    return text[:size]


def packer(code: str, low: float, high: float) -> Callable[[float], str]:
    """Return a function that packs a number in big-endian binary, with one character for each byte. `code`: the code of
    the form in Python's `struct`; `low`, `high`: the range of the number."""

    def pack(x: float) -> str:
        if not low <= x <= high:
            raise IllegalValue(values.plain(x), f"{values.plain(low)} to {values.plain(high)} can be packed")
        return struct.pack(f">{code}", x if code in "fd" else values.whole(x)).decode("latin-1")

    return pack


def _numbers_in(text: str, first: float | None, code: str) -> tuple[float, ...]:
    """Unpack big-endian binary numbers from a string, beginning with the character number `first` (from 1; default 1).
    `code`: the code of the form in Python's `struct`. Raises IllegalValue for missing or invalid bytes."""
    start, size = values.whole(_or(first, 1.0)) - 1, struct.calcsize(f">{code}")
    piece = text[start : start + size] if start >= 0 else ""
    if len(piece) < size:
        raise IllegalValue(f"{len(piece)} characters", f"{size} are wanted from there on")
    numbers = struct.unpack(f">{code}", piece.encode("latin-1", "replace"))
    if not all(abs(number) <= LIMIT for number in numbers):  # also true for NaN
        raise IllegalValue("bytes of no real", f"a real is at most {values.plain(LIMIT)}")
    return tuple(map(float, numbers))


def location_bytes(T: transform.Transform) -> str:
    """Pack the axes and the position [mm] of a transformation as 12 single-precision numbers ($TRANSB, V+ Language
    Reference)."""
    axes = (number for column in range(3) for number in T[column::4])
    return struct.pack(">12f", *axes, *map(values.millimetres, transform.position(T))).decode("latin-1")


PIECE = 128  # number of characters in each array element for PACK and $UNPACK, which use the array as one long string


def unpack(array: Reference, first: float, count: float) -> str:
    """Return `count` characters from an array of strings, used as one long string with 128 characters in each element
    ($UNPACK). `array`: the element where the long string begins; `first`: the number of the first character, from
    1."""
    pieces, at, size = _stretch(array, first, count)
    text = "".join(str(piece.value()).ljust(PIECE, "\0") if piece.has_value() else "" for piece in pieces)
    return text[at : at + size].rstrip("\0")


def pack(array: Reference, first: float, count: float, text: str) -> None:
    """Replace the `count` characters that `unpack` would return by a string (PACK). If the string is shorter, NUL
    characters fill the rest."""
    pieces, at, size = _stretch(array, first, count)
    old = "".join((str(piece.value()) if piece.has_value() else "").ljust(PIECE, "\0") for piece in pieces)
    new = old[:at] + text[:size].ljust(size, "\0") + old[at + size :]
    for piece, part in zip(pieces, (new[:PIECE], new[PIECE:]), strict=True):
        if piece.has_value() or part.rstrip("\0"):
            piece.assign(part.rstrip("\0"))


def _stretch(array: Reference, first: float, count: float) -> tuple[list[Reference], int, int]:
    """Return the two array elements over which the characters for PACK or $UNPACK may extend, the index of the first
    character in them, and the number of characters."""
    size = values.integer_between(count, 0, PIECE, "a number of characters of")
    start = _from_one(first, "an array") - 1
    return [element(array, start // PIECE + k) for k in (0, 1)], start % PIECE, size


def _from_one(number: float, what: str) -> int:
    """Return the number of a character (from 1) as an integer. `what`: the name of the text in the message. Raises
    IllegalValue if it is below 1."""
    if (place := values.whole(number)) < 1:
        raise IllegalValue(f"character {place} of {what}", "characters count from 1")
    return place


def element(first: Reference, offset: int) -> Reference:
    """Return a reference to the array element whose index is `offset` above the index of `first`. Raises TypeMismatch
    if `first` is not an element with one index."""
    if not isinstance(first.key, int):
        raise TypeMismatch(first.name, "an element of an array with one index is wanted: $a[1]")
    return first._replace(key=first.key + offset)


# --- the system --------------------------------------------------------------------------------------------------

# Values of TASK(1, n), the state of a task. V+ Language Reference names the states; the numbers above 1 are our choice.
IDLE, COMPLETED, FAILED, ABORTED, EXECUTING, PAUSED = range(6)


def about_task(context: Context, select: float | None, task: float | None) -> float:
    """Return the value of the function TASK. `select`: 0 for the number of the calling task, 1 for the state of a task,
    2 for its robot. Raises IllegalValue for another number."""
    which, system = values.whole(_or(select, 0.0)), context.environment.system
    asked = {0: lambda _: system.task(), 1: system.run_state, 2: system.robot_of}
    if which not in asked:
        raise IllegalValue(f"TASK({which})", "0 the number of this task, 1 what a task does, 2 its robot")
    return float(asked[which](_task(context, task)))


def _task(context: Context, number: float | None) -> int:
    """Return the number of a task; if it is omitted (None), the number of the calling task."""
    return context.environment.system.task() if number is None else values.whole(number)


def select_robot(device: str, mode: float | None) -> float:
    """Return the value of the function SELECT: the number of the robot. Raises IllegalValue for any other device."""
    if device != "ROBOT":
        raise IllegalValue(f"SELECT({device})", "there is one robot: SELECT(ROBOT)")
    values.integer_between(_or(mode, 0.0), -1, 0, "SELECT mode")
    return float(ROBOT_NUMBER)


# Bits in the value of the function CONFIG. V+ also returns the configuration as bits; their meanings are our choice.
_CONFIGURATION_BITS: Mapping[Flag, int] = {Arm.RIGHTY: 1, Elbow.BELOW: 2, Wrist.FLIP: 4}


def configuration_bits(configuration: Configuration) -> int:
    return sum(_CONFIGURATION_BITS.get(flag, 0) for flag in configuration.flags if flag is not None)


def configuration_of(bits: float) -> Configuration:
    """Convert the bits of CONFIG to a configuration. Raises IllegalValue for unknown bits."""
    number = values.integer_between(bits, 0, sum(_CONFIGURATION_BITS.values()), "configuration bits of")
    return Configuration.of(
        Arm.RIGHTY if number & _CONFIGURATION_BITS[Arm.RIGHTY] else Arm.LEFTY,
        Elbow.BELOW if number & _CONFIGURATION_BITS[Elbow.BELOW] else Elbow.ABOVE,
        Wrist.FLIP if number & _CONFIGURATION_BITS[Wrist.FLIP] else Wrist.NOFLIP,
    )


def latched_place(context: Context, select: float | None) -> tuple[transform.Transform, Joints]:
    """Return the values of LATCH and #PLATCH: T_world_tool and the joint positions at the last latch signal. Raises
    UndefinedValue before the first one."""
    values.integer_between(_or(select, 0.0), 0, 0, "LATCH")
    if (found := context.environment.system.latch()) is None:
        raise UndefinedValue("LATCH", "PARAMETER LATCH.SIGNAL names the signal, and it has not come yet")
    return found


def present_configuration(context: Context, select: float | None) -> float:
    """Return the value of CONFIG: the bits of the arm's configuration, now (`select` 0) or after all motions (1)."""
    engine, at_end = context.engine, values.integer_between(_or(select, 0.0), 0, 1, "CONFIG")
    place = engine.destination(engine.end) if at_end else engine.position()
    return float(configuration_bits(engine.arm.configuration(place.joints)))


def free(which: float) -> float:
    """Return the value of FREE(0), the free memory [%]: always 100 for a virtual controller. Raises IllegalValue for
    other arguments."""
    if values.whole(which) == 0:
        return 100.0
    raise IllegalValue(f"FREE({values.plain(which)})", "0 the percentage of memory that is free")


def io_status(context: Context, unit: float, mode: float | None) -> float:
    """Return the value of IOSTAT for a unit: the status of its last operation (modes 0, 1, 3), or the length of its
    last record (mode 2) [characters]."""
    system, which = context.environment.system, values.integer_between(_or(mode, 0.0), 0, 3, "IOSTAT mode")
    number = checked_unit(unit)
    return float(system.record_length(number) if which == RECORD_LENGTH else system.unit_status(number))


RECORD_LENGTH = 2  # mode in which IOSTAT returns the length of the last record


# Texts of message codes that are not errors (V+ Language Reference, system messages).
MESSAGES = {
    1: "Success",
    3: "Program completed",
    8: "(HALTED)",
    9: "(PAUSED)",
    OPENED: "Network connection opened",
    CLOSED: "Network connection closed",
}


def message(code: int) -> str:
    """Return the text of a message code ($ERROR); for an unused code, "Unknown error code n"."""
    classes: list[type[VrsError]] = [VrsError]
    # collect the classes at each call, because modules loaded later add some; of classes with the same code, the text
    # of the base class is used, which comes first
    for cls in classes:
        classes += cls.__subclasses__()
    texts = {cls.code: cls.text for cls in reversed(classes)}
    return MESSAGES.get(code) or texts.get(code, f"Unknown error code {code}")


_MONTHS = ("Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec")
_FIRST_DAY = 1984  # year in which the robot clock starts (on 1 January), so that every run shows the same dates


def clock_text(context: Context) -> str:
    moment = datetime(_FIRST_DAY, 1, 1) + timedelta(seconds=math.floor(context.engine.now))
    return f"{moment.day:02d}-{_MONTHS[moment.month - 1]}-{moment.year % 100:02d} {moment:%H:%M:%S}"


def parameter(context: Context, name: str = "HAND.TIME") -> float:
    value = context.engine.settings.parameter(name)
    if isinstance(value, str):
        raise IllegalValue(f"the parameter is the word {value}", "a number is wanted here")
    return value


def last_index(array: Reference) -> float:
    """Return the highest index of an array; for several dimensions, the highest first index."""
    indexes = [i for cells in (array.cells, array.locations) for i in cells if not isinstance(i, str)]
    return float(max((i[0] if isinstance(i, tuple) else i for i in indexes), default=-1))


def test_and_set(variable: Reference, new: float) -> float:
    old = variable.value()
    assert isinstance(old, float)
    variable.assign(new)
    return old


# --- the table -----------------------------------------------------------------------------------------------------

Evaluator = Callable[..., Value]

# Functions of VAL-II by name. They take the values of their arguments (None for an omitted one), or a Reference where
# the argument must be a variable.
OF_VALUES: Mapping[str, Evaluator] = {
    "ABS": abs,
    "SIGN": lambda x: -1.0 if x < 0.0 else 1.0,
    "SQR": lambda x: x * x,
    "SQRT": square_root,
    "INT": lambda x: float(math.trunc(x)),
    "FRACT": lambda x: x - math.trunc(x),
    "SIN": sine,
    "COS": cosine,
    "TAN": tangent,
    "ATAN2": lambda y, x: values.in_degrees(math.atan2(y, x)),
    "MAX": lambda *x: max(x),
    "MIN": lambda *x: min(x),
    "OUTSIDE": lambda low, x, high: truth(x < low or x > high),
    "BCD": lambda x: float(int(str(values.integer_between(x, 0, 10**_BCD_DIGITS - 1, "BCD of")), 16)),
    "DCB": from_bcd,
    "BMASK": bit_mask,
    "DX": lambda T: values.millimetres(T.px),
    "DY": lambda T: values.millimetres(T.py),
    "DZ": lambda T: values.millimetres(T.pz),
    "DISTANCE": lambda a, b: values.millimetres(transform.distance(a, b)),
    "IDENTICAL": lambda a, b: truth(a == b),
    "TRANS": trans,
    "SHIFT": shift,
    "FRAME": frame,
    "INVERSE": transform.inverse,
    "RX": lambda angle: transform.rotation_x(radians(angle)),
    "RY": lambda angle: transform.rotation_y(radians(angle)),
    "RZ": lambda angle: transform.rotation_z(radians(angle)),
    "SCALE": lambda T, factor: transform.at_position(T, *transform.scaled_vector(transform.position(T), factor)),
    "NORMAL": transform.orthonormal_frame,
    "NULL": lambda: transform.IDENTITY,
    "DEFINED": lambda variable: truth(variable.has_value()),
    "LAST": last_index,
    "TAS": test_and_set,
    "PI": lambda: math.pi,
    "TRUE": lambda: values.TRUE,
    "FALSE": lambda: values.FALSE,
    "ON": lambda: values.TRUE,
    "OFF": lambda: values.FALSE,
    "LEN": lambda text: float(len(text)),
    "ASC": code_of,
    "VAL": lambda text: (values.leading_number(text.strip()) or (0.0,))[0],
    "POS": position_of,
    "STRDIF": lambda a, b: float((a > b) - (a < b)),
    "$CHR": lambda code: chr(values.integer_between(code, 0, 255, "character")),
    "$MID": middle,
    "$DECODE": decode,
    "$ERROR": lambda code: message(values.whole(code)),
    "$ID": lambda _=None: f"vrs {__version__}",
    "$TRUNCATE": lambda text: text.split("\0", 1)[0],
    "$INTB": packer("h", -32768.0, 32767.0),
    "$LNGB": packer("i", -2147483648.0, 2147483647.0),
    "$FLTB": packer("f", -3.4028234e38, 3.4028234e38),
    "$DBLB": packer("d", -3.4028235e38, 3.4028235e38),
    "INTB": lambda text, first: _numbers_in(text, first, "h")[0],
    "LNGB": lambda text, first: _numbers_in(text, first, "i")[0],
    "FLTB": lambda text, first: _numbers_in(text, first, "f")[0],
    "DBLB": lambda text, first: _numbers_in(text, first, "d")[0],
    "$TRANSB": location_bytes,
    "TRANSB": lambda text, first: transform.orthonormal_frame(values.from_axes(_numbers_in(text, first, "12f"))),
    "FREE": free,
    "TPS": lambda: 1.0 / TICK,
    "SELECT": select_robot,
    "ROBOT.OPR": lambda _mode=None, _index=None: 0.0,
    "$DEFAULT": lambda: "./",
    "$UNPACK": unpack,
}

# Functions of VAL-II by name that also need the program's Context, as their first argument.
IN_CONTEXT: Mapping[str, Evaluator] = {
    "RANDOM": lambda it: it.environment.random.random(),
    "INRANGE": lambda it, place: float(in_range(it.engine, place)),
    "#PPOINT": precision_point,
    "HERE": lambda it: it.engine.position().T_world_tool,
    "DEST": lambda it: it.engine.destination(it.engine.end).T_world_tool,
    "TOOL": lambda it: it.engine.frames.tool,
    "BASE": lambda it: it.engine.frames.base,
    "#PDEST": lambda it: it.engine.destination(it.engine.end).joints,
    "#PHERE": lambda it: it.engine.position().joints,
    "SIG": signals_on,
    "SIG.INS": lambda it, number: truth(it.environment.signals.exists(number)),
    "BITS": lambda it, first, count: float(it.environment.signals.read_bits(first, _or(count, 1.0))),
    "TIMER": lambda it, number: it.environment.timers.read(number, it.engine.now),
    "TIME": lambda it: it.engine.now,
    "SPEED": lambda it, n: float(speed(it.engine, values.whole(n))),
    "STATE": lambda it, n: float(state(it.engine, values.whole(n))),
    "SWITCH": lambda it, name: truth(it.engine.settings.switch(name)),
    "PARAMETER": parameter,
    "HAND": lambda it: float(it.engine.position().hand),
    "HAND.TIME": parameter,
    "ERROR": lambda it, *_: float(it.environment.last_error),
    "$ENCODE": lambda it, *items: encode(items, it.environment.units)[0],
    "$TIME": clock_text,
    "STATUS": lambda it, name: float(it.environment.system.program_status(name)),
    "TASK": about_task,
    "GET.EVENT": lambda it, task: float(it.environment.system.event(_task(it, task))),  # a task has only one flag
    "CONFIG": present_configuration,
    "LATCH": lambda it, select: latched_place(it, select)[0],
    "#PLATCH": lambda it, select: latched_place(it, select)[1],
    "LATCHED": lambda it, _select: truth(it.environment.system.take_latch()),
    "PRIORITY": lambda it: float(it.environment.system.priority()),
    "ID": lambda it, component: it.environment.system.identity(values.whole(component)),
    "IOSTAT": io_status,
    "GETC": lambda it, unit, mode: float(
        it.environment.system.character(checked_unit(unit), wait=not values.whole(_or(mode, 0.0)) & NO_WAIT)
    ),
}
