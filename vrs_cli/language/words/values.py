"""Define the values of programs at run time, convert them between mm and degrees and SI units, and print them.

real            float                 TRUE is -1, FALSE 0; an integer is a real without a fraction
string          str                   at most STRING_LENGTH characters when it is stored
transformation  kinematics Transform  [m]
precision point tuple of floats       [rad], joint by joint
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from enum import Enum
from math import degrees, fmod, isfinite, radians

from vrs_cli.errors import ArithmeticOverflow, IllegalValue, StringOverflow
from vrs_cli.kinematics.joints import TURNING, Joints, JointUnits
from vrs_cli.kinematics.transform import Transform, from_oat, orthonormal_frame, to_oat
from vrs_cli.values.numbers import LIMIT, Value

NAME_LENGTH = 15  # names are equal if this many first characters are equal (V+ User's Guide p.99)


class Kind(Enum):
    """The type of a value in VAL-II."""

    REAL = "real"
    STRING = "string"
    LOCATION = "transformation"
    PRECISION = "precision point"

    __hash__ = object.__hash__  # faster than the hash of Enum; kinds are the keys of many look-ups


SIGIL_KINDS: Mapping[str, Kind] = {"#": Kind.PRECISION, "$": Kind.STRING}


def kind_of_name(name: str) -> Kind:
    """Return the kind of a variable according to the first character of its name. For a bare name this is REAL,
    although it can also be a transformation."""
    return SIGIL_KINDS.get(name[:1], Kind.REAL)


def kinds_of_name(name: str) -> tuple[Kind, ...]:
    """Return the kinds that a variable with this name can have: two for a bare name, otherwise one."""
    shown = SIGIL_KINDS.get(name[:1])
    return (Kind.REAL, Kind.LOCATION) if shown is None else (shown,)


def key_of(name: str) -> str:
    """Return the key under which a variable or program is stored (as `ast.Variable.key`). `name`: the name as typed,
    including its sigil."""
    sigil = name[:1] if name[:1] in SIGIL_KINDS else ""
    return sigil + name[len(sigil) :].lower()[:NAME_LENGTH]


TRUE, FALSE = -1.0, 0.0
INTEGER_BITS = 24
INTEGER_LOW, INTEGER_HIGH = -(1 << INTEGER_BITS), (1 << INTEGER_BITS) - 1
STRING_LENGTH = 128


KIND_OF: dict[type, Kind] = {
    float: Kind.REAL,
    str: Kind.STRING,
    Transform: Kind.LOCATION,
    tuple: Kind.PRECISION,
}


def kind_of_value(value: Value) -> Kind:
    return KIND_OF[type(value)]


# --- numbers -----------------------------------------------------------------------------------------------------


def whole(value: float) -> int:
    """Return the nearest integer; halves are rounded away from zero. VAL-II rounds like this wherever it needs an
    integer."""
    return int(value + 0.5) if value >= 0.0 else int(value - 0.5)


def integer(value: float) -> int:
    """Return the nearest integer. Raises IllegalValue if it does not fit in 24 bits and a sign."""
    if not INTEGER_LOW - 0.5 < value < INTEGER_HIGH + 0.5:
        raise IllegalValue(
            plain(value),
            f"an integer from {INTEGER_LOW} to {INTEGER_HIGH} is wanted",
            value=value,
            lower=INTEGER_LOW,
            upper=INTEGER_HIGH,
        )
    return whole(value)


def integer_between(value: float, low: int, high: int, what: str) -> int:
    """Return the nearest integer. Raises IllegalValue if it is not from `low` to `high`. `what`: the name of the
    quantity in the message."""
    if not low - 0.5 < value < high + 0.5:
        raise IllegalValue(f"{what} {plain(value)}", f"{low} to {high}", value=value, lower=low, upper=high)
    return whole(value)


def wrap(bits: int) -> float:
    """Return an integer reduced to 24 bits and a sign, which is the range of results of the bitwise operators."""
    return float((bits - INTEGER_LOW) % (INTEGER_HIGH - INTEGER_LOW + 1) + INTEGER_LOW)


def within_range(value: float) -> float:
    """Check a real and return it. Raises ArithmeticOverflow if it is too large for a real, infinite or NaN."""
    if not -LIMIT <= value <= LIMIT:
        raise ArithmeticOverflow(f"the result {value:.{SIGNIFICANT}G}", f"reals reach {LIMIT:.2G}")
    return value


def storable(text: str) -> str:
    """Check a string and return it. Raises StringOverflow if it is too long to store."""
    if len(text) > STRING_LENGTH:
        raise StringOverflow(f"a string of {len(text)} characters", f"at most {STRING_LENGTH} can be stored")
    return text


_BASES = {"b": 2, "h": 16, "": 8}


def leading_number(text: str) -> tuple[float, int] | None:
    """Return the number at the start of a string, and the number of characters it occupies; None if there is none. The
    number may be decimal, octal (^17), binary (^B101) or hexadecimal (^HFF)."""
    if based := re.match(r"(?i)\^(?P<base>[bh]?)(?P<digits>[0-9a-f]+)", text):
        digits = based["digits"]
        try:
            return float(int(digits, _BASES[based["base"].lower()])), based.end()
        except ValueError:
            return None
    if decimal := re.match(r"(?i)[+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?", text):
        value = float(decimal[0])
        return (value, decimal.end()) if isfinite(value) and abs(value) <= LIMIT else None
    return None


def read_number(text: str) -> float | None:
    """Parse a string as a number, ignoring surrounding blanks. Return None if it is anything else."""
    stripped = text.strip()
    found = leading_number(stripped)
    return found[0] if found is not None and found[1] == len(stripped) else None


# --- millimetres and degrees ---------------------------------------------------------------------------------------

# round mm and degrees to this number of decimals: enough to hide rounding errors, but far finer than any arm's accuracy
EDGE_DIGITS = 9


def millimetres(metres: float) -> float:
    return round(metres * 1000.0, EDGE_DIGITS) + 0.0


def in_degrees(angle: float) -> float:
    return round(degrees(angle), EDGE_DIGITS) + 0.0


def transformation(numbers: Iterable[float]) -> Transform:
    """Return the transformation given by X, Y, Z [mm] and O, A, T [degrees], or by the 12 numbers of `from_axes`.
    Raises IllegalValue if the axes differ from a rotation by more than rounding errors."""
    given = tuple(numbers)
    if len(given) == len(Transform._fields):
        off = rounding(given)
        if not off <= MAX_ROUNDING:
            raise IllegalValue(
                f"the axes are no rotation: a number is off by {off:.3f}",
                "the 12 numbers are the axes n, s and a of a right-handed frame, then x, y and z",
            )
        return orthonormal_frame(from_axes(given))
    x, y, z, o, a, t = given
    return from_oat(x / 1000.0, y / 1000.0, z / 1000.0, radians(o), radians(a), radians(t))


MAX_ROUNDING = 0.005  # maximum error of an axis component that is taken as rounding (files have 3 decimals or more)


def from_axes(numbers: Iterable[float]) -> Transform:
    """Return the transformation given by the axes n, s, a and the position [mm], three numbers each. Files of
    controllers and the strings of $TRANSB have this order (V+ Language Reference)."""
    nx, ny, nz, sx, sy, sz, ax, ay, az, *mm = numbers
    px, py, pz = (number / 1000.0 for number in mm)
    return Transform(nx, sx, ax, px, ny, sy, ay, py, nz, sz, az, pz)


def rounding(numbers: Iterable[float]) -> float:
    """Return the largest difference between the axis components in 12 numbers (see `from_axes`) and the axis components
    of the nearest orthonormal frame."""
    given = from_axes(numbers)
    return max(abs(x - y) for x, y in zip(given, orthonormal_frame(given), strict=True))


def numbers_of(value: Transform | Joints, units: JointUnits = TURNING) -> tuple[float, ...]:
    """Return the numbers of a location: X, Y, Z [mm], O, A, T [degrees] of a transformation, or the joint positions
    [degrees, mm] of a precision point."""
    if isinstance(value, Transform):
        return (*map(millimetres, (value.px, value.py, value.pz)), *map(in_degrees, to_oat(value)))
    return tuple([round(number, EDGE_DIGITS) + 0.0 for number in units.to_display(value)])


# --- text --------------------------------------------------------------------------------------------------------

SIGNIFICANT = 7  # number of significant digits in the default number format
EXACT = 1e8  # print integers below this limit with all digits, so that integers of 24 bits never lose one


def plain(value: float) -> str:
    """Return a number as text with up to 7 significant digits (a smaller integer in full), without trailing zeros."""
    if abs(value) < EXACT and value == int(value):
        return str(int(value))
    return f"{value:.{SIGNIFICANT}G}"


def default_form(value: float) -> str:
    """Return a number in the default format `/D`: a blank or a minus sign, then the digits."""
    text = plain(value)
    return text if text.startswith("-") else f" {text}"


# --- angles of trigonometric functions -----------------------------------------------------------------------------


def quadrant(angle: float) -> tuple[int, float]:
    """Split an angle [degrees] into a number of right angles (0 to 3) and a remainder between -45 and 45 degrees, which
    is returned in radians. The result is exact at multiples of a right angle."""
    turned = fmod(angle, 360.0)
    right_angles = whole(turned / 90.0)
    return right_angles % 4, radians(turned - 90.0 * right_angles)


ON_AND_OFF = "SIGNAL 1 turns a signal on, SIGNAL -1 turns it off, SIG(1001) reads one"
SIGNALS_A_BANK = 512
OUTPUTS = range(1, 1 + SIGNALS_A_BANK)
INPUTS = range(1001, 1001 + SIGNALS_A_BANK)
INTERNAL = range(2001, 2001 + SIGNALS_A_BANK)
