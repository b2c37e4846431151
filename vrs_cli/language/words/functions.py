"""List the functions, constants, operators and linking words of VAL-II, with one row for each; the checks, HELP and
completion read these rows.

Functions take and return numbers in millimetres and degrees. `run/operations.py` evaluates each function, under the
same name. Sources: V+ Language Reference; val2 sections 2 and 5.

Operator precedence differs between V+ and VAL-II (val2 section 2.2): V+ ranks NOT, AND, OR and XOR below the relations,
VAL-II above them; see the comment at the top of grammar/val2.lark.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property, partial

from msgspec import Struct

from vrs_cli.language.words.values import Kind
from vrs_cli.language.words.word import PrintedForm, Shape, State, WordRow, by_name, read_form


class Function(WordRow, frozen=True, eq=False, dict=True):
    """The row of a function or a constant: `ATAN2(y, x)`, `SHIFT(location[ BY dx][, dy][, dz])`, `PI`."""

    result: Kind = Kind.REAL

    @cached_property
    def name(self) -> str:
        return self.form.partition("(")[0]

    @cached_property
    def constant(self) -> bool:
        """Return whether the function is written without parentheses (`PI`, `HERE`)."""
        return self.form == self.name

    @cached_property
    def _read(self) -> PrintedForm:
        return read_form(self.form[len(self.name) + 1 : -1], self.shapes)


_real = partial(Function, result=Kind.REAL)
_location = partial(Function, result=Kind.LOCATION)
_precision = partial(Function, result=Kind.PRECISION)
_string = partial(Function, result=Kind.STRING)


def _refusal(name: str, summary: str, note: str, result: Kind = Kind.REAL) -> Function:
    return Function(f"{name}([number])", "+", summary, f"{name}(1)", note, state=State.REFUSED, result=result)


FUNCTIONS: Mapping[str, Function] = by_name((
    # arithmetic
    _real("ABS(x)", "2 +", "the value without its sign", "ABS(-3)"),
    _real("SIGN(x)", "2 +", "-1 for a negative number, otherwise 1", "SIGN(x)"),
    _real("SQR(x)", "2 +", "the square", "SQR(3)"),
    _real("SQRT(x)", "2 +", "the square root", "SQRT(2)"),
    _real("INT(x)", "2 +", "the integer part, cut toward 0", "INT(-2.7)"),
    _real("FRACT(x)", "2 +", "the part that INT cuts off, with its sign", "FRACT(2.75)"),
    _real("SIN(degrees)", "2 +", "the sine of an angle in degrees", "SIN(30)"),
    _real("COS(degrees)", "2 +", "the cosine of an angle in degrees", "COS(60)"),
    _real("TAN(degrees)", "2 +", "the tangent of an angle in degrees", "TAN(45)"),
    _real("ATAN2(y, x)", "2 +", "the angle in degrees, -180 to 180, whose tangent is y/x", "ATAN2(1, -1)"),
    _real("MAX(a[, b, ...])", "2 +", "the largest of its arguments", "MAX(x, y, 10)"),
    _real("MIN(a[, b, ...])", "2 +", "the smallest of its arguments", "MIN(x, y)"),
    _real("RANDOM", "2 +", "a random number from 0 up to 1; every run gets the same numbers", "x = 10*RANDOM"),
    _real("OUTSIDE(low, value, high)", "2 +", "TRUE if the value is below low or above high", "OUTSIDE(0, x, 10)"),
    _real("BCD(x)", "+", "the digits of an integer, four bits each", "BCD(93)"),
    _real("DCB(x)", "+", "the integer whose digits have four bits each", "DCB(147)"),
    _real("BMASK(bit[, bits, ...])", "+",
        "an integer with these bits set, 1 the lowest, 24 the highest", "BMASK(1, 3)"),
    # locations
    _real("DX(location)", "2 +", "X of a transformation in mm", "DX(HERE)"),
    _real("DY(location)", "2 +", "Y of a transformation in mm", "DY(part)"),
    _real("DZ(location)", "2 +", "Z of a transformation in mm", "DZ(part)"),
    _real("DISTANCE(a, b)", "2 +",
        "the distance between two transformations in mm", "DISTANCE(a, HERE)", shapes=(Shape.LOCATION, Shape.LOCATION)),
    _real("INRANGE(location)", "2 +",
        "0 if the robot can reach the location, otherwise the reasons as bits", "IF INRANGE(p) == 0 THEN",
        shapes=(Shape.PLACE,)),
    _real("IDENTICAL(a, b)", "+",
        "TRUE if two transformations are the same to the last digit", "IDENTICAL(a, b)",
        shapes=(Shape.LOCATION, Shape.LOCATION)),
    _location("TRANS([x][, y][, z][, o][, a][, t])", "2 +",
        "a transformation from X, Y, Z in mm and O, A, T in degrees; missing values are those of NULL: "
        "0, 0, 0, 90, -90, 0",
        "SET p = TRANS(500, 150, -100, 90, 90, 0)"),
    _precision("#PPOINT([j1][, j2][, j3][, j4][, j5][, j6][, j, ...])", "2 +",
        "a precision point from joints in degrees, in mm where they slide; missing ones are 0",
        "MOVE #PPOINT(0, -90, 90)"),
    _location("SHIFT(location[ BY dx][, dy][, dz])", "2 +",
        "the transformation moved along the axes of the world by so many mm", "SHIFT(a BY 5, -5, 10)"),
    _location("FRAME(a, b, c[, d])", "2 +",
        "a frame with its origin at d (at a if it is missing), X from a to b, and c on the +Y side",
        "SET pallet = FRAME(a, b, c, a)", shapes=(Shape.LOCATION, Shape.LOCATION, Shape.LOCATION, Shape.LOCATION)),
    _location("INVERSE(location)", "2 +", "the inverse transformation", "INVERSE(a):b"),
    _location("RX(degrees)", "+", "a turn about X by degrees", "SET b = a:RX(90)"),
    _location("RY(degrees)", "+", "a turn about Y by degrees", "SET b = a:RY(90)"),
    _location("RZ(degrees)", "+", "a turn about Z by degrees", "SET b = a:RZ(90)"),
    _location("SCALE(location BY factor)", "+", "the transformation with X, Y, Z multiplied", "SCALE(a BY 0.5)"),
    _location("NORMAL(location)", "+",
        "the transformation with its axes made perpendicular and of length one again", "SET a = NORMAL(a)"),
    _location("HERE", "2 +", "the present place of the tool", "SET p = HERE"),
    _location("DEST", "2 +", "the place where the last motion ends", "MOVES SHIFT(DEST BY ,,50)"),
    _location("TOOL", "2 +", "the tool transformation", "SET grip = TOOL"),
    _location("BASE", "2 +", "the base transformation: the world frame in the frame of the robot", "SET b = BASE"),
    _location("NULL", "2 +", "the transformation that changes nothing", "TOOL NULL"),
    _precision("#PDEST", "2 +", "the joints where the last motion ends", "SET #p = #PDEST"),
    _precision("#PHERE", "+", "the present joints", "SET #p = #PHERE"),
    # signals
    _real("SIG(signal[, signals, ...])", "2 +",
        "TRUE if all these signals are on (off for negative numbers)", "WAIT SIG(1001, -1002)",
        shapes=(Shape.REAL,)),
    _real("SIG.INS(signal)", "2 +",
        "TRUE if there is a signal with this number", "SIG.INS(1001)", shapes=(Shape.REAL,)),
    _real("BITS(first[, count])", "2 +",
        "signals as a binary number; the first signal is the lowest bit", "count = BITS(1001, 4)"),
    _real("TIMER(timer)", "2 +", "seconds since a timer was set", "WAIT TIMER(1) > 2"),
    _real("TIME", "2 +", "the robot clock in seconds", "t = TIME"),
    # latch
    _location("LATCH([select])", "+",
        "the place of the tool when the signal of PARAMETER LATCH.SIGNAL last came on", "SET p = LATCH(0)"),
    _precision("#PLATCH([select])", "+",
        "the joints when the signal of PARAMETER LATCH.SIGNAL last came on", "SET #p = #PLATCH(0)"),
    _real("LATCHED([select])", "+",
        "TRUE if the signal of PARAMETER LATCH.SIGNAL has come on since the last LATCHED", "WAIT LATCHED(0)"),
    # the system
    _real("SPEED(which)", "2 +",
        "in percent; 1: the monitor speed, 2: the present program speed, 3: the program speed of the next motion",
        "SPEED(2)"),
    _real("STATE(which)", "2 +",
        "1: what the robot does (7 under program control), 2: its motion (0 none yet, 1 moving, 2 stopped as planned), "
        "3: who drives (5: programs), 4: the panel as bits (0: no emergency stop), 5: its key (1: automatic), "
        "9: seconds until the motion ends, 10: the part of it that is completed [%]",
        "STATE(2)"),
    _real("CONFIG([select])", "+",
        "the configuration as bits, 1: RIGHTY, 2: BELOW, 4: FLIP; select 0: of the arm now, 1: where it will stop",
        "CONFIG()"),
    _real("SELECT(device[, mode])", "+",
        "the number of the chosen robot: 1; mode -1: the number of robots",
        "SELECT(ROBOT)", shapes=(Shape.WORD,)),
    _real("ROBOT.OPR([mode][, index])", "+",
        "data of special functions of one maker: 0, no robot here has such functions", "ROBOT.OPR(1)"),
    _real("SWITCH(switch)", "2 +", "TRUE if a switch is enabled", "SWITCH(CP)"),
    _real("PARAMETER(parameter)", "2 +", "the value of a parameter", "PARAMETER(HAND.TIME)"),
    _real("HAND", "2 +", "the opening of the hand: 1 open, 0 closed", "IF HAND == 0 THEN"),
    _real("HAND.TIME", "2 +", "the time that the hand has to open or close [s]", "DELAY HAND.TIME"),
    _real("ERROR(task[, select])", "2 +", "the code of the latest error, 0 if there was none", "TYPE $ERROR(ERROR(0))"),
    _real("DEFINED(variable)", "+", "TRUE if a variable has a value", "IF NOT DEFINED(part) THEN"),
    _real("LAST(array)", "+", "the highest index of an array that has a value, -1 if none has", "LAST(row[])"),
    _real("TAS(variable, new)", "+",
        "the value of a variable; the variable then gets the new value", "TAS(busy, TRUE)",
        shapes=(Shape.REAL_VARIABLE,)),
    _real("PI", "2 +", "3.14159...", "2*PI*r"),
    _real("TRUE", "2 +", "-1", "done = TRUE"),
    _real("FALSE", "2 +", "0", "done = FALSE"),
    _real("ON", "2 +", "-1", "SWITCH CP = ON"),
    _real("OFF", "2 +", "0", "SWITCH CP = OFF"),
    # strings
    _real("LEN($s)", "2 +", "the number of characters", "LEN($s)"),
    _real("ASC($s[, index])", "2 +",
        "the code of the character at an index, counted from 1; -1 beyond the end", "ASC($s, 2)"),
    _real("VAL($s)", "2 +", "the number with which a string begins, or 0", 'VAL("12.5 mm")'),
    _real("POS($s, $part[, start])", "2 +",
        "where a part begins in a string, counted from 1; 0 if it is not there", 'POS("part.v2", ".")'),
    _real("STRDIF($a, $b)", "2 +", "-1, 0 or 1: $a before, equal to or after $b", "STRDIF($a, $b)"),
    _string("$CHR(code)", "2 +", "the character of a code", "$CHR(34)"),
    _string("$MID($s, first[, count])", "2 +",
        "part of a string: so many characters from a first one, counted from 1", "$MID($s, 1, 3)"),
    _string("$ENCODE(item[, items, ...])", "2 +", "what TYPE would print, as a string", "$s = $ENCODE(/F6.2, x)"),
    _string("$DECODE($variable, $separators[, mode])", "2 +",
        "the front of a string up to a separator (mode 1: the separators); the rest stays in the variable",
        '$word = $DECODE($line, " ,", 0)', shapes=(Shape.STRING_VARIABLE,)),
    _string("$ERROR(code)", "2 +", "the text of an error code", "$ERROR(-610)"),
    _string("$TIME", "+", "the robot clock as date and time, counted from 01-Jan-84", "TYPE $TIME"),
    _string("$ID([which])", "+", "name and version of the system", "TYPE $ID()"),
    _string("$TRUNCATE($s)", "+", "the string up to its first zero character", "$TRUNCATE($s)"),
    _string("$INTB(x)", "+", "an integer as two characters", "$INTB(500)"),
    _string("$LNGB(x)", "+", "an integer as four characters", "$LNGB(70000)"),
    _string("$FLTB(x)", "+", "a real in single precision as four characters", "$FLTB(1.5)"),
    _string("$DBLB(x)", "+", "a real in double precision as eight characters", "$DBLB(1.5)"),
    _real("INTB($s[, first])", "+", "the integer of two characters of a string", "INTB($s)"),
    _real("LNGB($s[, first])", "+", "the integer of four characters of a string", "LNGB($s, 3)"),
    _real("FLTB($s[, first])", "+", "the single-precision real of four characters", "FLTB($s)"),
    _real("DBLB($s[, first])", "+", "the double-precision real of eight characters", "DBLB($s)"),
    _string("$TRANSB(location)", "+",
        "a transformation as 48 characters: X, Y and Z axis and the position in mm, each number in single precision",
        "$TRANSB(HERE)", shapes=(Shape.LOCATION,)),
    _location("TRANSB($s[, first])", "+", "the transformation of 48 characters of a string", "SET a = TRANSB($s)"),
    # tasks
    _real("STATUS($program)", "+",
        "the state of a program: 1 it runs, 2 it has stopped and can continue, 0 neither, -1 it is not in memory, "
        "-2 it has mistakes",
        'STATUS("pick")'),
    _real("TASK([select][, task])", "+",
        "0: the number of this task; 1: the state of a task (0 not started, 1 completed, 2 stopped by an error, "
        "3 aborted, 4 it runs, 5 paused); 2: the number of the robot that a task has attached, 0 if it has none",
        "TASK(1, 2)"),
    _real("GET.EVENT([task])", "+", "1 if the event of a task, or of this one, is set, otherwise 0", "GET.EVENT()"),
    _real("TPS", "+",
        "the number of ticks of the system in a second; a WAIT without a condition waits for one tick", "n = 2*TPS"),
    _real("PRIORITY", "+", "the priority of the program, which LOCK or a reaction has set", "LOCK PRIORITY+1"),
    _real("FREE(which)", "+", "0: the percentage of free memory, always 100", "FREE(0)"),
    _real("ID(component)", "+",
        "1: the model number of the robot, 2: its serial number (0), 3: the version of the system", "ID(1)"),
    # logical units and bytes
    _real("IOSTAT(unit[, mode])", "+",
        "the status of a logical unit: 1 after success, 100 or 101 if READ reports an opened or closed connection, "
        "otherwise the (negative) code of the last error; mode 2: the number of characters in its last record",
        "IF IOSTAT(lun) < 0 THEN"),
    _real("GETC(unit[, mode])", "+",
        "the code of the next character of a unit, or the (negative) code of an error; "
        "mode 1: do not wait for one",
        "char = GETC(lun)"),
    _string("$DEFAULT()", "+", "the folder of the run, to which names of files refer", "$DEFAULT()"),
    _string("$UNPACK($element, first, count)", "+",
        "characters of an array that counts as one long string, 128 characters for each element",
        "$UNPACK($a[0], 120, 20)"),
    # not available
    _refusal("BELT", "where a conveyor belt stands", "this robot has no conveyor"),
    _refusal("AIO.IN", "analog input", "this robot has no analog signals"),
    *(
        _refusal(name, "a result of a camera", "this robot has no camera")
        for name in ("VFEATURE", "VRESULT", "VSTATE", "VLOCATION")
    ),
    _refusal("IOGETB", "the bus of the controller", "there is no bus; SIG and BITS read signals"),
    _refusal("IOGETS", "the bus of the controller", "there is no bus; SIG and BITS read signals"),
    _refusal("DEVICE", "the state of a camera or another device", "this robot has no such devices"),
    _refusal("KEYMODE", "the behaviour of pendant keys", "there is no pendant; PROMPT asks at the terminal"),
    _refusal("NETWORK", "the network card of the controller", "IOSTAT has the state of a connection"),
    _refusal("PENDANT", "the keys of the pendant", "there is no pendant; PROMPT and GETC(4) read the terminal"),
))  # fmt: skip
WITH_BY = frozenset({"SHIFT", "SCALE"})  # functions whose first argument is followed by BY instead of a comma

BY_TIME = frozenset({"TIME", "$TIME", "TIMER", "RANDOM"})  # functions that may give a new value at every call


class Operator(WordRow, frozen=True, eq=False, dict=True):
    """The row of an operator or a linking word. `name`: its name, given because the form begins with another word;
    `also`: another spelling, such as =< for <=."""

    name: str = ""
    also: str = ""


def _row(name: str, form: str, where: str, summary: str, example: str, also: str = "") -> Operator:
    return Operator(form, where, summary, example, name=name, also=also)


OPERATORS: Mapping[str, Operator] = by_name((
    _row("+", "a + b", "1 2 +", "the sum of two numbers; of two strings, one after the other", 'TYPE 2+3, "A-"+"17"'),
    _row("-", "a - b", "1 2 +", "the difference; before a value, its negative", "x = -y-1"),
    _row("*", "a * b", "1 2 +", "the product", "x = 2*y"),
    _row("/", "a / b", "1 2 +", "the quotient", "x = y/2"),
    _row("MOD", "a MOD b", "2 +", "the remainder of a division; both are rounded to integers", "x = 17 MOD 5"),
    _row("**", "a ** b", "+", "the power of a base and an exponent", "x = 2**10"),
    _row("==", "a == b", "2 +", "TRUE if two numbers, or two strings, are equal", "IF x == 5 THEN"),
    _row("<>", "a <> b", "2 +", "TRUE if two numbers, or two strings, are not equal", "IF x <> 5 THEN"),
    _row("<", "a < b", "2 +", "TRUE if the first is less", "IF x < 5 THEN"),
    _row(">", "a > b", "2 +", "TRUE if the first is greater", "IF x > 5 THEN"),
    _row("<=", "a <= b", "2 +", "TRUE if the first is less or equal", "IF x <= 5 THEN", "=<"),
    _row(">=", "a >= b", "2 +", "TRUE if the first is greater or equal", "IF x >= 5 THEN", "=>"),
    _row("EQ", "IF a EQ b THEN label", "1", "equal, in VAL; only in this form", "IF n EQ 5 THEN 10"),
    _row("NE", "IF a NE b THEN label", "1", "not equal, in VAL; only in this form", "IF n NE 5 THEN 10"),
    _row("LT", "IF a LT b THEN label", "1", "less, in VAL; only in this form", "IF n LT 5 THEN 10"),
    _row("GT", "IF a GT b THEN label", "1", "greater, in VAL; only in this form", "IF n GT 5 THEN 10"),
    _row("LE", "IF a LE b THEN label", "1", "less or equal, in VAL; only in this form", "IF n LE 5 THEN 10"),
    _row("GE", "IF a GE b THEN label", "1", "greater or equal, in VAL; only in this form", "IF n GE 5 THEN 10"),
    _row("NOT", "NOT a", "2 +", "TRUE if a is 0; binds looser than the relations", "IF NOT (x == 5) THEN"),
    _row("AND", "a AND b", "2 +", "TRUE if neither is 0; both are evaluated", "IF (x > 2) AND (y < 3) THEN"),
    _row("OR", "a OR b", "2 +", "TRUE if one of them is not 0; both are evaluated", "IF (x > 2) OR (y < 3) THEN"),
    _row("XOR", "a XOR b", "2 +", "TRUE if exactly one of them is not 0", "IF (x > 2) XOR (y < 3) THEN"),
    _row("COM", "COM a", "2 +", "an integer with every bit inverted", "x = COM 5"),
    _row("BAND", "a BAND b", "2 +", "the bits that both integers have", "x = 6 BAND 3"),
    _row("BOR", "a BOR b", "2 +", "the bits that at least one of two integers has", "x = 6 BOR 3"),
    _row("BXOR", "a BXOR b", "2 +", "the bits that exactly one of two integers has", "x = 6 BXOR 3"),
    _row(":", "a:b", "1 2 +", "the location b relative to the frame a", "MOVE pallet:corner"),
))  # fmt: skip

LINKS: Mapping[str, Operator] = by_name((
    _row("AT", "motion AT t", "",
        "begin the motion, or change the signals or the hand, at the time t of the timeline [s]",
        "MOVE part AT 2.5"),
    _row("IN", "motion IN dt", "",
        "begin the motion, or change the signals or the hand, dt seconds from now",
        "MOVE part IN 0.5"),
    _row("ALWAYS", "setting ALWAYS", "1 2 +",
        "the setting applies to all later motions, not only to the next one", "SPEED 30 ALWAYS"),
    _row("MMPS", "SPEED n MMPS", "2 +", "the speed of the tool tip in mm a second", "SPEED 200 MMPS"),
    _row("IPS", "SPEED n IPS", "2 +", "the speed of the tool tip in inches a second", "SPEED 5 IPS"),
    _row("MONITOR", "SPEED n MONITOR", "+", "the monitor speed, from a program", "SPEED 50 MONITOR"),
    _row("THEN", "IF condition THEN", "2 +",
        "ends the line; the steps follow on the next lines, up to ELSE or END", "IF x > 2 THEN"),
    _row("TO", "FOR variable = first TO last", "2 +", "the last value of a loop", "FOR i = 1 TO 10"),
    _row("STEP", "FOR variable = first TO last STEP step", "2 +",
        "the number that is added after each pass; 1 if it is left out", "FOR i = 10 TO 0 STEP -2"),
    _row("OF", "CASE number OF", "2 +", "ends the line; VALUE parts follow", "CASE count OF"),
    _row("BY", "SHIFT(a BY dx, dy, dz)", "1 2 +",
        "the distances by which SHIFT moves a location, or the factor of SCALE", "SET b = SHIFT(a BY ,,50)"),
))  # fmt: skip


_RELATIONS = ("==", "<>", "<", ">", "<=", ">=")
_COMMON = {
    **dict.fromkeys(_RELATIONS, 4),
    **dict.fromkeys(("+", "-", "BOR", "BXOR"), 5),
    **dict.fromkeys(("*", "/", "MOD", "BAND"), 6),
    "**": 7,
    ":": 9,
}
_SIGNS = dict.fromkeys(("-", "+", "COM"), 8)

RELATIONS = frozenset(_RELATIONS)
LOGICAL = frozenset({"AND", "OR", "XOR", "NOT"})


class Order(Struct, frozen=True):
    """The precedence of operators. `infix`, `prefix`: the rank of each operator between or before operands. A higher
    rank binds more tightly; operators of equal rank group from the left."""

    infix: Mapping[str, int]
    prefix: Mapping[str, int]


ORDER = Order({"OR": 1, "XOR": 1, "AND": 2, **_COMMON}, {"NOT": 3, **_SIGNS})
VAL_ORDER = Order({**_COMMON, "OR": 5, "XOR": 5, "AND": 6}, {"NOT": 8, **_SIGNS})
