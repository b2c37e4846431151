"""The submissions that the files, folders and patterns of a command line name."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterable
from glob import glob
from pathlib import Path

from vrs_cli.cli.sources import is_program
from vrs_cli.errors import FileError, FileOutside, NonexistentFile
from vrs_cli.files.opening import Folder, reason
from vrs_cli.files.program_file import decode_program
from vrs_cli.teach.exercise_text import MAX_PROGRAM_BYTES
from vrs_cli.teach.grading import Submission

MAX_NAME_CHARS = 200


def find_submissions(named: Iterable[str]) -> tuple[Submission, ...]:
    """Read the submissions that files, folders and patterns name, each once, in the order of their students.

    A file is called after itself, a folder with one program file after the folder. Of any other folder each program
    file, and each folder in it, is a submission. Where two have the same name, the folders above are told too.
    Raises NonexistentFile for a name without any.
    """
    found = dict[str, Path]()
    for name in named:
        for path in _places(name):
            found.setdefault(os.path.abspath(path), path)
    paths = [Path(path) for path in found]
    return tuple(
        sorted((_read(student, path) for student, path in zip(_students(paths), paths, strict=True)), key=_order)
    )


def _order(one: Submission) -> tuple[str, str]:
    return one.student.casefold(), one.student


def _places(name: str) -> Iterable[Path]:
    """The files, and the folders of one student, that a word of the command line means."""
    path = Path(name)
    if not os.path.lexists(path) and set(name) & set("*?["):
        found = [one for each in sorted(glob(name, recursive=True)) for one in _places(each)]
        if not found:
            raise NonexistentFile(f"no file fits {name}", "name files, or folders with files of students")
        return found
    if not path.is_dir() or path.is_symlink():
        if not os.path.lexists(path):
            raise NonexistentFile(name, "name files, or folders with files of students")
        return (path,)
    inside = [one for one in sorted(path.iterdir()) if not one.name.startswith(".")]
    programs, folders = [one for one in inside if is_program(one.name)], [one for one in inside if one.is_dir()]
    if (len(programs) == 1 and not any(_programs_below(one) for one in folders)) or not (programs or folders):
        return (path,)  # of one student, who may have handed in nothing
    return [*programs, *folders]


def _programs_below(folder: Path) -> list[Path]:
    """The program files of a student's folder; links to folders are not followed."""
    return sorted(
        Path(here, name)
        for here, _, names in os.walk(folder)
        for name in names
        if is_program(name) and not Path(here).name.startswith(".")
    )


def _students(paths: list[Path]) -> list[str]:
    """A name for each path: as short as can be, so that no two are the same."""
    depth, names = 1, list[str]()
    while depth <= 64:
        names = ["/".join((*path.parts[-depth:-1], _own_name(path))) for path in paths]
        if len({name.casefold() for name in names}) == len(names):
            break
        depth += 1
    last = {name.rpartition("/")[2] for name in names}
    if depth > 1 and len(last) == 1:  # ann/robot.v2, bob/robot.v2
        names = [name.rpartition("/")[0] for name in names]
    return [_text_of_name(name) for name in names]


def _own_name(path: Path) -> str:
    return path.stem if is_program(path.name) else path.name


def _text_of_name(name: str) -> str:
    """A file name as text: bytes that are no characters are told as such."""
    return os.fsencode(name).decode(errors="backslashreplace")[-MAX_NAME_CHARS:]


def _read(student: str, path: Path) -> Submission:
    """Read a submission. A link is not followed: it could lead to a file of somebody else."""
    if path.is_dir() and not path.is_symlink():
        programs = _programs_below(path)
        if len(programs) != 1:
            many = f"the folder holds {len(programs)} program files, and one is wanted"
            return Submission(student, _text_of_name(path.name), "", many)
        path = programs[0]
    name = _text_of_name(path.name)
    try:
        return Submission(student, name, _text_at(path))
    except FileOutside:
        why = "it is a link, a device or a pipe"
    except FileError as error:
        why = error.detail
    except OSError as error:
        why = reason(error)
    return Submission(student, name, "", f"the file cannot be read: {why}")


def _text_at(path: Path) -> str:
    """Raises OSError, FileError for what is no file, or too long."""
    with Folder(path.parent, closed=True).open_to_read(path) as stream:
        if not stat.S_ISREG(os.fstat(stream.fileno()).st_mode):
            raise FileError("it is no file")
        data = stream.read(MAX_PROGRAM_BYTES + 1)
    if len(data) > MAX_PROGRAM_BYTES:
        raise FileError(f"it has more than {MAX_PROGRAM_BYTES} bytes")
    return decode_program(path.name, data)
