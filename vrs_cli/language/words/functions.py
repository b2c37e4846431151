"""The functions and constants of the language: one table, read by the analyzer, the compiler, HELP and completion.

Millimetres and degrees outside, metres and radians inside. `where` is the lineage: 1 VAL, 2 VAL-II, + V+.
An implementation takes the arguments as values, None for an omitted one; with `contextual` a `Context` before them;
for an argument whose shape is a variable, a `Reference`. Sources: V+ Language Reference; val2 section 5.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import radians

from vrs_cli import __version__
from vrs_cli.kinematics.transform import IDENTITY, inverse, normalised, rotation_x, rotation_y, rotation_z
from vrs_cli.language.run.operations import (
    about_task,
    arc_tangent,
    bit_mask,
    bits_of,
    character,
    clock_text,
    code_of,
    cosine,
    decoded,
    distance,
    encoded,
    fraction,
    frame,
    free,
    from_bcd,
    identical,
    integer_part,
    io_status,
    last_index,
    message,
    middle,
    next_character,
    numeric,
    outside,
    packer,
    position_of,
    precision_point,
    scale,
    shift,
    sign,
    signal_installed,
    signals_on,
    sine,
    square,
    square_root,
    string_order,
    tangent,
    test_and_set,
    to_bcd,
    trans,
    truncate,
    truth,
    unpacked,
    unpacker,
    value_of,
)
from vrs_cli.language.words.kind import Kind
from vrs_cli.language.words.values import FALSE, TRUE, Value, millimetres, whole
from vrs_cli.language.words.word import Argument, Shape, State


@dataclass(frozen=True)
class Function:
    """A row of the table. `constant`: written without parentheses (`PI`, `HERE`).

    `evaluate` is None for what is only recognised (`state`), and `note` says why.
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
    note: str = ""

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


# --- the table ---------------------------------------------------------------------------------------------------


def _real(name: str, optional: bool = False, repeated: bool = False) -> Argument:
    return Argument(name, Shape.REAL, optional, repeated)


def _string(name: str) -> Argument:
    return Argument(name, Shape.STRING)


def _location(name: str, optional: bool = False) -> Argument:
    return Argument(name, Shape.LOCATION, optional)


_X = (_real("x"),)
_ANGLE = (_real("degrees"),)
_TASK = (_real("task"), _real("select", optional=True))  # of ERROR
_MORE = (_real("a"), _real("b", optional=True, repeated=True))
_JOINTS = (
    *(_real(f"j{number}", optional=True) for number in range(1, 7)),
    _real("j", optional=True, repeated=True),
)
_AT = _real("first", optional=True)

_ARITHMETIC = (
    Function("ABS", _X, Kind.REAL, "the value without its sign", "ABS(-3)", "2 +", abs),
    Function("SIGN", _X, Kind.REAL, "-1 for a negative number, otherwise 1", "SIGN(x)", "2 +", sign),
    Function("SQR", _X, Kind.REAL, "the square", "SQR(3)", "2 +", square),
    Function("SQRT", _X, Kind.REAL, "the square root", "SQRT(2)", "2 +", square_root),
    Function("INT", _X, Kind.REAL, "the integer part, cut toward 0", "INT(-2.7)", "2 +", integer_part),
    Function("FRACT", _X, Kind.REAL, "what INT cuts off, with its sign", "FRACT(2.75)", "2 +", fraction),
    Function("SIN", _ANGLE, Kind.REAL, "the sine of an angle in degrees", "SIN(30)", "2 +", sine),
    Function("COS", _ANGLE, Kind.REAL, "the cosine of an angle in degrees", "COS(60)", "2 +", cosine),
    Function("TAN", _ANGLE, Kind.REAL, "the tangent of an angle in degrees", "TAN(45)", "2 +", tangent),
    Function(
        "ATAN2", (_real("y"), _real("x")), Kind.REAL,
        "the angle in degrees, -180 to 180, whose tangent is y/x", "ATAN2(1, -1)", "2 +", arc_tangent,
    ),
    Function("MAX", _MORE, Kind.REAL, "the largest of its arguments", "MAX(x, y, 10)", "2 +", lambda *x: max(x)),
    Function("MIN", _MORE, Kind.REAL, "the smallest of its arguments", "MIN(x, y)", "2 +", lambda *x: min(x)),
    Function(
        "RANDOM", (), Kind.REAL, "a random number from 0 up to 1; every run begins with the same one",
        "x = 10*RANDOM", "2 +", lambda context: context.environment.random.random(),
        constant=True, contextual=True,
    ),
    Function(
        "OUTSIDE", (_real("low"), _real("value"), _real("high")), Kind.REAL,
        "TRUE where the value is below low or above high", "OUTSIDE(0, x, 10)", "2 +", outside,
    ),
    Function("BCD", _X, Kind.REAL, "the digits of an integer, four bits each", "BCD(93)", "+", to_bcd),
    Function("DCB", _X, Kind.REAL, "the integer of digits of four bits each", "DCB(147)", "+", from_bcd),
    Function(
        "BMASK", (_real("bit"), _real("bits", optional=True, repeated=True)), Kind.REAL,
        "an integer with these bits set, 1 the lowest, 24 the highest", "BMASK(1, 3)", "+", bit_mask,
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
        "the distance of two transformations in mm", "DISTANCE(a, HERE)", "2 +", distance,
    ),
    Function(
        "INRANGE", (Argument("location", Shape.PLACE),), Kind.REAL,
        "0 where the robot can reach the location, otherwise the reasons as bits", "IF INRANGE(p) == 0 THEN",
        "2 +", lambda context, place: float(context.robot.in_range(place)), contextual=True,
    ),
    Function(
        "IDENTICAL", (_location("a"), _location("b")), Kind.REAL,
        "TRUE where two transformations are the same to the last digit", "IDENTICAL(a, b)", "+", identical,
    ),
    Function(
        "TRANS", tuple(_real(name, optional=True) for name in ("x", "y", "z", "o", "a", "t")), Kind.LOCATION,
        "a transformation from X, Y, Z in mm and O, A, T in degrees; what is missing is that of NULL: "
        "0, 0, 0, 90, -90, 0", "SET p = TRANS(500, 150, -100, 90, 90, 0)", "2 +", trans,
    ),
    Function(
        "#PPOINT", _JOINTS, Kind.PRECISION,
        "a precision point from joints in degrees, in mm where they slide; missing ones are 0",
        "MOVE #PPOINT(0, -90, 90)", "2 +", precision_point, contextual=True,
    ),
    Function(
        "SHIFT",
        (_location("location"), *(_real(name, optional=True) for name in ("dx", "dy", "dz"))), Kind.LOCATION,
        "the transformation moved along the axes of the world by so many mm", "SHIFT(a BY 5, -5, 10)", "2 +", shift,
    ),
    Function(
        "FRAME", (_location("a"), _location("b"), _location("c"), _location("d", optional=True)), Kind.LOCATION,
        "a frame with its origin at d (at a if it is missing), X from a to b, and c on the +Y side",
        "SET pallet = FRAME(a, b, c, a)", "2 +", frame,
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
        "the transformation with X, Y, Z multiplied", "SCALE(a BY 0.5)", "+", scale,
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
        "TOOL", (), Kind.LOCATION, "the tool transformation", "SET grip = TOOL", "2 +",
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
        signals_on, contextual=True,
    ),
    Function(
        "SIG.INS", (_real("signal"),), Kind.REAL, "TRUE where there is a signal of that number", "SIG.INS(1001)",
        "2 +", signal_installed, contextual=True,
    ),
    Function(
        "BITS", (_real("first"), _real("count", optional=True)), Kind.REAL,
        "signals as a binary number, the first one its lowest bit", "count = BITS(1001, 4)", "2 +",
        bits_of, contextual=True,
    ),
    Function(
        "TIMER", (_real("timer"),), Kind.REAL, "seconds since a timer was set", "WAIT TIMER(1) > 2", "2 +",
        lambda context, number: context.environment.timers.read(number, context.robot.time()), contextual=True,
    ),
    Function(
        "TIME", (), Kind.REAL, "the robot clock in seconds", "t = TIME", "2 +",
        lambda context: context.robot.time(), constant=True, contextual=True,
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
        lambda context, name: numeric(context.robot.parameter(name)), contextual=True,
    ),
    Function(
        "HAND", (), Kind.REAL, "the opening of the hand: 1 open, 0 closed", "IF HAND == 0 THEN", "2 +",
        lambda context: float(context.robot.hand()), constant=True, contextual=True,
    ),
    Function(
        "HAND.TIME", (), Kind.REAL, "seconds that the hand is given to open or close", "DELAY HAND.TIME", "2 +",
        lambda context: numeric(context.robot.parameter("HAND.TIME")), constant=True, contextual=True,
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
        "the highest index of an array that has a value, -1 if none has", "LAST(row[])", "+", last_index,
    ),
    Function(
        "TAS", (Argument("variable", Shape.REAL_VARIABLE), _real("new")), Kind.REAL,
        "the value of a variable, which then gets a new one", "TAS(busy, TRUE)", "+", test_and_set,
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
        "the code of a character, counted from 1; -1 beyond the end", "ASC($s, 2)", "2 +", code_of,
    ),
    Function("VAL", (_string("$s"),), Kind.REAL, "the number that a string begins with, 0 if none",
             'VAL("12.5 mm")', "2 +", value_of),
    Function(
        "POS", (_string("$s"), _string("$part"), _real("start", optional=True)), Kind.REAL,
        "where a part begins in a string, counted from 1; 0 if it is not there", 'POS("part.v2", ".")', "2 +",
        position_of,
    ),
    Function("STRDIF", (_string("$a"), _string("$b")), Kind.REAL, "-1, 0 or 1: $a before, equal to or after $b",
             "STRDIF($a, $b)", "2 +", string_order),
    Function("$CHR", (_real("code"),), Kind.STRING, "the character of a code", "$CHR(34)", "2 +", character),
    Function(
        "$MID", (_string("$s"), _real("first"), _real("count", optional=True)), Kind.STRING,
        "part of a string: so many characters from the first, counted from 1", "$MID($s, 1, 3)", "2 +", middle,
    ),
    Function(
        "$ENCODE", (Argument("item", Shape.ITEM), Argument("items", Shape.ITEM, optional=True, repeated=True)),
        Kind.STRING, "what TYPE would print, as a string", "$s = $ENCODE(/F6.2, x)", "2 +", encoded, contextual=True,
    ),
    Function(
        "$DECODE",
        (Argument("$variable", Shape.STRING_VARIABLE), _string("$separators"), _real("mode", optional=True)),
        Kind.STRING,
        "takes the front of a string up to a separator (mode 1: the separators) and leaves the rest in the variable",
        '$word = $DECODE($line, " ,", 0)', "2 +", decoded,
    ),
    Function("$ERROR", (_real("code"),), Kind.STRING, "the text of an error code", "$ERROR(-610)", "2 +",
             lambda code: message(whole(code))),
    Function("$TIME", (), Kind.STRING, "the robot clock as date and time, counted from 01-Jan-84", "TYPE $TIME",
             "+", clock_text, constant=True, contextual=True),
    Function("$ID", (_real("which", optional=True),), Kind.STRING, "name and version of the system", "TYPE $ID()",
             "+", lambda _=None: f"vrs {__version__}"),
    Function("$TRUNCATE", (_string("$s"),), Kind.STRING, "the string up to its first zero character",
             "$TRUNCATE($s)", "+", truncate),
    Function("$INTB", _X, Kind.STRING, "an integer as two characters", "$INTB(500)", "+",
             packer("h", -32768.0, 32767.0)),
    Function("$LNGB", _X, Kind.STRING, "an integer as four characters", "$LNGB(70000)", "+",
             packer("i", -2147483648.0, 2147483647.0)),
    Function("$FLTB", _X, Kind.STRING, "a real in single precision as four characters", "$FLTB(1.5)", "+",
             packer("f", -3.4028234e38, 3.4028234e38)),
    Function("$DBLB", _X, Kind.STRING, "a real in double precision as eight characters", "$DBLB(1.5)", "+",
             packer("d", -3.4028235e38, 3.4028235e38)),
    Function("INTB", (_string("$s"), _AT), Kind.REAL, "the integer of two characters of a string", "INTB($s)", "+",
             unpacker("h")),
    Function("LNGB", (_string("$s"), _AT), Kind.REAL, "the integer of four characters of a string", "LNGB($s, 3)",
             "+", unpacker("i")),
    Function("FLTB", (_string("$s"), _AT), Kind.REAL, "the single-precision real of four characters", "FLTB($s)",
             "+", unpacker("f")),
    Function("DBLB", (_string("$s"), _AT), Kind.REAL, "the double-precision real of eight characters", "DBLB($s)",
             "+", unpacker("d")),
)  # fmt: skip


_TASKS = (
    Function(
        "STATUS", (_string("$program"),), Kind.REAL,
        "what a program does: 1 it runs, 2 it has stopped and can go on, 0 neither, -1 it is not in memory, "
        "-2 it has mistakes", 'STATUS("pick")', "+",
        lambda context, name: float(context.environment.system.program_status(name)), contextual=True,
    ),
    Function(
        "TASK", (_real("select", optional=True), _real("task", optional=True)), Kind.REAL,
        "0: the number of this task; 1: what a task does (0 nothing yet, 1 completed, 2 stopped by an error, "
        "3 aborted, 4 it runs, 5 paused)", "TASK(1, 2)", "+", about_task, contextual=True,
    ),
    Function(
        "PRIORITY", (), Kind.REAL, "the priority of the program, as LOCK or a reaction has set it", "LOCK PRIORITY+1",
        "+", lambda context: float(context.environment.system.priority()), constant=True, contextual=True,
    ),
    Function("FREE", (_real("which"),), Kind.REAL, "0: the percentage of memory that is free: 100, it does not run out",
             "FREE(0)", "+", free),
    Function(
        "ID", (_real("component"),), Kind.REAL,
        "1: the model number of the robot, 2: its serial number (0), 3: the version of the system", "ID(1)", "+",
        lambda context, component: context.environment.system.identity(whole(component)), contextual=True,
    ),
)  # fmt: skip

_UNITS = (
    Function(
        "IOSTAT", (_real("unit"), _real("mode", optional=True)), Kind.REAL,
        "the status of a logical unit: 1, or the (negative) code of what went wrong last; "
        "mode 2: the characters of its last record", "IF IOSTAT(lun) < 0 THEN", "+", io_status, contextual=True,
    ),
    Function(
        "GETC", (_real("unit"), _real("mode", optional=True)), Kind.REAL,
        "the code of the next character of a unit, or the (negative) code of what went wrong; mode 1: do not wait "
        "for one", "char = GETC(lun)", "+", next_character, contextual=True,
    ),
    Function("$DEFAULT", (), Kind.STRING, "the folder from which names of files begin: that of the run", "$DEFAULT()",
             "+", lambda: "./"),
    Function(
        "$UNPACK", (Argument("$element", Shape.STRING_VARIABLE), _real("first"), _real("count")), Kind.STRING,
        "characters of an array whose elements, of 128 each, are taken for one string", "$UNPACK($a[0], 120, 20)",
        "+", unpacked,
    ),
)  # fmt: skip


def _refused(name: str, summary: str, note: str, result: Kind = Kind.REAL) -> Function:
    return Function(
        name,
        (_real("number", optional=True),),
        result,
        summary,
        f"{name}(1)",
        "+",
        None,
        state=State.REFUSED,
        note=note,
    )


_REFUSED = (
    _refused("BELT", "where a conveyor belt stands", "there is no conveyor at this robot"),
    _refused("DEVICE", "the state of a camera or another device", "there are no such devices at this robot"),
    _refused("KEYMODE", "the behaviour of pendant keys", "there is no pendant; PROMPT asks at the terminal"),
    _refused("PENDANT", "the keys of the pendant", "there is no pendant; PROMPT and GETC(4) read the terminal"),
    _refused("LATCH", "where the robot was when a signal came", "no latch is wired; REACTI and HERE come close",
             Kind.LOCATION),
)  # fmt: skip

FUNCTIONS: Mapping[str, Function] = {
    function.name: function
    for group in (_ARITHMETIC, _LOCATIONS, _SIGNALS, _SYSTEM, _STRINGS, _TASKS, _UNITS, _REFUSED)
    for function in group
}
