"""What is: STATUS, signals, the time, the memory, help."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Mapping

from vrs_cli.dialogue.replies import (
    FreeReport,
    Identification,
    Progress,
    Reply,
    SignalBank,
    SignalTable,
    StatusReport,
)
from vrs_cli.engine.engine import Engine
from vrs_cli.errors import IllegalValue
from vrs_cli.interfaces.monitor.clock import clock_report
from vrs_cli.interfaces.monitor.consent import leave
from vrs_cli.interfaces.monitor.help import overview, page
from vrs_cli.interfaces.monitor.running import of_task
from vrs_cli.interfaces.station.operands import Handler, operand, real, word
from vrs_cli.interfaces.station.station import Station
from vrs_cli.language.run.semantics.settings import MODE_WORDS
from vrs_cli.language.run.semantics.tasks import PROCESS_CONTROL
from vrs_cli.language.text.ast import Instruction
from vrs_cli.language.words.signals import INPUTS, INTERNAL, OUTPUTS
from vrs_cli.language.words.values import plain, whole
from vrs_cli.version import __version__


def _status(station: Station, number: int) -> Iterable[Reply]:
    engine, settings = station.engine, station.engine.settings
    speed = settings.speed.always
    yield StatusReport(
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
    said += (word for word, (mode, on) in MODE_WORDS.items() if settings.modes[mode].once is on)
    if settings.hand is not None:
        said.append("OPEN" if settings.hand else "CLOSE")
    return tuple(said)


BANKS: Mapping[int, tuple[str, range]] = {
    0: ("Inputs", INPUTS),
    1: ("Outputs", OUTPUTS),
    2: ("Internal signals", INTERNAL),
}


def _io(station: Station, it: Instruction) -> Iterable[Reply]:
    asked = operand(it, 0)
    number = None if asked is None else whole(real(station, asked))
    if number is not None and number not in BANKS:
        raise IllegalValue(f"IO {number}", "0 inputs, 1 outputs, 2 internal signals")
    chosen = BANKS.values() if number is None else (BANKS[number],)
    signals = station.environment.signals
    yield SignalTable(tuple(SignalBank(title, bank[0], signals.state(bank)) for title, bank in chosen))


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
    """How much of the computer's memory is free [%]; None where the system does not say."""
    try:
        return 100.0 * os.sysconf("SC_AVPHYS_PAGES") / os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError, ZeroDivisionError):
        return None


def _help(_station: Station, it: Instruction) -> Iterable[Reply]:
    asked = operand(it, 0)
    yield overview() if asked is None else page(word(asked))


STATE: Mapping[str, Handler] = {
    "STATUS": of_task(_status),
    "PCSTATUS": of_task(_status, PROCESS_CONTROL),
    "IO": _io,
    "TIME": lambda station, _it: (clock_report(station),),
    "ID": _id,
    "FREE": _free,
    "HELP": _help,
    "EXIT": lambda station, _it: leave(station),
    "QUIT": lambda station, _it: leave(station),
}
