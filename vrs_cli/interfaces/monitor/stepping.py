"""Programs one step at a time: PRIME, SSTEP, XSTEP, BPT, WATCH."""

from __future__ import annotations

from collections.abc import Mapping

from vrs_cli.errors import IllegalValue
from vrs_cli.interfaces.dialogue import Dialogue
from vrs_cli.interfaces.monitor.running import asked_program, run
from vrs_cli.interfaces.station.operands import Handler, operand, real_or, shown, sight, word
from vrs_cli.interfaces.station.station import Station
from vrs_cli.interfaces.tasks.tasks import Stepping, Watch
from vrs_cli.kinematics.joints import JointUnits
from vrs_cli.language.run.environment import Environment
from vrs_cli.language.run.memory import StoredProgram
from vrs_cli.language.text.ast import Instruction
from vrs_cli.language.words.values import numbers_of, plain, whole
from vrs_cli.values.numbers import Value
from vrs_cli.values.replies import Message, ProgramStopped


def _prime(station: Station, it: Instruction) -> Dialogue[None]:
    task = station.begin(*(yield from asked_program(station, it)), primed=True).task
    yield ProgramStopped("(PRIMED)", task.program, task.step)


def _step(station: Station, it: Instruction) -> Dialogue[None]:
    """SSTEP, XSTEP: of a program that is named, or of the one that has stopped."""
    if operand(it, 0) is not None:
        station.begin(*(yield from asked_program(station, it)), primed=True)
    yield from run(station, station.resume(stepping=Stepping(over=it.word != "XSTEP")))


def _bpt(station: Station, it: Instruction) -> Dialogue[None]:
    debugging, asked, step = station.debugging, operand(it, 0), whole(real_or(station, it, 1, 0.0))
    if asked is not None:
        stored = station.environment.program(word(asked))
        key, last = stored.program.key, len(stored.program.steps)
        yield from station.compiled(stored.name)
        if abs(step) > last:
            raise IllegalValue(f"step {abs(step)}", f"{stored.name} has the steps 1 to {last}")
        if step > 0:
            debugging.breakpoints.add((key, _breakable(station.environment, stored, step)))
        else:
            gone = {point for point in debugging.breakpoints if point[0] == key and step in (0, -point[1])}
            debugging.breakpoints -= gone
    for key, number in sorted(debugging.breakpoints):
        yield Message(f"Breakpoint before step {number} of {key}")
    if not debugging.breakpoints:
        yield Message("No breakpoints")


def _breakable(environment: Environment, stored: StoredProgram, step: int) -> int:
    """The step itself, or the first behind it at which something is done. Raises IllegalValue, ProgramNotExecutable."""
    found = environment.executable(stored).compiled.stand(step - 1)
    if found is None:
        raise IllegalValue(f"step {step}", f"nothing is done there or after it in {stored.name}")
    return found + 1


def _watch(station: Station, it: Instruction) -> Dialogue[None]:
    watches, expression = station.debugging.watches, operand(it, 0)
    if expression is None:
        watches.clear()
        yield Message("Nothing is watched")
        return
    units = station.units
    text = station.environment.signals.said(shown(expression))
    watch = Watch(text, sight(station, expression), lambda value: _value_text(value, units))
    watch.changed()
    watches.append(watch)
    yield Message(f"Programs stop when {watch.text} changes")


def _value_text(value: Value, units: JointUnits) -> str:
    if isinstance(value, str):
        return f'"{value}"'
    numbers = (value,) if isinstance(value, float) else numbers_of(value, units)
    return ", ".join(plain(round(number, 3)) for number in numbers)


STEPPING: Mapping[str, Handler] = {
    "PRIME": _prime,
    "SSTEP": _step,
    "XSTEP": _step,
    "NEXT": _step,
    "BPT": _bpt,
    "WATCH": _watch,
}
