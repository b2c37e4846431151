"""The functions and constants of the language: one table, read by the analyzer, the compiler, HELP and completion.

Millimetres and degrees outside, metres and radians inside. `where` is the lineage: 1 VAL, 2 VAL-II, + V+.
An implementation takes the arguments as values, None for an omitted one; with `contextual` a `Context` before them;
for an argument whose shape is a variable, a `Reference`. Sources: V+ Language Reference; val2 section 5.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import reduce
from math import cos, radians, sin, sqrt
from operator import or_

from vrs_cli import __version__, errors
from vrs_cli.errors import ArithmeticOverflow, IllegalValue, NegativeSquareRoot, VrsError
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import (
    IDENTITY,
    Transform,
    Vector,
    at_position,
    from_oat,
    inverse,
    normalised,
    position,
    rotation_x,
    rotation_y,
    rotation_z,
    translation,
)
from vrs_cli.kinematics.transform import distance as metres_between
from vrs_cli.language.ast import Kind
from vrs_cli.language.environment import Context, Reference
from vrs_cli.language.values import (
    FALSE,
    INTEGER_HIGH,
    TRUE,
    TypeItem,
    Value,
    encode,
    in_degrees,
    integer,
    integer_between,
    leading_number,
    millimetres,
    plain,
    quadrant,
    whole,
)
from vrs_cli.language.words import Argument, Shape, State


@dataclass(frozen=True)
class Function:
    """A row of the table. `constant`: written without parentheses (`PI`, `HERE`).

    `evaluate` is None for what is only recognised (`state`).
    """

    name: str
    arguments: tuple[Argument, ...]
    result: Kind
    summary: str
    example: str
    where: str
    evaluate: Callable[..., Value] | None
    constant: bool = False
    contextual: bool = False
    state: State = State.SUPPORTED

    @property
    def form(self) -> str:
        """`ATAN2(y, x)`, `SHIFT(location BY dx, dy, dz)`, `PI`."""
        if self.constant:
            return self.name
        return f"{self.name}({_form(self.arguments, self.name in WITH_BY)})"


WITH_BY = frozenset({"SHIFT", "SCALE"})  # the first argument is followed by BY, not by a comma


def _form(arguments: tuple[Argument, ...], with_by: bool) -> str:
    shown = ""
    for number, argument in enumerate(arguments):
        comma = "" if not number else " BY " if with_by and number == 1 else ", "
        item = f"{comma}{argument.name}{', ...' if argument.repeated else ''}"
        shown += f"[{item}]" if argument.optional else item
    return shown


# --- arithmetic --------------------------------------------------------------------------------------------------


def truth(condition: bool) -> float:
    """-1 or 0."""
    return TRUE if condition else FALSE


def _sign(x: float) -> float:
    return -1.0 if x < 0.0 else 1.0


def _square(x: float) -> float:
    return x * x


def _square_root(x: float) -> float:
    if x < 0.0:
        raise NegativeSquareRoot(f"SQRT({plain(x)})", "the argument must not be negative")
    return sqrt(x)


def _integer_part(x: float) -> float:
    return float(math.trunc(x))


def _fraction(x: float) -> float:
    return x - math.trunc(x)


_SINES: tuple[Callable[[float], float], ...] = (sin, cos, lambda x: -sin(x), lambda x: -cos(x))


def _sine(angle: float) -> float:
    right_angles, rest = quadrant(angle)
    return _SINES[right_angles](rest) + 0.0


def _cosine(angle: float) -> float:
    right_angles, rest = quadrant(angle)
    return _SINES[(right_angles + 1) % 4](rest) + 0.0


def _tangent(angle: float) -> float:
    cosine = _cosine(angle)
    if cosine == 0.0:
        raise ArithmeticOverflow(f"TAN({plain(angle)})", "the tangent of a right angle is infinite")
    return _sine(angle) / cosine


def _arc_tangent(y: float, x: float) -> float:
    return in_degrees(math.atan2(y, x))


def _outside(low: float, value: float, high: float) -> float:
    return truth(value < low or value > high)


def modulo(a: float, b: float) -> float:
    """`a MOD b`: both rounded to integers; the sign is that of a. Raises ArithmeticOverflow for b = 0."""
    dividend, divisor = integer(a), integer(b)
    if divisor == 0:
        raise ArithmeticOverflow(f"{plain(a)} MOD {plain(b)}", "the divisor is 0")
    return float(math.fmod(dividend, divisor)) + 0.0


def power(a: float, b: float) -> float:
    """`a ** b`. Raises ArithmeticOverflow, and IllegalValue for the root of a negative number."""
    if a < 0.0 and b != math.trunc(b):
        raise IllegalValue(f"{plain(a)} ** {plain(b)}", "a negative number has whole powers only")
    try:
        return float(a**b)
    except (OverflowError, ZeroDivisionError):
        raise ArithmeticOverflow(f"{plain(a)} ** {plain(b)}") from None


# --- bits --------------------------------------------------------------------------------------------------------

_BCD_DIGITS = 6  # four bits each fill 24


def _to_bcd(x: float) -> float:
    digits = integer_between(x, 0, 10**_BCD_DIGITS - 1, "BCD of")
    return float(int(str(digits), 16))


def _from_bcd(x: float) -> float:
    text = format(integer_between(x, 0, INTEGER_HIGH, "DCB of"), "x")
    if not text.isdecimal():
        raise IllegalValue(f"DCB({plain(x)})", "every four bits must be a digit from 0 to 9")
    return float(int(text))


def _bit_mask(*bits: float) -> float:
    masks = (1 << (integer_between(bit, 1, 24, "bit") - 1) for bit in bits)
    return float(reduce(or_, masks, 0))


def _signal(context: Context, *numbers: float) -> float:
    states = [context.environment.signals.read(number) for number in numbers]
    return truth(all(states))


def _signal_installed(context: Context, number: float) -> float:
    return truth(context.environment.signals.exists(number))


def _bits(context: Context, first: float, count: float | None) -> float:
    return float(context.environment.signals.read_bits(first, 1.0 if count is None else count))


# --- locations ---------------------------------------------------------------------------------------------------


NULL_ANGLES = (90.0, -90.0, 0.0)  # O, A, T of the identity (val2 section 6.2)


def _distance(a: Transform, b: Transform) -> float:
    return millimetres(metres_between(a, b))


def _or(number: float | None, default: float) -> float:
    return default if number is None else number


def _trans(*numbers: float | None) -> Transform:
    x, y, z = (_or(number, 0.0) / 1000.0 for number in numbers[:3])
    angles = numbers[3:]
    if all(angle is None for angle in angles):
        return translation(x, y, z)  # exactly, without the rounding of two right angles
    o, a, t = map(_or, angles, NULL_ANGLES)
    return from_oat(x, y, z, radians(o), radians(a), radians(t))


def _precision_point(context: Context, *joints: float | None) -> Joints:
    dof = context.robot.dof
    if any(joint is not None for joint in joints[dof:]):
        raise IllegalValue(f"{len(joints)} joint angles", f"the robot has {dof} joints")
    return tuple(radians(_or(joint, 0.0)) for joint in (*joints, *(None,) * dof)[:dof])


def _shift(T: Transform, dx: float | None, dy: float | None = None, dz: float | None = None) -> Transform:
    x, y, z = position(T)
    return at_position(T, x + _or(dx, 0.0) / 1000.0, y + _or(dy, 0.0) / 1000.0, z + _or(dz, 0.0) / 1000.0)


def _scale(T: Transform, factor: float) -> Transform:
    x, y, z = position(T)
    return at_position(T, x * factor, y * factor, z * factor)


def _difference(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _direction(v: Vector, problem: str) -> Vector:
    length = math.hypot(*v)
    if length < 1e-9:
        raise IllegalValue(f"FRAME: {problem}", "give three positions that are not on one line")
    return v[0] / length, v[1] / length, v[2] / length


def _frame(a: Transform, b: Transform, c: Transform, d: Transform | None) -> Transform:
    x = _direction(_difference(position(b), position(a)), "the first two positions are the same")
    to_c = _difference(position(c), position(a))
    z = _direction(_cross(x, to_c), "the third position is on the line of the first two")
    y = _cross(z, x)
    origin = position(a if d is None else d)
    return Transform(
        x[0], y[0], z[0], origin[0], x[1], y[1], z[1], origin[1], x[2], y[2], z[2], origin[2]
    )  # fmt: skip


# --- strings -----------------------------------------------------------------------------------------------------


def _code_of(text: str, index: float | None) -> float:
    place = whole(_or(index, 1.0))
    if place < 1:
        raise IllegalValue(f"character {place} of a string", "characters count from 1")
    return float(ord(text[place - 1])) if place <= len(text) else -1.0


def _value_of(text: str) -> float:
    found = leading_number(text.strip())
    return 0.0 if found is None else found[0]


def _position_of(text: str, part: str, start: float | None) -> float:
    first = max(whole(_or(start, 1.0)), 1)
    return float(text.find(part, first - 1) + 1) if part else 0.0


def _compare(a: str, b: str) -> float:
    return float((a > b) - (a < b))


def _character(code: float) -> str:
    return chr(integer_between(code, 0, 255, "character"))


def _middle(text: str, first: float, count: float | None) -> str:
    start = whole(first)
    if start < 1:
        raise IllegalValue(f"character {start} of a string", "characters count from 1")
    size = len(text) if count is None else max(whole(count), 0)
    return text[start - 1 : start - 1 + size]


def _encode(*items: TypeItem) -> str:
    return encode(items)[0]


def _decode(source: Reference, separators: str, mode: float | None) -> str:
    """The head of the string up to a separator, or of separators alone; the string keeps the rest."""
    text = source.value()
    assert isinstance(text, str)
    wanted = whole(_or(mode, 0.0)) > 0
    size = next((i for i, c in enumerate(text) if (c in separators) is not wanted), len(text))
    source.assign(text[size:])
    return text[:size]


def _truncate(text: str) -> str:
    return text.split("\0", 1)[0]


def _packer(code: str, low: float, high: float) -> Callable[[float], str]:
    """A number as the bytes of a big-endian binary form, a character a byte."""

    def pack(x: float) -> str:
        if not low <= x <= high:
            raise IllegalValue(plain(x), f"{plain(low)} to {plain(high)} can be packed")
        return struct.pack(f">{code}", x if code in "fd" else whole(x)).decode("latin-1")

    return pack


def _unpacker(code: str) -> Callable[[str, float | None], float]:
    def unpack(text: str, first: float | None) -> float:
        start = whole(_or(first, 1.0)) - 1
        size = struct.calcsize(code)
        piece = text[start : start + size] if start >= 0 else ""
        if len(piece) < size:
            raise IllegalValue(f"{len(piece)} characters", f"{size} are wanted from there on")
        return float(struct.unpack(f">{code}", piece.encode("latin-1", "replace"))[0])

    return unpack


# --- the system --------------------------------------------------------------------------------------------------

# Messages that are no errors (V+ Language Reference, system messages).
MESSAGES = {1: "Success", 3: "Program completed", 8: "(HALTED)", 9: "(PAUSED)"}


def _subclasses(cls: type[VrsError]) -> list[type[VrsError]]:
    return [cls, *(found for child in cls.__subclasses__() for found in _subclasses(child))]


def message(code: int) -> str:
    """The text of a message code, `Unknown error code n` for one that is not used."""
    if code in MESSAGES:
        return MESSAGES[code]
    if code == errors.JointOutOfRange.code:
        return "Joint out of range"
    texts = {cls.code: cls.text for cls in reversed(_subclasses(VrsError))}
    return texts.get(code, f"Unknown error code {code}")


_MONTHS = ("Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec")
_FIRST_DAY = 1984  # the robot clock is counted from the first day of VAL-II's year: the same text every run


def _clock_text(context: Context) -> str:
    from datetime import datetime, timedelta

    moment = datetime(_FIRST_DAY, 1, 1) + timedelta(seconds=math.floor(context.robot.time()))
    return f"{moment.day:02d}-{_MONTHS[moment.month - 1]}-{moment.year % 100:02d} {moment:%H:%M:%S}"


def _number_or_overflow(value: float | str) -> float:
    if isinstance(value, str):
        raise IllegalValue(f"the parameter is the word {value}", "a number is wanted here")
    return value


def _last_index(array: Reference) -> float:
    indexes = [i for cells in (array.cells, array.locations) for i in cells if isinstance(i, int)]
    return float(max(indexes, default=-1))


def _test_and_set(variable: Reference, new: float) -> float:
    old = variable.value()
    assert isinstance(old, float)
    variable.assign(new)
    return old


def _identical(a: Transform, b: Transform) -> float:
    return truth(a == b)


# --- the table ---------------------------------------------------------------------------------------------------


def _real(name: str, optional: bool = False, repeated: bool = False) -> Argument:
    return Argument(name, Shape.REAL, optional, repeated)


def _string(name: str) -> Argument:
    return Argument(name, Shape.STRING)


def _location(name: str, optional: bool = False) -> Argument:
    return Argument(name, Shape.LOCATION, optional)


_X = (_real("x"),)
_ANGLE = (_real("degrees"),)
_TASK = (_real("task"), _real("select", optional=True))
_MORE = (_real("a"), _real("b", optional=True, repeated=True))
_JOINTS = tuple(_real(f"j{number}", optional=True) for number in range(1, 7))
_AT = _real("first", optional=True)

_ARITHMETIC = (
    Function("ABS", _X, Kind.REAL, "the value without its sign", "ABS(-3)", "2 +", abs),
    Function("SIGN", _X, Kind.REAL, "-1 for a negative number, otherwise 1", "SIGN(x)", "2 +", _sign),
    Function("SQR", _X, Kind.REAL, "the square", "SQR(3)", "2 +", _square),
    Function("SQRT", _X, Kind.REAL, "the square root", "SQRT(2)", "2 +", _square_root),
    Function("INT", _X, Kind.REAL, "the integer part, cut toward 0", "INT(-2.7)", "2 +", _integer_part),
    Function("FRACT", _X, Kind.REAL, "what INT cuts off, with its sign", "FRACT(2.75)", "2 +", _fraction),
    Function("SIN", _ANGLE, Kind.REAL, "the sine of an angle in degrees", "SIN(30)", "2 +", _sine),
    Function("COS", _ANGLE, Kind.REAL, "the cosine of an angle in degrees", "COS(60)", "2 +", _cosine),
    Function("TAN", _ANGLE, Kind.REAL, "the tangent of an angle in degrees", "TAN(45)", "2 +", _tangent),
    Function(
        "ATAN2", (_real("y"), _real("x")), Kind.REAL,
        "the angle in degrees, -180 to 180, whose tangent is y/x", "ATAN2(1, -1)", "2 +", _arc_tangent,
    ),
    Function("MAX", _MORE, Kind.REAL, "the largest of its arguments", "MAX(a, b, 10)", "2 +", lambda *x: max(x)),
    Function("MIN", _MORE, Kind.REAL, "the smallest of its arguments", "MIN(a, b)", "2 +", lambda *x: min(x)),
    Function(
        "RANDOM", (), Kind.REAL, "a random number from 0 up to 1; every run begins with the same one",
        "x = 10*RANDOM", "2 +", lambda context: context.environment.random.random(),
        constant=True, contextual=True,
    ),
    Function(
        "OUTSIDE", (_real("low"), _real("value"), _real("high")), Kind.REAL,
        "TRUE where the value is below low or above high", "OUTSIDE(0, x, 10)", "2 +", _outside,
    ),
    Function("BCD", _X, Kind.REAL, "the digits of an integer, four bits each", "BCD(93)", "+", _to_bcd),
    Function("DCB", _X, Kind.REAL, "the integer of digits of four bits each", "DCB(147)", "+", _from_bcd),
    Function(
        "BMASK", (_real("bit"), _real("bits", optional=True, repeated=True)), Kind.REAL,
        "an integer with these bits set, 1 the lowest, 24 the highest", "BMASK(1, 3)", "+", _bit_mask,
    ),
)  # fmt: skip

_LOCATIONS = (
    Function(
        "DX", (_location("location"),), Kind.REAL, "X of a transformation in mm", "DX(HERE)", "2 +",
        lambda T: millimetres(T.px),
    ),
    Function(
        "DY", (_location("location"),), Kind.REAL, "Y of a transformation in mm", "DY(part)", "2 +",
        lambda T: millimetres(T.py),
    ),
    Function(
        "DZ", (_location("location"),), Kind.REAL, "Z of a transformation in mm", "DZ(part)", "2 +",
        lambda T: millimetres(T.pz),
    ),
    Function(
        "DISTANCE", (_location("a"), _location("b")), Kind.REAL,
        "the distance of two transformations in mm", "DISTANCE(a, HERE)", "2 +", _distance,
    ),
    Function(
        "INRANGE", (Argument("location", Shape.PLACE),), Kind.REAL,
        "0 where the robot can reach the location, otherwise the reasons as bits", "IF INRANGE(p) == 0 THEN",
        "2 +", lambda context, place: float(context.robot.in_range(place)), contextual=True,
    ),
    Function(
        "IDENTICAL", (_location("a"), _location("b")), Kind.REAL,
        "TRUE where two transformations are the same to the last digit", "IDENTICAL(a, b)", "+", _identical,
    ),
    Function(
        "TRANS", tuple(_real(name, optional=True) for name in ("x", "y", "z", "o", "a", "t")), Kind.LOCATION,
        "a transformation from X, Y, Z in mm and O, A, T in degrees; what is missing is that of NULL: "
        "0, 0, 0, 90, -90, 0", "SET p = TRANS(500, 150, -100, 90, 90, 0)", "2 +", _trans,
    ),
    Function(
        "#PPOINT", _JOINTS, Kind.PRECISION, "a precision point from joint angles in degrees; missing ones are 0",
        "MOVE #PPOINT(0, -90, 90)", "2 +", _precision_point, contextual=True,
    ),
    Function(
        "SHIFT",
        (_location("location"), *(_real(name, optional=True) for name in ("dx", "dy", "dz"))), Kind.LOCATION,
        "the transformation moved along the axes of the world by so many mm", "SHIFT(a BY 5, -5, 10)", "2 +", _shift,
    ),
    Function(
        "FRAME", (_location("a"), _location("b"), _location("c"), _location("d", optional=True)), Kind.LOCATION,
        "a frame with its origin at d (at a if it is missing), X from a to b, and c on the +Y side",
        "SET pallet = FRAME(a, b, c, a)", "2 +", _frame,
    ),
    Function(
        "INVERSE", (_location("location"),), Kind.LOCATION, "the inverse transformation", "INVERSE(a):b", "2 +",
        inverse,
    ),
    Function(
        "RX", _ANGLE, Kind.LOCATION, "a turn about X by degrees", "SET b = a:RX(90)", "+",
        lambda angle: rotation_x(radians(angle)),
    ),
    Function(
        "RY", _ANGLE, Kind.LOCATION, "a turn about Y by degrees", "SET b = a:RY(90)", "+",
        lambda angle: rotation_y(radians(angle)),
    ),
    Function(
        "RZ", _ANGLE, Kind.LOCATION, "a turn about Z by degrees", "SET b = a:RZ(90)", "+",
        lambda angle: rotation_z(radians(angle)),
    ),
    Function(
        "SCALE", (_location("location"), _real("factor")), Kind.LOCATION,
        "the transformation with X, Y, Z multiplied", "SCALE(a BY 0.5)", "+", _scale,
    ),
    Function(
        "NORMAL", (_location("location"),), Kind.LOCATION,
        "the transformation with its axes made perpendicular and of length one again", "SET a = NORMAL(a)", "+",
        normalised,
    ),
    Function(
        "HERE", (), Kind.LOCATION, "where the tool is now", "SET p = HERE", "2 +",
        lambda context: context.robot.here(), constant=True, contextual=True,
    ),
    Function(
        "DEST", (), Kind.LOCATION, "where the last motion ends", "MOVES SHIFT(DEST BY ,,50)", "2 +",
        lambda context: context.robot.destination(), constant=True, contextual=True,
    ),
    Function(
        "TOOL", (), Kind.LOCATION, "the tool transformation", "SET t = TOOL", "2 +",
        lambda context: context.robot.tool(), constant=True, contextual=True,
    ),
    Function(
        "BASE", (), Kind.LOCATION, "the base transformation: the world seen from the robot", "SET b = BASE", "2 +",
        lambda context: context.robot.base(), constant=True, contextual=True,
    ),
    Function("NULL", (), Kind.LOCATION, "the transformation that changes nothing", "TOOL NULL", "2 +",
             lambda: IDENTITY, constant=True),
    Function(
        "#PDEST", (), Kind.PRECISION, "the joints where the last motion ends", "SET #p = #PDEST", "2 +",
        lambda context: context.robot.destination_joints(), constant=True, contextual=True,
    ),
    Function(
        "#PHERE", (), Kind.PRECISION, "the joints now", "SET #p = #PHERE", "+",
        lambda context: context.robot.joints(), constant=True, contextual=True,
    ),
)  # fmt: skip

_SIGNALS = (
    Function(
        "SIG", (_real("signal"), _real("signals", optional=True, repeated=True)), Kind.REAL,
        "TRUE where all these signals are on (off for negative numbers)", "WAIT SIG(1001, -1002)", "2 +",
        _signal, contextual=True,
    ),
    Function(
        "SIG.INS", (_real("signal"),), Kind.REAL, "TRUE where there is a signal of that number", "SIG.INS(1001)",
        "2 +", _signal_installed, contextual=True,
    ),
    Function(
        "BITS", (_real("first"), _real("count", optional=True)), Kind.REAL,
        "signals as a binary number, the first one its lowest bit", "part = BITS(1001, 4)", "2 +",
        _bits, contextual=True,
    ),
    Function(
        "TIMER", (_real("timer"),), Kind.REAL, "seconds since a timer was set", "WAIT TIMER(1) > 2", "2 +",
        lambda context, number: context.environment.timers.read(number, context.robot.time()), contextual=True,
    ),
    Function(
        "TIME", (), Kind.REAL, "the robot clock in seconds", "t = TIME()", "2 +",
        lambda context: context.robot.time(), contextual=True,
    ),
)  # fmt: skip

_SYSTEM = (
    Function(
        "SPEED", (_real("which"),), Kind.REAL,
        "1: the monitor speed, 2: the program speed in force, 3: that of the next motion, in percent",
        "SPEED(2)", "2 +", lambda context, n: float(context.robot.speed(whole(n))), contextual=True,
    ),
    Function(
        "STATE", (_real("which"),), Kind.REAL,
        "1: what the robot does (7 under program control), 2: its motion (0 none yet, 1 moving, 2 stopped as planned)",
        "STATE(2)", "2 +", lambda context, n: float(context.robot.state(whole(n))), contextual=True,
    ),
    Function(
        "SWITCH", (Argument("switch", Shape.SWITCH),), Kind.REAL, "TRUE where a switch is enabled", "SWITCH(CP)",
        "2 +", lambda context, name: truth(context.robot.switch(name)), contextual=True,
    ),
    Function(
        "PARAMETER", (Argument("parameter", Shape.PARAMETER_NAME),), Kind.REAL, "the value of a parameter",
        "PARAMETER(HAND.TIME)", "2 +",
        lambda context, name: _number_or_overflow(context.robot.parameter(name)), contextual=True,
    ),
    Function(
        "HAND", (), Kind.REAL, "the opening of the hand: 1 open, 0 closed", "IF HAND == 0 THEN", "2 +",
        lambda context: float(context.robot.hand()), constant=True, contextual=True,
    ),
    Function(
        "HAND.TIME", (), Kind.REAL, "seconds that the hand is given to open or close", "DELAY HAND.TIME", "2 +",
        lambda context: _number_or_overflow(context.robot.parameter("HAND.TIME")), constant=True, contextual=True,
    ),
    Function(
        "ERROR", _TASK, Kind.REAL, "the code of the latest error, 0 if there was none", "TYPE $ERROR(ERROR(0))",
        "2 +", lambda context, *_: float(context.environment.last_error), contextual=True,
    ),
    Function(
        "DEFINED", (Argument("variable", Shape.VARIABLE),), Kind.REAL, "TRUE where a variable has a value",
        "IF NOT DEFINED(part) THEN", "+", lambda variable: truth(variable.defined()),
    ),
    Function(
        "LAST", (Argument("array", Shape.VARIABLE),), Kind.REAL,
        "the highest index of an array that has a value, -1 if none has", "LAST(row[])", "+", _last_index,
    ),
    Function(
        "TAS", (Argument("variable", Shape.REAL_VARIABLE), _real("new")), Kind.REAL,
        "the value of a variable, which then gets a new one", "TAS(busy, TRUE)", "+", _test_and_set,
    ),
    Function("PI", (), Kind.REAL, "3.14159...", "2*PI*r", "2 +", lambda: math.pi, constant=True),
    Function("TRUE", (), Kind.REAL, "-1", "done = TRUE", "2 +", lambda: TRUE, constant=True),
    Function("FALSE", (), Kind.REAL, "0", "done = FALSE", "2 +", lambda: FALSE, constant=True),
    Function("ON", (), Kind.REAL, "-1", "SWITCH CP = ON", "2 +", lambda: TRUE, constant=True),
    Function("OFF", (), Kind.REAL, "0", "SWITCH CP = OFF", "2 +", lambda: FALSE, constant=True),
)  # fmt: skip

_STRINGS = (
    Function("LEN", (_string("$s"),), Kind.REAL, "the number of characters", "LEN($s)", "2 +",
             lambda text: float(len(text))),
    Function(
        "ASC", (_string("$s"), _real("index", optional=True)), Kind.REAL,
        "the code of a character, counted from 1; -1 beyond the end", "ASC($s, 2)", "2 +", _code_of,
    ),
    Function("VAL", (_string("$s"),), Kind.REAL, "the number that a string begins with, 0 if none",
             'VAL("12.5 mm")', "2 +", _value_of),
    Function(
        "POS", (_string("$s"), _string("$part"), _real("start", optional=True)), Kind.REAL,
        "where a part begins in a string, counted from 1; 0 if it is not there", 'POS("part.v2", ".")', "2 +",
        _position_of,
    ),
    Function("STRDIF", (_string("$a"), _string("$b")), Kind.REAL, "-1, 0 or 1: $a before, equal to or after $b",
             "STRDIF($a, $b)", "2 +", _compare),
    Function("$CHR", (_real("code"),), Kind.STRING, "the character of a code", "$CHR(34)", "2 +", _character),
    Function(
        "$MID", (_string("$s"), _real("first"), _real("count", optional=True)), Kind.STRING,
        "part of a string: so many characters from the first, counted from 1", "$MID($s, 1, 3)", "2 +", _middle,
    ),
    Function(
        "$ENCODE", (Argument("item", Shape.ITEM), Argument("items", Shape.ITEM, optional=True, repeated=True)),
        Kind.STRING, "what TYPE would print, as a string", "$s = $ENCODE(/F6.2, x)", "2 +", _encode,
    ),
    Function(
        "$DECODE",
        (Argument("$variable", Shape.STRING_VARIABLE), _string("$separators"), _real("mode", optional=True)),
        Kind.STRING,
        "takes the front of a string up to a separator (mode 1: the separators) and leaves the rest in the variable",
        '$word = $DECODE($line, " ,", 0)', "2 +", _decode,
    ),
    Function("$ERROR", (_real("code"),), Kind.STRING, "the text of an error code", "$ERROR(-610)", "2 +",
             lambda code: message(whole(code))),
    Function("$TIME", (), Kind.STRING, "the robot clock as date and time, counted from 01-Jan-84", "TYPE $TIME()",
             "+", _clock_text, contextual=True),
    Function("$ID", (_real("which", optional=True),), Kind.STRING, "name and version of the system", "TYPE $ID()",
             "+", lambda _=None: f"vrs {__version__}"),
    Function("$TRUNCATE", (_string("$s"),), Kind.STRING, "the string up to its first zero character",
             "$TRUNCATE($s)", "+", _truncate),
    Function("$INTB", _X, Kind.STRING, "an integer as two characters", "$INTB(500)", "+",
             _packer("h", -32768.0, 32767.0)),
    Function("$LNGB", _X, Kind.STRING, "an integer as four characters", "$LNGB(70000)", "+",
             _packer("i", -2147483648.0, 2147483647.0)),
    Function("$FLTB", _X, Kind.STRING, "a real in single precision as four characters", "$FLTB(1.5)", "+",
             _packer("f", -3.4028234e38, 3.4028234e38)),
    Function("$DBLB", _X, Kind.STRING, "a real in double precision as eight characters", "$DBLB(1.5)", "+",
             _packer("d", -3.4028235e38, 3.4028235e38)),
    Function("INTB", (_string("$s"), _AT), Kind.REAL, "the integer of two characters of a string", "INTB($s)", "+",
             _unpacker("h")),
    Function("LNGB", (_string("$s"), _AT), Kind.REAL, "the integer of four characters of a string", "LNGB($s, 3)",
             "+", _unpacker("i")),
    Function("FLTB", (_string("$s"), _AT), Kind.REAL, "the single-precision real of four characters", "FLTB($s)",
             "+", _unpacker("f")),
    Function("DBLB", (_string("$s"), _AT), Kind.REAL, "the double-precision real of eight characters", "DBLB($s)",
             "+", _unpacker("d")),
)  # fmt: skip


def _planned(name: str, arguments: tuple[Argument, ...], summary: str, result: Kind = Kind.REAL) -> Function:
    return Function(name, arguments, result, summary, f"{name}", "+", None, state=State.PLANNED)


_LATER = (
    _planned("STATUS", (_string("$program"),), "what a program is doing"),
    _planned("TASK", _TASK, "about the tasks that run"),
    _planned("PRIORITY", (), "the priority of the program"),
    _planned("FREE", (_real("which"),), "how much memory is free"),
    _planned("ID", _TASK, "numbers of the controller's parts"),
    _planned("IOSTAT", (_real("unit"), _real("mode", optional=True)), "the outcome of the last input or output"),
    _planned("GETC", (_real("unit"), _real("mode", optional=True)), "one character read from a unit"),
    _planned("DEVICE", (_real("type"), _real("unit", optional=True)), "about a device"),
    _planned("KEYMODE", (_real("key"), _real("mode", optional=True)), "how a pendant key behaves"),
    _planned("PENDANT", (_real("key"),), "the state of the pendant"),
    _planned("LATCH", (_real("select", optional=True),), "where the robot was when a signal came", Kind.LOCATION),
    _planned("$UNPACK", (_string("$array"), _real("first"), _real("count")), "part of a string array", Kind.STRING),
    _planned("$DEFAULT", (), "the default disk and folder", Kind.STRING),
)

FUNCTIONS: Mapping[str, Function] = {
    function.name: function
    for group in (_ARITHMETIC, _LOCATIONS, _SIGNALS, _SYSTEM, _STRINGS, _LATER)
    for function in group
}
