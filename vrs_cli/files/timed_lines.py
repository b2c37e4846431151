"""Read text files whose lines have a time and further comma-separated fields: streams of targets, and changes of input
signals.

The stream of `vrs lab steer` has one target per line, in the same columns as the tables that vrs exports:

    t,jt1,jt2,jt3,jt4,jt5,jt6         s, deg; mm for a slide
    t,x,y,z,o,a,t_angle               s, mm, deg

The first line may name the columns, in any order. Other columns are ignored, and if there are joints and poses, the
joints are used. Without this line, each line is a time and the joints. Lines are read one by one, because a stream may
be endless; after a wrong line the caller may continue.

The file of `vrs run --signals` has one change of an input signal per line:

    ; time [s], signal, state
    0.5, 1001, 1
    2.25, 1001, OFF

A line with the names of the columns is ignored. A state is 1, 0, ON, OFF, TRUE or FALSE; times may be in any
order. Blank lines and comments (`;` or `#`) are ignored in both kinds of file.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from math import inf, isfinite

from msgspec import Struct

from vrs_cli.errors import FileDamaged
from vrs_cli.files.opening import text_at
from vrs_cli.kinematics.joints import TURNING, Joints, JointUnits
from vrs_cli.kinematics.transform import Transform
from vrs_cli.language.run.signals import InputChange, Inputs
from vrs_cli.language.words.values import INPUTS, INTERNAL, plain, read_number, transformation
from vrs_cli.trajectory.instant import LATEST, on_grid
from vrs_cli.values.numbers import count

BYTE_ORDER_MARK = "\ufeff"  # some systems write this character before the first line of a file
TIME = "t"
POSE = ("x", "y", "z", "o", "a", "t_angle")
# [s] maximum time between two targets: a later target is refused. Otherwise, after one target with a wrong late time,
# the correct times of all following targets would be refused as too early
MAX_PAUSE_S = 3600.0
MAX_SHOWN_CHARS = 60  # maximum number of characters of a wrong first line in a message; the file may contain anything


class TimedTarget(Struct, frozen=True):
    """A target of a stream, its time t [s], and the number of its line."""

    line: int
    t: float
    target: Joints | Transform


class _Columns(Struct, frozen=True):
    """The indexes of the time and of the target's values among the fields of a line, and the number of fields."""

    time: int
    target: tuple[int, ...]
    is_pose: bool
    count: int


def _raise(wrong: FileDamaged) -> None:
    raise wrong


def read_targets(
    lines: Iterable[str],
    joint_count: int,
    path: str = "targets",
    *,
    relative: bool = False,
    live: bool = False,
    units: JointUnits = TURNING,
    wrong: Callable[[FileDamaged], None] = _raise,
) -> Iterator[TimedTarget]:
    """Yield the targets of a stream as they arrive. `relative`: whether times count from the first target. `live`:
    whether the stream is still being written, so that a line without its line end counts as wrong. `wrong`: called with
    the error for each line that is not a target; if it returns, reading continues with the next line. Raises
    FileDamaged if the names of the columns are unknown.
    """
    joints = tuple(f"jt{number}" for number in range(1, joint_count + 1))
    columns: _Columns | None = None
    times = _Times(relative)
    for number, line in enumerate(lines, 1):
        where, fields = f"{path}:{number}", fields_of(line.removeprefix(BYTE_ORDER_MARK))
        if not fields:
            continue
        if columns is None and len(fields) > 1 and all(read_number(field) is None for field in fields):
            columns = _read_heading(fields, joints, where)
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
    """Checks that the times of a stream increase. `relative`: whether times count from the first target."""

    def __init__(self, relative: bool) -> None:
        self._relative, self._first = relative, None if relative else 0.0
        self._last = -inf

    def next(self, t: float, where: str) -> float:
        """Check the time t [s] of the next target, and return it, counted from the first target if `relative`. `where`:
        file and line for errors. Raises FileDamaged.
        """
        first = t if self._first is None else self._first
        if not 0.0 <= t - first <= LATEST:
            hint = "" if self._relative else "with --relative times count from the first"
            raise FileDamaged(f"{where}: {t!r} s is no time from {first!r} to {first + LATEST!r} s", hint)
        if t < self._last:
            raise FileDamaged(f"{where}: {t!r} s comes after {self._last!r} s", "times go on")
        if isfinite(self._last) and t - self._last > MAX_PAUSE_S:
            raise FileDamaged(
                f"{where}: {t!r} s is a jump from {self._last!r} s", f"a pause is at most {MAX_PAUSE_S:g} s"
            )
        self._first, self._last = first, t
        return t - first


def _read_heading(fields: Sequence[str], joints: Sequence[str], where: str) -> _Columns:
    names = [field.lower() for field in fields]
    others = [name for name in names if name not in joints and name[:2] == "jt" and name[2:].isdecimal()]
    if others:
        raise FileDamaged(f"{where}: {', '.join(others)} of another robot", f"this one has {', '.join(joints)}")
    for wanted, is_pose in ((joints, False), (POSE, True)):
        if all(name in names for name in (TIME, *wanted)):
            return _Columns(names.index(TIME), tuple(map(names.index, wanted)), is_pose, len(names))
    found = ", ".join(fields)
    shown = found if len(found) <= MAX_SHOWN_CHARS else f"{found[:MAX_SHOWN_CHARS]}..."
    raise FileDamaged(f"{where}: the columns are {shown}", f"t,{','.join(joints)} or t,{','.join(POSE)} are wanted")


def _number(text: str, where: str) -> float:
    value = read_number(text)
    if value is None or not isfinite(value):
        raise FileDamaged(f"{where}: {text!r} is no number")
    return value


def fields_of(line: str) -> list[str]:
    """Split a line into its fields, without comments (`;` or `#`); return no fields for a blank line."""
    said = line.partition(";")[0].partition("#")[0].strip()
    return [field.strip() for field in said.split(",")] if said else []


# --- signals ---------------------------------------------------------------------------------------------------------


HEADING = ("time", "signal", "state")
STATES: Mapping[str, bool] = {"1": True, "ON": True, "TRUE": True, "0": False, "OFF": False, "FALSE": False}
FORM = "a line is time, signal, state, such as 0.5, 1001, ON"
ROW_FORM = "a row is (time [s], signal, state), such as (0.5, 1001, True)"


def read_signals(path: str) -> Inputs:
    """Read a file with changes of input signals. Raises NonexistentFile, and FileDamaged that lists every
    wrong line.
    """
    return parse_signals(text_at(path), path)


def parse_signals(text: str, path: str = "signals", form: str = FORM) -> Inputs:
    """Read changes of input signals from the content of a file. `form`: the expected format of a line, shown in
    error messages. Raises a FileDamaged error that lists every wrong line.
    """
    changes, wrong = list[InputChange](), list[str]()
    for number, line in enumerate(text.splitlines(), 1):
        fields = fields_of(line)
        if not fields or [field.lower() for field in fields] == list(HEADING):
            continue
        change = _change(fields)
        if isinstance(change, InputChange):
            changes.append(change)
        else:
            wrong.append(f"{path}:{number}: {change}")
    if wrong:
        raise FileDamaged("\n".join(wrong), form)
    return Inputs.of(changes)


def listed_signals(rows: Iterable[tuple[float, int, bool]]) -> Inputs:
    """Convert a list of (time [s], signal, state) to changes of input signals. Raises FileDamaged with all mistakes,
    and ValueError if the list has another form.
    """
    try:
        lines = [f"{plain(float(time))}, {signal}, {int(bool(state))}" for time, signal, state in rows]
    except (TypeError, ValueError):
        raise ValueError(f"signals: {ROW_FORM}") from None
    return parse_signals("\n".join(lines), form=ROW_FORM)


def _change(fields: list[str]) -> InputChange | str:
    """Return the signal change that a line describes, or a message that says what is wrong with the line."""
    if len(fields) != len(HEADING):
        return f"{count(len(fields), 'field')} where 3 are wanted"
    time, signal, state = fields
    seconds = read_number(time)
    if seconds is None or not 0.0 <= seconds <= LATEST:
        return f"{time!r} is no time from 0 to {LATEST:g} s"
    if not signal.isdigit() or not (int(signal) in INPUTS or int(signal) in INTERNAL):
        return f"{signal!r} is no signal {INPUTS[0]}-{INPUTS[-1]} or {INTERNAL[0]}-{INTERNAL[-1]}"
    if state.upper() not in STATES:
        return f"{state!r} is no state (1, 0, ON, OFF)"
    return InputChange(on_grid(seconds), int(signal), STATES[state.upper()])
