"""COMMANDS: a file of monitor commands, carried out line by line up to the first that fails.

The commands stand between `.PROGRAM name` and `.END`, or alone in the file; `MC` before a command is accepted (a
command program of V+ has it), and so are blank lines and comments. Lines after EDIT go to the editor up to `E`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from vrs_cli.dialogue.replies import Diagnosed, DiagnosticsReport, Farewell, Message, Reply, Tone, is_error
from vrs_cli.errors import CannotInterpret, UsageError, VrsError
from vrs_cli.language.text.source import END, PROGRAM, SECTIONS, lines_of

if TYPE_CHECKING:
    from vrs_cli.interfaces.session.session import Session

_MC = re.compile(r"(\s*)MC(?=\s)", re.IGNORECASE)


class CommandLine(NamedTuple):
    """A command and the line of its file, from 1."""

    number: int
    text: str


def command_lines(text: str) -> tuple[CommandLine, ...]:
    """The lines that are carried out, without `MC`. Raises CannotInterpret for a file that holds something else."""
    lines = [line for line in lines_of(text) if line.text.strip()]
    found: list[CommandLine] = []
    opened = closed = False
    for line in lines:
        remark = line.text.lstrip().startswith(";")
        if line.directive in SECTIONS or (line.directive == PROGRAM and opened):
            raise CannotInterpret(f"line {line.number}: {line.directive}", "a command file holds one .PROGRAM to .END")
        if line.directive == PROGRAM and not found:
            opened = True
        elif line.directive == END and opened:
            closed = True
        elif closed and not remark:
            raise CannotInterpret(f"line {line.number} stands after .END", "a command file ends there")
        elif not remark:
            found.append(CommandLine(line.number, _MC.sub(r"\1", line.text, count=1).strip()))
    return tuple(found)


def carried_out(session: Session, named: Path) -> Iterator[Reply]:
    """The answers of the commands; the first that fails is named with its line, and ends it.

    Raises NonexistentFile, FileError, FileDamaged, CannotInterpret, UsageError.
    """
    from vrs_cli.files.program_file import find_program_file, read_program_file

    path = find_program_file(named)
    lines = command_lines(read_program_file(path))
    if any(path.samefile(running) for running in session.command_files):
        raise UsageError(f"{path} is being carried out", "a command file cannot call itself")
    session.command_files.append(path)
    try:
        yield from _answers(session, path, lines)
    finally:
        session.command_files.pop()


def _answers(session: Session, path: Path, lines: tuple[CommandLine, ...]) -> Iterator[Reply]:
    for line in lines:
        failed = leaving = False
        try:
            for reply in session.answers(line.text):
                failed = failed or is_error(reply)
                leaving = leaving or isinstance(reply, Farewell)
                yield reply
        except VrsError as error:
            failed = True
            yield _told(error, line)
        if failed:
            session.editor = None
            yield Message(f"{path} stopped at line {line.number}: {line.text}", Tone.ERROR)
        if failed or leaving or session.interrupted:
            return


def _told(error: VrsError, line: CommandLine) -> Reply:
    from vrs_cli.language.text.diagnostics import LineRefused

    if isinstance(error, LineRefused):
        return DiagnosticsReport((Diagnosed(error.diagnostic, line.text),))
    return Message(str(error), Tone.ERROR)
