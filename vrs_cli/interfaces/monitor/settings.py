"""SPEED, signals, switches and parameters at the prompt."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from vrs_cli.dialogue.replies import Message, SettingRow, SettingTable
from vrs_cli.dialogue.talk import Talk
from vrs_cli.engine.commands import SetMonitorSpeed
from vrs_cli.engine.parameters import PARAMETERS, SWITCHES, ParameterRow, row_of
from vrs_cli.interfaces.station.operands import Handler, operand, real, word
from vrs_cli.interfaces.station.station import Station
from vrs_cli.language.text.ast import Instruction
from vrs_cli.language.words.values import plain


def _speed(station: Station, it: Instruction) -> Talk[None]:
    argument = operand(it, 0)
    assert argument is not None
    station.engine.perform(SetMonitorSpeed(real(station, argument)))
    yield from ()


def _signal(station: Station, it: Instruction) -> Talk[None]:
    """As the instruction, and inputs too: at the prompt one stands at the cabinet."""
    signals = station.environment.signals
    numbers = [real(station, argument) for argument in it.arguments if argument is not None]
    for number in numbers:
        signals.read(number)
    for number in numbers:
        signals.write(number, inputs=True)
    station.settle()
    yield from ()


def _as_instruction(station: Station, it: Instruction) -> Talk[None]:
    """A word that does the same at the prompt as in a program, and answers nothing."""
    return station.do(it)


def _calibrate(_station: Station, _it: Instruction) -> Talk[None]:
    yield Message("A virtual robot is calibrated")


def _switch(station: Station, it: Instruction) -> Talk[None]:
    if it.value is not None:
        yield from station.do(it)
        return
    switches = station.engine.settings.switches
    rows = _asked(it, SWITCHES, "switch")
    yield SettingTable(
        "Switch",
        tuple(SettingRow(row.name, "ON" if switches[row.name] else "OFF", row.summary) for row in rows),
    )


def _parameter(station: Station, it: Instruction) -> Talk[None]:
    if it.value is not None:
        yield from station.do(it)
        return
    values = station.engine.settings.parameters
    rows = _asked(it, PARAMETERS, "parameter")
    yield SettingTable(
        "Parameter", tuple(SettingRow(row.name, _with_unit(row, values[row.name]), row.summary) for row in rows)
    )


def _asked(it: Instruction, table: Mapping[str, Any], what: str) -> list[Any]:
    """The rows of the names given, all when none is. Raises UsageError."""
    names = [word(argument) for argument in it.arguments if argument is not None]
    return [row_of(table, name, what) for name in names] or list(table.values())


def _with_unit(row: ParameterRow, value: float | str) -> str:
    return value if isinstance(value, str) else f"{plain(value)} {row.unit}".rstrip()


SETTINGS: Mapping[str, Handler] = {
    "SPEED": _speed,
    "SIGNAL": _signal,
    "RESET": _as_instruction,
    "CALIBRATE": _calibrate,
    "SELECT": _as_instruction,
    "ENABLE": _as_instruction,
    "DISABLE": _as_instruction,
    "SWITCH": _switch,
    "PARAMETER": _parameter,
}
