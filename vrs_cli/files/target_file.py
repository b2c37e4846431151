"""The stream of `vrs steer`: where the robot is to be, one target a line, in the columns of our tables.

    t,jt1,jt2,jt3,jt4,jt5,jt6         s, deg; mm where a joint slides
    t,x,y,z,o,a,t_angle               s, mm, deg

The first line may name the columns, in any order; others are passed over, and joints count more than poses. Without
it a line is a time and the joints. Blank lines and comments (`;` or `#`) are passed over. Lines are read one by one:
a stream need not end.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from math import inf, isfinite

from vrs_cli.errors import FileDamaged
from vrs_cli.kinematics.joints import TURNING, Joints, JointUnits
from vrs_cli.kinematics.transform import Transform
from vrs_cli.language.values import precision_point, read_number, transformation
from vrs_cli.trajectory.instant import LATEST

TIME = "t"
POSE = ("x", "y", "z", "o", "a", "t_angle")
LONGEST = 60  # characters of a wrong first line that are shown: it may be any file


@dataclass(frozen=True, slots=True)
class TimedTarget:
    """Where to be at time t [s]; `line` is its number in the file."""

    line: int
    t: float
    target: Joints | Transform


@dataclass(frozen=True, slots=True)
class _Columns:
    """Which fields hold the time and the target, and how many fields a line has."""

    time: int
    target: tuple[int, ...]
    is_pose: bool
    count: int


def read_targets(
    lines: Iterable[str],
    joint_count: int,
    path: str = "targets",
    *,
    relative: bool = False,
    units: JointUnits = TURNING,
) -> Iterator[TimedTarget]:
    """The targets of a stream as they come; their times count from the first one where they are `relative`.

    Raises FileDamaged, which names the line.
    """
    times = _Times(relative)
    for number, fields, columns in _rows(lines, joint_count, path):
        where = f"{path}:{number}"
        if len(fields) != columns.count:
            raise FileDamaged(f"{where}: {len(fields)} field{'s' * (len(fields) > 1)} where {columns.count} are wanted")
        t = times.next(_number(fields[columns.time], where), where)
        values = [_number(fields[place], where) for place in columns.target]
        yield TimedTarget(number, t, transformation(values) if columns.is_pose else precision_point(values, units))


def _rows(lines: Iterable[str], joint_count: int, path: str) -> Iterator[tuple[int, list[str], _Columns]]:
    """Number and fields of each line that is a target, and what they are."""
    joints = tuple(f"jt{number}" for number in range(1, joint_count + 1))
    columns: _Columns | None = None
    for number, line in enumerate(lines, 1):
        said = line.partition(";")[0].partition("#")[0].strip()
        fields = [field.strip() for field in said.split(",")]
        if not said:
            continue
        if columns is None and read_number(fields[0]) is None:
            columns = _named(fields, joints, f"{path}:{number}")
        else:
            columns = columns or _Columns(0, tuple(range(1, joint_count + 1)), False, joint_count + 1)
            yield number, fields, columns


class _Times:
    """Times go on; `relative` ones count from the first."""

    def __init__(self, relative: bool) -> None:
        self._first = None if relative else 0.0
        self._last = -inf

    def next(self, t: float, where: str) -> float:
        """The time of a target [s]. Raises FileDamaged."""
        first = t if self._first is None else self._first
        if not 0.0 <= t - first <= LATEST:
            raise FileDamaged(f"{where}: {t!r} s is no time from {first!r} to {first + LATEST!r} s")
        if t < self._last:
            raise FileDamaged(f"{where}: {t!r} s comes after {self._last!r} s", "times go on")
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
