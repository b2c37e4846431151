"""What `vrs run` tells about a run: one JSON object, or the error of a program in words."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from vrs_cli.cli.recordings import position_object
from vrs_cli.errors import VrsError
from vrs_cli.language.text.diagnostics import Severity
from vrs_cli.trajectory.instant import shown

if TYPE_CHECKING:
    from vrs_cli.dialogue.runs import RunResult
    from vrs_cli.engine.engine import Engine
    from vrs_cli.language.run.effects import ProgramFault
    from vrs_cli.language.text.diagnostics import Diagnostic

Object = dict[str, Any]
NO_NUMBERS: Mapping[str, object] = MappingProxyType({})


def run_object(engine: Engine, result: RunResult | None, errors: list[Object]) -> Object:
    """The object of `--json` (design.md section 5); `result` is None when nothing could be executed.

    `segments` counts those of motions: the initial pose is none.
    """
    return {
        "program": result.program if result else None,
        "cycles": result.cycles if result else 0,
        "duration_s": shown(result.ended - result.started) if result else 0.0,
        "segments": len(engine.timeline) - len(engine.initial),
        "commands": [
            {
                "text": record.text,
                "t_iss": record.issued,
                "t_asked": record.asked,  # None for a motion that follows another
                "t_exec": record.executed,
                "t_end": record.end,
            }
            for record in engine.records()
        ],
        "final": position_object(engine.position(engine.end), engine.model.units),
        "typed": list(result.typed) if result else [],
        "errors": errors,
    }


def fault_object(fault: ProgramFault) -> Object:
    """An error of a running program."""
    place = (fault.program, fault.step, fault.line)
    return _object(Severity.ERROR, fault.code, fault.message, *place, numbers=fault.numbers)


def diagnostic_objects(diagnostics: Iterable[Diagnostic]) -> list[Object]:
    """What is wrong with a file that could not be executed: errors, and warnings among them."""
    return [_object(one.severity, one.code, one.message, line=one.span.line) for one in diagnostics]


def error_object(error: VrsError) -> Object:
    """What came before a program could be executed."""
    return _object(Severity.ERROR, error.code, str(error), numbers=error.numbers)


def _object(
    severity: Severity,
    code: int,
    message: str,
    program: str | None = None,
    step: int | None = None,
    line: int | None = None,
    numbers: Mapping[str, object] = NO_NUMBERS,
) -> Object:
    """An error or a warning, with the numbers behind it where there are any [m, rad]."""
    place = {"program": program, "step": step, "line": line}
    return {"severity": severity.value, "code": code, "message": message, **place, **numbers}


def fault_text(path: str, fault: ProgramFault) -> str:
    """Where a program stopped and why, with its line and a caret."""
    place = f"{path}:{fault.line}: " if fault.line else ""
    source = fault.source.strip()
    lines = [f"{place}{fault.message}"]
    if source:
        lines += [f"    {source}", f"    {'^' * len(source)}"]
    return "\n".join([*lines, f"Program {fault.program} stopped at step {fault.step}"])
