"""The file of `vrs run --signals`: when input signals change, one change a line.

    ; time [s], signal, state
    0.5, 1001, 1
    2.25, 1001, OFF

Blank lines, comments (`;` or `#`) and a heading of the columns are passed over. A state is 1, 0, ON, OFF, TRUE
or FALSE; times may stand in any order.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from vrs_cli.errors import FileDamaged
from vrs_cli.files.opening import text_at
from vrs_cli.files.target_file import fields_of
from vrs_cli.language.run.signals import InputChange, Inputs
from vrs_cli.language.words.values import INPUTS, INTERNAL, plain, read_number
from vrs_cli.trajectory.instant import LATEST, on_grid
from vrs_cli.values.numbers import count

HEADING = ("time", "signal", "state")
STATES: Mapping[str, bool] = {"1": True, "ON": True, "TRUE": True, "0": False, "OFF": False, "FALSE": False}
FORM = "time, signal, state, such as 0.5, 1001, ON"


def read_signals(path: str) -> Inputs:
    """Raises NonexistentFile, and FileDamaged which names every line that is wrong."""
    return parse_signals(text_at(path), path)


def parse_signals(text: str, path: str = "signals") -> Inputs:
    """The changes that a text names. Raises FileDamaged with all lines that are wrong."""
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
        raise FileDamaged("\n".join(wrong), f"a line is {FORM}")
    return Inputs.of(changes)


def listed_signals(rows: Iterable[tuple[float, int, bool]]) -> Inputs:
    """The changes of a list of (time [s], signal, state). Raises FileDamaged with all that are wrong."""
    lines = (f"{plain(time)}, {signal}, {int(bool(state))}" for time, signal, state in rows)
    return parse_signals("\n".join(lines))


def _change(fields: list[str]) -> InputChange | str:
    """The change of a line, or what is wrong with it."""
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
