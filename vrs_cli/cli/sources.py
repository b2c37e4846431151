"""Find and read the program and trajectory files that command lines name, and write positions as JSON objects."""

from __future__ import annotations

import os
import sys
from argparse import Namespace
from collections.abc import Iterable, Iterator, Sequence
from math import degrees
from typing import TYPE_CHECKING, NoReturn

from msgspec import Struct

from vrs_cli.cli.command_line import teller
from vrs_cli.cli.commands import STANDARD_STREAM
from vrs_cli.errors import NonexistentFile
from vrs_cli.kinematics.transform import Transform, to_oat

if TYPE_CHECKING:
    from vrs_cli.files.trajectory_file import Recording
    from vrs_cli.kinematics.joints import JointUnits
    from vrs_cli.values.diagnostics import Diagnostic
    from vrs_cli.values.results import Position


PROGRAMS = (".v2", ".pg")  # suffixes of program files


class Source(Struct, frozen=True):
    """A program file. `path`: its name in messages. `is_file`: False for standard input."""

    path: str
    text: str
    is_file: bool = True

    @property
    def name(self) -> str:
        """Return the name of the file without its folder and suffix; "" for standard input."""
        return os.path.splitext(os.path.basename(self.path))[0] if self.is_file else ""

    def diagnostics_text(self, diagnostics: Iterable[Diagnostic], most: int | None = None) -> str:
        """Return diagnostics as text, sorted by line, each with its line and a caret. `most`: the maximum number;
        errors have priority over warnings, and the last line says how many are left out."""
        from vrs_cli.values.diagnostics import in_order, show

        everything = in_order(diagnostics)
        chosen = everything
        if most is not None:  # keep the first `most` diagnostics, errors before warnings
            chosen = in_order(sorted(everything, key=lambda one: not has_errors([one]))[:most])
        lines = ["", *self.text.split("\n"), ""]  # counted from 1; a diagnostic may be after the last line
        text = "".join(f"{show(one, lines[one.span.line], self.path)}\n" for one in chosen)
        rest = len(everything) - len(chosen)
        return f"{text}{rest} more (vrs check {self.path} shows all)\n" if rest else text


def read_source(path: str, *, samples: bool = True) -> Source:
    """Return a program file, or standard input for `-`. `samples`: if the file does not exist, the name may be that of
    a sample program of vrs. Raises NonexistentFile, FileError, FileDamaged."""
    from vrs_cli.files.opening import FREE
    from vrs_cli.files.program_file import decode_program, find_program_file, read_program_file

    if path == STANDARD_STREAM:
        text = decode_program("standard input", sys.stdin.buffer.read())
        return Source("standard input", text, is_file=False)
    found = find_program_file(path, FREE if samples else None)
    return Source(found, read_program_file(found))


def sources_of(paths: Iterable[str], *, closed: bool = False, samples: bool = True) -> tuple[Source, ...]:
    """Return the files of one name space, each once: the given paths, and the files that comments in them name (`;
    with: lib.v2`).

    `closed`: a named file must be in the folder of the file that names it. `samples`: a path may be the name of a
    sample program of vrs. Raises FileError.
    """
    from vrs_cli.files.program_file import project_of

    found: dict[str, Source] = {}
    for source in (read_source(path, samples=samples) for path in paths):
        for path, text in project_of(source.path, source.text, closed=closed).items():
            is_file = source.is_file or path != source.path
            found.setdefault(os.path.realpath(path), Source(path, text, is_file))
    return tuple(found.values())


def are_together(named: Sequence[str], files: Sequence[str], project: bool) -> bool:
    """Return whether the files of a command line share one name space: several named files do, and with --project all
    do. The files of a folder or a pattern are independent."""
    return project or (len(set(named)) > 1 and set(files) == set(named))


def robot_of(prog: str, source: Source) -> str | None:
    """Return the built-in robot that a program file names (`; robot: cobra600`). For any other name, print a note and
    return None, because only the command line may name a robot's file."""
    from vrs_cli.kinematics.robot_file import robot_names
    from vrs_cli.language.text.parser import named_above

    name, span = named_above(source.text, "robot") or (None, None)
    if name is None or span is None or name.lower() in robot_names():
        return name
    teller(prog)(
        f"note: {source.path}:{span.line}: no robot is called {name!r} (vrs robots lists those that are there)"
    )
    return None


def cell_file(options: Namespace, source: Source) -> tuple[str, str] | None:
    """Return the cell file of a run, and its origin: --cell, or the program. With --sandbox a program may name only
    files in its own folder. Raises FileOutside."""
    from vrs_cli.files.opening import Folder, parent_of
    from vrs_cli.files.program_file import cell_of_program

    if options.cell is not None:
        return options.cell, "--cell"
    path = source.path if source.is_file else None
    closed = getattr(options, "sandbox", None) is not None
    found = cell_of_program(source.text, path, Folder("." if path is None else parent_of(path), closed=closed))
    is_robot = found is not None and options.robot is not None and found[0] == os.path.normpath(options.robot)
    return None if is_robot else found


def program_files(named: Iterable[str]) -> tuple[str, ...]:
    """Return the program files that a command line names, each once.

    A word is a file, a folder (all program files in it and below it), or a pattern (`cell/*.v2`, `**/*.pg`). Raises
    NonexistentFile for a folder or a pattern without program files.
    """
    return tuple(dict.fromkeys(path for name in named for path in _paths_of(name)))


def _paths_of(name: str) -> Iterable[str]:
    if os.path.isdir(name) and not any(os.path.isfile(name + suffix) for suffix in PROGRAMS):
        return sorted(_below(name)) or _none(f"{name} holds no program file")
    if not os.path.lexists(name) and any(sign in name for sign in "*?["):
        from glob import glob

        found = [path for path in glob(name, recursive=True) if os.path.isfile(path)]
        return sorted(found) or _none(f"no file fits {name}")
    return (name,)


def _below(folder: str) -> Iterator[str]:
    """Yield the program files in and below a folder, without hidden files and folders."""
    from vrs_cli.files.opening import without_dots

    for here, folders, names in os.walk(folder):
        folders[:] = [name for name in folders if not name.startswith(".")]
        for name in names:
            if is_program(name) and not name.startswith("."):
                yield without_dots(os.path.join(here, name))


def _none(detail: str) -> NoReturn:
    raise NonexistentFile(detail, f"program files end in {' or '.join(PROGRAMS)}")


def is_program(name: str) -> bool:
    """Return whether a word is the name of a program file, and not an address."""
    return name.lower().endswith(PROGRAMS) and "://" not in name


def has_errors(diagnostics: Iterable[Diagnostic]) -> bool:
    """Return whether one of the diagnostics is an error."""
    from vrs_cli.values.diagnostics import first_error

    return first_error(diagnostics) is not None


# --- trajectory files -----------------------------------------------------------------------------------------------


def is_recording(name: str) -> bool:
    """Return whether a word is the name of a trajectory file, and not an address."""
    return name.endswith(".vrst") or (os.path.exists(name) and not is_program(name))


def read_recording(prog: str, path: str, *, lenient: bool = False, warns: bool = True) -> Recording:
    """Return the trajectory in a file; show a progress bar on a terminal. `warns`: print the file's mistakes on
    standard error. Raises FileError."""
    from vrs_cli.files.trajectory_file import read_trajectory
    from vrs_cli.render.progress import reading_progress

    with reading_progress(path) as progress:
        recording = read_trajectory(path, progress, lenient=lenient)
    if recording.dropped_tail:
        print(f"{prog}: warning: the last line of {path} is incomplete and left out", file=sys.stderr)
    for warning in recording.warnings if warns else ():
        print(f"{prog}: warning: {path}, {warning}", file=sys.stderr)
    return recording


def position_object(position: Position, units: JointUnits) -> dict[str, list[float] | list[str]]:
    """Return a position as a JSON object: `joints_deg`, `xyz_mm`, `oat_deg`; `joint_units` if a joint slides."""
    return {
        "joints_deg": [tidy(number) for number in units.to_display(position.joints)],
        **units.json_units(len(position.joints)),
        **pose_object(position.T_world_tool),
    }


def pose_object(T: Transform) -> dict[str, list[float]]:
    """Return a pose as a JSON object: `xyz_mm`, `oat_deg`."""
    return {
        "xyz_mm": [tidy(1000.0 * x) for x in (T.px, T.py, T.pz)],
        "oat_deg": [tidy(degrees(angle)) for angle in to_oat(T)],
    }


def tidy(value: float) -> float:
    """Return an angle or length [deg, mm] rounded to remove floating-point noise. The result is never -0.0."""
    return round(value, 12) + 0.0
