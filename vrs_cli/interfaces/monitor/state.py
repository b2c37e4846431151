"""Commands that show STATUS, signals, the time, the memory and help, and commands that set SPEED, signals, switches,
parameters, the CLOCK (pause and resume a real-time clock, change its rate), and the BODY (the real or simulated arm
that executes the motions).
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Mapping
from typing import Any

from vrs_cli.engine import settings
from vrs_cli.engine.clock import FASTEST_RATE, SLOWEST_RATE, WallClock
from vrs_cli.engine.engine import Engine
from vrs_cli.errors import IllegalValue, RequestRefused, UsageError
from vrs_cli.interfaces import dialogue, users
from vrs_cli.interfaces.monitor.help import help_on
from vrs_cli.interfaces.station.operands import handles, moment, operand, real, real_or, word, word_or, words
from vrs_cli.interfaces.station.station import Station
from vrs_cli.interfaces.tasks.performing import by_robot_clock
from vrs_cli.language.run import effects, memory
from vrs_cli.language.run.semantics.instructions import MODE_WORDS, checked_task
from vrs_cli.language.text import ast, printer
from vrs_cli.language.words import monitor, values
from vrs_cli.language.words.word import Role
from vrs_cli.values import commands, measured, replies, results
from vrs_cli.version import __version__


@handles("STATUS")
@handles("PCSTATUS", number=effects.PROCESS_CONTROL)
def _tell_status(station: Station, it: ast.Instruction, number: int | None = None) -> Iterable[replies.Reply]:
    """Report the state of the robot and of a task. For a given time (AT), report only the state of the robot."""
    if not it.modifiers.has_time:
        yield _present_status(station, checked_task(real_or(station, it, 0, 0.0)) if number is None else number)
        return
    if operand(it, 0) is not None:
        raise IllegalValue("STATUS of a task AT a time", "STATUS AT t tells where the robot is then")
    engine, signals, t = station.engine, station.environment.signals, moment(station, it)
    position, on = engine.position(t), signals.at(t)
    yield replies.StatusThen(
        time=t,
        motion=position.text if position.moving else "",
        configuration=engine.arm.configuration(position.joints),
        hand=position.hand,
        on=on,
        names={number: signals.names[number] for number in on if number in signals.names},
    )


def _present_status(station: Station, number: int) -> replies.StatusReport:
    """Return the current state of the robot and of the task with a number."""
    engine, present, track = station.engine, station.engine.settings, station.tasks.get(number)
    speed, progress = present.speed.always, None
    if track is not None:
        task = track.task
        left = None if task.cycles < 0 else task.cycles - task.cycles_done
        progress = replies.Progress(
            task.program, task.state.value, None if task.is_over else task.step, task.cycles_done, left
        )
    return replies.StatusReport(
        robot=engine.model.title,
        progress=progress,
        monitor_speed=present.monitor_speed,
        program_speed=f"{values.plain(speed.value)} {speed.unit.value}",
        power=present.switch("POWER"),
        clock=engine.now,
        end=engine.end,
        configuration=engine.arm.configuration(engine.position().joints),
        next_motion=_words_for_next_motion(engine),
    )


def _words_for_next_motion(engine: Engine) -> tuple[str, ...]:
    """Return the words that take effect with the next motion: configuration words that the arm does not yet satisfy,
    and settings for one motion."""
    present, have = engine.settings, engine.arm.configuration(engine.destination(engine.end).joints)
    said = list(present.configuration.words_beside((have,)))
    if (speed := present.speed.once) is not None:
        said.append(f"SPEED {values.plain(speed.value)} {speed.unit.value}")
    if present.duration.once is not None:
        said.append(f"DURATION {values.plain(present.duration.once)} s")
    if present.swivel.once is not None and (swivel := present.swivel.once.swivel) is not None:
        at = "" if swivel.value is None else f" to {engine.model.joint_text(swivel.joint, swivel.value)}"
        said.append(f"SWIVEL of joint {swivel.joint}{at}")
    said += (word for word, (mode, on) in MODE_WORDS.items() if present.modes[mode].once is on)
    if present.hand is not None:
        said.append("OPEN" if present.hand else "CLOSE")
    return tuple(said)


BANKS = (("Inputs", values.INPUTS), ("Outputs", values.OUTPUTS), ("Internal signals", values.INTERNAL))


@handles("IO")
def _tell_signals(station: Station, it: ast.Instruction) -> Iterable[replies.Reply]:
    """Report the states of signals. If a time is given, leave out the internal signals, because their earlier states
    are not stored."""
    given, timed = operand(it, 0), it.modifiers.has_time
    number = None if given is None else values.whole(real(station, given))
    if number is not None and number not in range(len(BANKS)):
        raise IllegalValue(f"IO {number}", "0 inputs, 1 outputs, 2 internal signals")
    if number == 2 and timed:
        raise IllegalValue("IO 2 AT a time", "internal signals are variables: IO 2 tells what they are now")
    signals, banks = station.environment.signals, BANKS[: 2 if timed else 3] if number is None else (BANKS[number],)
    on, names = frozenset(signals.at(moment(station, it)) if timed else signals.on), sorted(signals.names.items())
    yield replies.SignalTable(
        tuple(
            replies.SignalBank(
                title,
                bank[0],
                tuple(signal in on for signal in bank),
                {signal: name for signal, name in names if signal in bank},
            )
            for title, bank in banks
        )
    )


@handles("ID")
def _identify(station: Station, _it: ast.Instruction) -> Iterable[replies.Reply]:
    model, python = station.engine.model, ".".join(map(str, sys.version_info[:3]))
    yield replies.Identification(__version__, python, model.title, model.name, model.joint_count)


handles("CALIBRATE")(lambda _station, _it: (results.Message("A virtual robot is calibrated"),))
handles("HELP")(lambda _station, it: help_on(word_or(it, 0)))
handles("SPEED")(lambda station, it: station.engine.perform(commands.SetMonitorSpeed(real(station, it.arguments[0]))))


@handles("FREE")
def _tell_memory(station: Station, _it: ast.Instruction) -> Iterable[replies.Reply]:
    environment = station.environment
    yield replies.FreeReport(
        programs=len(environment.programs),
        steps=sum(len(stored.program.steps) for stored in environment.programs.values()),
        variables=environment.count(),
        segments=len(station.engine.timeline),
        percent=free_memory(),
    )


def free_memory() -> float | None:
    """Return how much of the computer's memory is free [%]; None if the operating system does not report it."""
    try:
        return 100.0 * os.sysconf("SC_AVPHYS_PAGES") / os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError, ZeroDivisionError):
        return None


@handles("HISTORY")
def _tell_history(station: Station, it: ast.Instruction) -> Iterable[replies.Reply]:
    """List the lines that the user has typed, without the current one."""
    typed = tuple(station.user_state.typed)[:-1]
    first = max(len(typed) - values.whole(real_or(station, it, 0, float(len(typed)))), 0)
    yield replies.FileText(tuple(f"{number:5d}  {line}" for number, line in enumerate(typed, 1) if number > first))


@handles("SIGNAL")
def _set_signals(station: Station, it: ast.Instruction) -> None:
    """Set signals as the instruction SIGNAL does, but also inputs, as a person at the controller cabinet could."""
    signals, text = station.environment.signals, printer.statement_text(it)
    numbers = [real(station, argument) for argument in it.arguments if argument is not None]
    at, within = (None if time is None else real(station, time) for time in (it.modifiers.at, it.modifiers.within))
    stamp = memory.stamp_of(at, within)
    signals.check_not_sensed(numbers)
    if stamp is None:
        signals.write(*numbers, text=text, inputs=True)
    else:
        station.engine.perform(
            by_robot_clock(signals.request(numbers, stamp, text, inputs=True), station.user_state.times)
        )
    station.settle()


RATES = f"CLOCK RATE = {SLOWEST_RATE:g} to {FASTEST_RATE:g}"


@handles("CLOCK", "TIME")
def _clock(station: Station, it: ast.Instruction) -> Iterable[replies.Reply]:
    """Report the clock. An argument first pauses or resumes the clock, or changes its rate. Raises UsageError,
    IllegalValue."""
    clock = station.engine.clock
    if it.arguments:
        if not isinstance(clock, WallClock):
            raise UsageError("time is the robot's own here, and passes only when something waits", "vrs --realtime")
        action = word(it.arguments[0]).upper()
        if action == "RATE":
            given = it.value.text if isinstance(it.value, ast.BareWord) else "nothing"
            if (rate := values.read_number(given)) is None or not SLOWEST_RATE <= rate <= FASTEST_RATE:
                raise IllegalValue(f"a rate of {given}", RATES)
            clock.change(rate=rate)
        elif action in monitor.CLOCK_WORDS and it.value is None:
            clock.change(paused=action == "PAUSE")
        else:
            raise UsageError(f"CLOCK {action}", f"CLOCK PAUSE, CLOCK GO, {RATES}")
        station.settle()  # carry out the events of the time that has passed since the line was typed
    yield replies.ClockReport(clock.now, clock.rate if isinstance(clock, WallClock) else None, clock.paused)


@handles("BODY")
def _body(station: Station, it: ast.Instruction) -> dialogue.Dialogue[None]:
    """Report the state of the body (the real or simulated arm), release it, or set the reaction to its alarms. Raises
    UsageError, RoleWanted, LeaseHeld, RequestRefused."""
    body, divergence = station.body, station.divergence
    if operand(it, 0) is None:
        yield replies.BodyReport(body.view, body.unknown_since, divergence.on_alarm, divergence.alarm)
        return
    action = word(it.arguments[0]).upper()
    if action not in monitor.BODY_WORDS:
        raise UsageError(f"BODY {action}", ", ".join(("BODY", *(f"BODY {known}" for known in monitor.BODY_WORDS))))
    if action != "RELEASE":
        station.check_may(f"BODY {action}", users.role_of("PARAMETER"))
        divergence.choose(measured.OnAlarm[action])
        yield results.Message(f"On an alarm of the body: {monitor.BODY_WORDS[action]}")
        return
    users.check_may("BODY RELEASE", Role.SUPERVISOR, station.user_state.role)
    name = body.name
    if not body.leave(name):
        raise RequestRefused("no client is the body", "BODY tells what was reported")
    yield results.Message(f"{name} is the body no longer")


@handles("RESYNC")
def _resync(station: Station, it: ast.Instruction) -> dialogue.Dialogue[None]:
    """Make the body (the real or simulated arm) and the timeline agree again. Raises UsageError, RequestRefused,
    MotionError."""
    how = word_or(it, 0).upper()
    if how not in ("", monitor.STOP):
        raise UsageError(f"RESYNC {how}", f"RESYNC, RESYNC {monitor.STOP}")
    yield replies.Resynchronised((yield from station.resync(stops=how == monitor.STOP)), station.units)


# --- switches and parameters -----------------------------------------------------------------------------------------

handles("RESET", "SELECT")(Station.do)  # these commands do the same as the instructions in a program


@handles("ENABLE", "DISABLE", idle_rows=settings.IDLE_SWITCHES)
def _set(station: Station, it: ast.Instruction, idle_rows: Mapping[str, settings.Idle]) -> dialogue.Dialogue[None]:
    """Set switches or a parameter as a program does. Report which of them have no effect on a virtual robot."""
    yield from station.do(it)
    for argument in it.arguments:
        if argument is not None and (row := settings.idle_of(idle_rows, word(argument))) is not None:
            yield results.Message(f"{row.name}: {_summary(row)}")


def _summary(row: settings.Switch | settings.ParameterRow | settings.Idle) -> str:
    return f"no effect here: {row.summary}" if isinstance(row, settings.Idle) else row.summary


@handles("SWITCH", title="Switch", rows=settings.SWITCHES, idle_rows=settings.IDLE_SWITCHES)
@handles("PARAMETER", title="Parameter", rows=settings.PARAMETERS, idle_rows=settings.IDLE_PARAMETERS)
def _set_or_list(
    station: Station, it: ast.Instruction, title: str, rows: Mapping[str, Any], idle_rows: Mapping[str, settings.Idle]
) -> dialogue.Dialogue[None]:
    """Set a switch or a parameter. If no value is given, list the named switches or parameters, or all of them.
    `title`: what they are called; `rows`: their table; `idle_rows`: those without effect. Raises UsageError."""
    if it.value is not None:
        yield from _set(station, it, idle_rows)
        return
    present, found = station.engine.settings, list[replies.SettingRow]()
    for name in [one.upper() for one in words(it)] or rows:
        row = settings.idle_of(idle_rows, name) or settings.row_of(rows, name, title.lower())
        full_name = name if isinstance(row, settings.Idle) else row.name
        if title == "Switch":
            value = "ON" if present.switch(full_name) else "OFF"
        else:
            number = present.parameter(full_name)
            unit = "" if isinstance(row, settings.Idle) else row.unit
            value = number if isinstance(number, str) else f"{values.plain(number)} {unit}".rstrip()
        found.append(replies.SettingRow(full_name, value, _summary(row)))
    yield replies.SettingTable(title, tuple(found))
