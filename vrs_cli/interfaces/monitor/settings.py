"""SPEED, signals, switches and parameters at the prompt."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from vrs_cli.dialogue.replies import Message, SettingRow, SettingTable
from vrs_cli.dialogue.talk import Talk
from vrs_cli.engine.commands import SetMonitorSpeed
from vrs_cli.engine.parameters import PARAMETERS, SWITCHES, ParameterRow, Switch, row_of
from vrs_cli.engine.settings import Settings
from vrs_cli.interfaces.station.operands import Handler, operand, real, word
from vrs_cli.interfaces.station.station import Station
from vrs_cli.language.text.ast import Instruction
from vrs_cli.language.words.values import plain


def _speed(station: Station, it: Instruction) -> None:
    argument = operand(it, 0)
    assert argument is not None
    station.engine.perform(SetMonitorSpeed(real(station, argument)))


def _signal(station: Station, it: Instruction) -> None:
    """As the instruction, and inputs too: at the prompt one stands at the cabinet."""
    signals = station.environment.signals
    numbers = [real(station, argument) for argument in it.arguments if argument is not None]
    for number in numbers:
        signals.read(number)
    for number in numbers:
        signals.write(number, inputs=True)
    station.settle()


def _table(
    title: str, table: Mapping[str, Any], value: Callable[[Settings, Any], str], station: Station, it: Instruction
) -> Talk[None]:
    """SWITCH, PARAMETER: give one a value, or show those that are named, all when none is. Raises UsageError."""
    if it.value is not None:
        yield from station.do(it)
        return
    names = [word(argument) for argument in it.arguments if argument is not None]
    rows = [row_of(table, name, title.lower()) for name in names] or table.values()
    settings = station.engine.settings
    yield SettingTable(title, tuple(SettingRow(row.name, value(settings, row), row.summary) for row in rows))


def _switch(settings: Settings, row: Switch) -> str:
    return "ON" if settings.switches[row.name] else "OFF"


def _parameter(settings: Settings, row: ParameterRow) -> str:
    value = settings.parameters[row.name]
    return value if isinstance(value, str) else f"{plain(value)} {row.unit}".rstrip()


SETTINGS: Mapping[str, Handler] = {
    "SPEED": _speed,
    "SIGNAL": _signal,
    "CALIBRATE": lambda _station, _it: (Message("A virtual robot is calibrated"),),
    **dict.fromkeys(("RESET", "SELECT", "ENABLE", "DISABLE"), Station.do),  # the same as in a program
    "SWITCH": partial(_table, "Switch", SWITCHES, _switch),
    "PARAMETER": partial(_table, "Parameter", PARAMETERS, _parameter),
}
