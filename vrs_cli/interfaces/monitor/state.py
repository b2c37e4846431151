"""Commands that tell STATUS, signals, the time, the memory and help, and that set SPEED, signals, switches,
parameters, CLOCK (pause a clock of real time, let it go on, change its rate), and what the robot's BODY is to do.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import Any

from vrs_cli.engine.clock import FASTEST_RATE, SLOWEST_RATE, WallClock
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.settings import (
    IDLE_PARAMETERS,
    IDLE_SWITCHES,
    PARAMETERS,
    SWITCHES,
    Idle,
    ParameterRow,
    Settings,
    Switch,
    idle_of,
    row_of,
)
from vrs_cli.errors import IllegalValue, RequestRefused, UsageError
from vrs_cli.interfaces.dialogue import Dialogue
from vrs_cli.interfaces.monitor.help import help_on
from vrs_cli.interfaces.rights import check_may, role_of
from vrs_cli.interfaces.station.operands import Handler, leave, moment, operand, real, real_or, word
from vrs_cli.interfaces.station.station import Station
from vrs_cli.interfaces.tasks.performing import by_robot_clock
from vrs_cli.language.run.effects import PROCESS_CONTROL
from vrs_cli.language.run.memory import stamp_of
from vrs_cli.language.run.semantics.instructions import MODE_WORDS, checked_task
from vrs_cli.language.text.ast import BareWord, Instruction
from vrs_cli.language.text.printer import statement_text
from vrs_cli.language.words.monitor import BODY_WORDS, CLOCK_WORDS, STOP
from vrs_cli.language.words.values import INPUTS, INTERNAL, OUTPUTS, plain, read_number, whole
from vrs_cli.language.words.word import Role
from vrs_cli.values.commands import SetMonitorSpeed
from vrs_cli.values.measured import OnAlarm
from vrs_cli.values.replies import (
    BodyReport,
    ClockReport,
    FileText,
    FreeReport,
    Identification,
    Message,
    Progress,
    Reply,
    Resynchronised,
    SettingRow,
    SettingTable,
    SignalBank,
    SignalTable,
    StatusReport,
    StatusThen,
)
from vrs_cli.version import __version__


def _status(station: Station, it: Instruction) -> Iterable[Reply]:
    """STATUS, of a task; AT t: of the robot, whatever ran then."""
    if it.modifiers.timed:
        if operand(it, 0) is not None:
            raise IllegalValue("STATUS of a task AT a time", "STATUS AT t tells where the robot is then")
        yield _status_then(station, moment(station, it))
        return
    yield _status_now(station, checked_task(real_or(station, it, 0, 0.0)))


def _status_then(station: Station, t: float) -> StatusThen:
    engine, signals = station.engine, station.environment.signals
    position = engine.position(t)
    on = signals.at(t)
    return StatusThen(
        time=t,
        motion=position.text if position.moving else "",
        configuration=engine.arm.configuration(position.joints),
        hand=position.hand,
        on=on,
        names={number: signals.names[number] for number in on if number in signals.names},
    )


def _status_now(station: Station, number: int) -> StatusReport:
    engine, settings = station.engine, station.engine.settings
    speed = settings.speed.always
    return StatusReport(
        robot=engine.model.title,
        progress=_progress(station, number),
        monitor_speed=settings.monitor_speed,
        program_speed=f"{plain(speed.value)} {speed.unit.value}",
        power=settings.switch("POWER"),
        clock=engine.now,
        end=engine.end,
        configuration=engine.arm.configuration(engine.position().joints),
        next_motion=_said_for_next_motion(engine),
    )


def _progress(station: Station, number: int) -> Progress | None:
    track = station.tasks.get(number)
    if track is None:
        return None
    task = track.task
    left = None if task.cycles < 0 else task.cycles - task.cycles_done
    return Progress(task.program, task.state.value, None if task.ended else task.step, task.cycles_done, left)


def _said_for_next_motion(engine: Engine) -> tuple[str, ...]:
    """Configuration words that the arm does not have yet, and settings for one motion, in the words of the language."""
    settings, have = engine.settings, engine.arm.configuration(engine.destination(engine.end).joints)
    said = list(settings.configuration.words_beside((have,)))
    if (speed := settings.speed.once) is not None:
        said.append(f"SPEED {plain(speed.value)} {speed.unit.value}")
    if settings.duration.once is not None:
        said.append(f"DURATION {plain(settings.duration.once)} s")
    if settings.swivel.once is not None and (swivel := settings.swivel.once.swivel) is not None:
        at = "" if swivel.value is None else f" to {engine.model.said(swivel.joint, swivel.value)}"
        said.append(f"SWIVEL of joint {swivel.joint}{at}")
    said += (word for word, (mode, on) in MODE_WORDS.items() if settings.modes[mode].once is on)
    if settings.hand is not None:
        said.append("OPEN" if settings.hand else "CLOSE")
    return tuple(said)


BANKS: Mapping[int, tuple[str, range]] = {
    0: ("Inputs", INPUTS),
    1: ("Outputs", OUTPUTS),
    2: ("Internal signals", INTERNAL),
}
INTERNAL_BANK = 2


def _io(station: Station, it: Instruction) -> Iterable[Reply]:
    """IO; AT t: without the internal signals, which are variables."""
    asked, timed = operand(it, 0), it.modifiers.timed
    number = None if asked is None else whole(real(station, asked))
    if number is not None and number not in BANKS:
        raise IllegalValue(f"IO {number}", "0 inputs, 1 outputs, 2 internal signals")
    if number == INTERNAL_BANK and timed:
        raise IllegalValue("IO 2 AT a time", "internal signals are variables: IO 2 tells what they are now")
    chosen = (number,) if number is not None else [one for one in BANKS if not (timed and one == INTERNAL_BANK)]
    signals, rows = station.environment.signals, list[SignalBank]()
    on = frozenset(signals.at(moment(station, it)) if timed else signals.on)
    for title, bank in map(BANKS.__getitem__, chosen):
        names = {number: name for number, name in sorted(signals.names.items()) if number in bank}
        rows.append(SignalBank(title, bank[0], tuple(number in on for number in bank), names))
    yield SignalTable(tuple(rows))


def _id(station: Station, _it: Instruction) -> Iterable[Reply]:
    model, python = station.engine.model, ".".join(map(str, sys.version_info[:3]))
    yield Identification(__version__, python, model.title, model.name, model.joint_count)


def _free(station: Station, _it: Instruction) -> Iterable[Reply]:
    environment = station.environment
    yield FreeReport(
        programs=len(environment.programs),
        steps=sum(len(stored.program.steps) for stored in environment.programs.values()),
        variables=environment.count(),
        segments=len(station.engine.timeline),
        percent=free_memory(),
    )


def free_memory() -> float | None:
    """Return how much of the computer's memory is free [%]; None where the system does not say."""
    try:
        return 100.0 * os.sysconf("SC_AVPHYS_PAGES") / os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError, ZeroDivisionError):
        return None


def _history(station: Station, it: Instruction) -> Iterable[Reply]:
    """The lines that the user has typed, without this one."""
    typed = tuple(station.user_state.typed)[:-1]
    first = max(len(typed) - whole(real_or(station, it, 0, float(len(typed)))), 0)
    yield FileText(tuple(f"{number:5d}  {line}" for number, line in enumerate(typed, 1) if number > first))


def _speed(station: Station, it: Instruction) -> None:
    argument = operand(it, 0)
    assert argument is not None
    station.engine.perform(SetMonitorSpeed(real(station, argument)))


def _signal(station: Station, it: Instruction) -> None:
    """SIGNAL, as the instruction; at the prompt it sets inputs too, as a user at the cabinet can."""
    signals, text = station.environment.signals, statement_text(it)
    numbers = [real(station, argument) for argument in it.arguments if argument is not None]
    at, within = (None if time is None else real(station, time) for time in (it.modifiers.at, it.modifiers.within))
    stamp = stamp_of(at, within)
    signals.check_not_sensed(numbers)
    if stamp is None:
        signals.write(*numbers, text=text, inputs=True)
    else:
        request = signals.request(numbers, stamp, text, inputs=True)
        station.engine.perform(by_robot_clock(request, station.user_state.times))
    station.settle()


RATES = f"CLOCK RATE = {SLOWEST_RATE:g} to {FASTEST_RATE:g}"


def _clock(station: Station, it: Instruction) -> Dialogue[None]:
    """CLOCK, CLOCK PAUSE, CLOCK GO, CLOCK RATE = r. Raises UsageError, IllegalValue."""
    if it.arguments:
        word, time = it.arguments[0], station.engine.clock
        assert isinstance(word, BareWord)
        if not isinstance(time, WallClock):
            raise UsageError("time is the robot's own here, and passes only when something waits", "vrs --realtime")
        _change_clock(time, word.text.upper(), it.value)
        station.settle()  # it has gone on since the line was given, and may stand now
    yield clock_report(station)


def clock_report(station: Station) -> ClockReport:
    """Tell the present clock."""
    time = station.engine.clock
    return ClockReport(time.now, time.rate if isinstance(time, WallClock) else None, time.paused)


def _change_clock(time: WallClock, word: str, value: object) -> None:
    if word == "RATE":
        given = value.text if isinstance(value, BareWord) else "nothing"
        rate = read_number(given)
        if rate is None or not SLOWEST_RATE <= rate <= FASTEST_RATE:
            raise IllegalValue(f"a rate of {given}", RATES)
        time.change(rate=rate)
    elif word in CLOCK_WORDS and value is None:
        time.change(paused=word == "PAUSE")
    else:
        raise UsageError(f"CLOCK {word}", f"CLOCK PAUSE, CLOCK GO, {RATES}")


def _body(station: Station, it: Instruction) -> Dialogue[None]:
    """BODY, BODY RELEASE, BODY with what is done on an alarm. Raises UsageError, RoleWanted, LeaseHeld,
    RequestRefused.
    """
    body, divergence = station.body, station.divergence
    if operand(it, 0) is None:
        yield BodyReport(body.seen, body.unknown_since, divergence.on_alarm, divergence.alarm)
        return
    said = word(it.arguments[0]).upper()
    if said not in BODY_WORDS:
        raise UsageError(f"BODY {said}", ", ".join(("BODY", *(f"BODY {known}" for known in BODY_WORDS))))
    if said != "RELEASE":
        station.check_may(f"BODY {said}", role_of("PARAMETER"))
        divergence.choose(OnAlarm[said])
        yield Message(f"On an alarm of the body: {BODY_WORDS[said]}")
        return
    check_may("BODY RELEASE", Role.SUPERVISOR, station.user_state.role)
    name = body.name
    if not body.leave(name):
        raise RequestRefused("no client is the body", "BODY tells what was reported")
    yield Message(f"{name} is the body no longer")


def _resync(station: Station, it: Instruction) -> Dialogue[None]:
    """RESYNC [STOP]. Raises UsageError, RequestRefused, MotionError."""
    said = "" if operand(it, 0) is None else word(it.arguments[0]).upper()
    if said not in ("", STOP):
        raise UsageError(f"RESYNC {said}", f"RESYNC, RESYNC {STOP}")
    yield Resynchronised((yield from station.resync(stops=said == STOP)), station.units)


_Tables = tuple[Mapping[str, Any], Mapping[str, Idle]]  # what there is, and what has no effect


def _table(
    title: str, tables: _Tables, value: Callable[[Settings, Any, str], str], station: Station, it: Instruction
) -> Dialogue[None]:
    """SWITCH, PARAMETER: give one a value, or show those that are named, or all. Raises UsageError."""
    if it.value is not None:
        yield from _set(tables[1], station, it)
        return
    names = [word(argument).upper() for argument in it.arguments if argument is not None] or tables[0]
    settings = station.engine.settings
    shown = ((name, idle_of(tables[1], name) or row_of(tables[0], name, title.lower())) for name in names)
    rows = [(name if isinstance(row, Idle) else row.name, row) for name, row in shown]
    yield SettingTable(title, tuple(SettingRow(name, value(settings, row, name), _told(row)) for name, row in rows))


def _told(row: Switch | ParameterRow | Idle) -> str:
    return f"no effect here: {row.summary}" if isinstance(row, Idle) else row.summary


def _set(idle: Mapping[str, Idle], station: Station, it: Instruction) -> Dialogue[None]:
    """Set it as in a program, and tell where that has no effect."""
    yield from station.do(it)
    for argument in it.arguments:
        row = None if argument is None else idle_of(idle, word(argument))
        if row is not None:
            yield Message(f"{row.name}: {_told(row)}")


def _switch(settings: Settings, _row: Switch | Idle, name: str) -> str:
    return "ON" if settings.switch(name) else "OFF"


def _parameter(settings: Settings, row: ParameterRow | Idle, name: str) -> str:
    value = settings.parameter(name)
    unit = "" if isinstance(row, Idle) else row.unit
    return value if isinstance(value, str) else f"{plain(value)} {unit}".rstrip()


STATE: Mapping[str, Handler] = {
    "STATUS": _status,
    "PCSTATUS": lambda station, _it: (_status_now(station, PROCESS_CONTROL),),
    "IO": _io,
    "CLOCK": _clock,
    "BODY": _body,
    "RESYNC": _resync,
    "TIME": lambda station, _it: (clock_report(station),),
    "ID": _id,
    "FREE": _free,
    "HELP": lambda _station, it: help_on(word(it.arguments[0]) if operand(it, 0) is not None else ""),
    "HISTORY": _history,
    "EXIT": lambda station, _it: leave(station),
    "QUIT": lambda station, _it: leave(station),
    "SPEED": _speed,
    "SIGNAL": _signal,
    "CALIBRATE": lambda _station, _it: (Message("A virtual robot is calibrated"),),
    **dict.fromkeys(("RESET", "SELECT"), Station.do),  # the same as in a program
    **dict.fromkeys(("ENABLE", "DISABLE"), partial(_set, IDLE_SWITCHES)),
    "SWITCH": partial(_table, "Switch", (SWITCHES, IDLE_SWITCHES), _switch),
    "PARAMETER": partial(_table, "Parameter", (PARAMETERS, IDLE_PARAMETERS), _parameter),
}
