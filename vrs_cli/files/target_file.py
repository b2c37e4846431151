"""The stream of `vrs steer`: where the robot is to be, one target a line, in the columns of our tables.

    t,jt1,jt2,jt3,jt4,jt5,jt6         s, deg; mm where a joint slides
    t,x,y,z,o,a,t_angle               s, mm, deg

The first line may name the columns, in any order; others are passed over, and joints count more than poses. Without
it a line is a time and the joints. Blank lines and comments (`;` or `#`) are passed over. Lines are read one by one:
a stream need not end, and a wrong line need not end it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from math import inf, isfinite

from msgspec import Struct

from vrs_cli.errors import FileDamaged
from vrs_cli.kinematics.joints import TURNING, Joints, JointUnits
from vrs_cli.kinematics.transform import Transform
from vrs_cli.language.words.values import read_number, transformation
from vrs_cli.trajectory.instant import LATEST

BYTE_ORDER_MARK = "\ufeff"  # before the first line, as some systems write it
TIME = "t"
POSE = ("x", "y", "z", "o", "a", "t_angle")
PAUSE = 3600.0  # [s] between two targets; one wrong time far ahead must not end the stream
LONGEST = 60  # characters of a wrong first line that are shown: it may be any file


class TimedTarget(Struct, frozen=True):
    """A target at time t [s]; `line` is its number in the file."""

    line: int
    t: float
    target: Joints | Transform


class _Columns(Struct, frozen=True):
    """Which fields hold the time and the target, and how many fields a line has."""

    time: int
    target: tuple[int, ...]
    is_pose: bool
    count: int


def _raised(wrong: FileDamaged) -> None:
    raise wrong


def read_targets(
    lines: Iterable[str],
    joint_count: int,
    path: str = "targets",
    *,
    relative: bool = False,
    live: bool = False,
    units: JointUnits = TURNING,
    wrong: Callable[[FileDamaged], None] = _raised,
) -> Iterator[TimedTarget]:
    """The targets of a stream as they come; their times count from the first one where they are `relative`.

    `wrong` is told of each line that is no target, by its number, and the next one is read. A line of a `live` stream
    is over when its end has come. Raises FileDamaged for names of columns that are not ours.
    """
    joints = tuple(f"jt{number}" for number in range(1, joint_count + 1))
    columns: _Columns | None = None
    times = _Times(relative)
    for number, line in enumerate(lines, 1):
        where, fields = f"{path}:{number}", fields_of(line.removeprefix(BYTE_ORDER_MARK))
        if not fields:
            continue
        if columns is None and len(fields) > 1 and all(read_number(field) is None for field in fields):
            columns = _named(fields, joints, where)
            continue
        at_first = columns or _Columns(0, tuple(range(1, joint_count + 1)), False, joint_count + 1)
        try:
            if live and not line.endswith("\n"):
                raise FileDamaged(f"{where}: the line is cut off", "a newline ends it")
            if len(fields) != at_first.count:
                wanted = f"{len(fields)} field{'s' * (len(fields) > 1)} where {at_first.count} are wanted"
                raise FileDamaged(f"{where}: {wanted}")
            values = [_number(fields[place], where) for place in at_first.target]
            t = times.next(_number(fields[at_first.time], where), where)
        except FileDamaged as error:
            wrong(error)
            continue
        columns = at_first
        yield TimedTarget(number, t, transformation(values) if columns.is_pose else units.read(values))


class _Times:
    """Times go on; `relative` ones count from the first."""

    def __init__(self, relative: bool) -> None:
        self._relative, self._first = relative, None if relative else 0.0
        self._last = -inf

    def next(self, t: float, where: str) -> float:
        """The time of a target [s]. Raises FileDamaged."""
        first = t if self._first is None else self._first
        if not 0.0 <= t - first <= LATEST:
            hint = "" if self._relative else "with --relative times count from the first"
            raise FileDamaged(f"{where}: {t!r} s is no time from {first!r} to {first + LATEST!r} s", hint)
        if t < self._last:
            raise FileDamaged(f"{where}: {t!r} s comes after {self._last!r} s", "times go on")
        if isfinite(self._last) and t - self._last > PAUSE:
            raise FileDamaged(f"{where}: {t!r} s is a jump from {self._last!r} s", f"a pause is at most {PAUSE:g} s")
        self._first, self._last = first, t
        return t - first


def _named(fields: Sequence[str], joints: Sequence[str], where: str) -> _Columns:
    names = [field.lower() for field in fields]
    others = [name for name in names if name not in joints and name[:2] == "jt" and name[2:].isdecimal()]
    if others:
        raise FileDamaged(f"{where}: {', '.join(others)} of another robot", f"this one has {', '.join(joints)}")
    for wanted, is_pose in ((joints, False), (POSE, True)):
        if all(name in names for name in (TIME, *wanted)):
            return _Columns(names.index(TIME), tuple(map(names.index, wanted)), is_pose, len(names))
    found = ", ".join(fields)
    told = found if len(found) <= LONGEST else f"{found[:LONGEST]}..."
    raise FileDamaged(f"{where}: the columns are {told}", f"t,{','.join(joints)} or t,{','.join(POSE)} are wanted")


def _number(text: str, where: str) -> float:
    value = read_number(text)
    if value is None or not isfinite(value):
        raise FileDamaged(f"{where}: {text!r} is no number")
    return value


def fields_of(line: str) -> list[str]:
    """The fields of a line; none where it is blank, or a comment (`;` or `#`)."""
    said = line.partition(";")[0].partition("#")[0].strip()
    return [field.strip() for field in said.split(",")] if said else []
