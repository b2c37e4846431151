"""COMMANDS: a file of monitor commands, carried out line by line up to the first that fails.

The commands stand between `.PROGRAM name` and `.END`, or alone in the file; `MC` before a command is accepted (a
command program of V+ has it), and so are blank lines and comments. Lines after EDIT go to the editor up to `E`.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from vrs_cli.errors import CannotInterpret, UsageError, VrsError
from vrs_cli.files.program_file import find_program_file, read_program_file
from vrs_cli.interfaces.dialogue import Dialogue, Said
from vrs_cli.interfaces.station.station import Station
from vrs_cli.language.text.source import END, PROGRAM, SECTIONS, lines_of
from vrs_cli.values.replies import Farewell, Message, Reply, Tone, is_error, refusal

Answers = Callable[[str], Dialogue[None]]

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


def carry_out_file(station: Station, answers: Answers, named: Path) -> Dialogue[None]:
    """Give the `answers` to its commands; the first that fails is named with its line, and ends it.

    Raises NonexistentFile, FileError, FileDamaged, CannotInterpret, UsageError.
    """
    path = find_program_file(named)
    lines = command_lines(read_program_file(path, station.folder))
    if any(path.samefile(running) for running in station.user_state.command_files):
        raise UsageError(f"{path} is being carried out", "a command file cannot call itself")
    station.user_state.command_files.append(path)
    try:
        yield from _answers(station, answers, path, lines)
    finally:
        station.user_state.command_files.pop()


def _answers(station: Station, answers: Answers, path: Path, lines: tuple[CommandLine, ...]) -> Dialogue[None]:
    for line in lines:
        failed = leaving = False
        try:
            for_line = answers(line.text)
            said = next(for_line, None)
            while said is not None:
                failed = failed or (isinstance(said, Reply) and is_error(said))
                leaving = leaving or isinstance(said, Farewell)
                said = yield from _passed_on(for_line, said)
        except VrsError as error:
            failed = True
            yield refusal(error, line.text)
        if failed:
            station.user_state.editor = None
            yield Message(f"{path} stopped at line {line.number}: {line.text}", Tone.ERROR)
        if failed or leaving or station.user_state.interrupted:
            return


def _passed_on(dialogue: Dialogue[None], said: Said) -> Dialogue[Said | None]:
    """Say it; what the talk says next, None at its end."""
    try:
        try:
            answer = yield said
        except (Exception, KeyboardInterrupt) as error:
            return dialogue.throw(error)
        return dialogue.send(answer)
    except StopIteration:
        return None
