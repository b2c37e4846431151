"""Find program files (.v2) and decode them."""

from __future__ import annotations

import codecs
import os
from contextlib import suppress
from typing import TYPE_CHECKING

from vrs_cli.errors import FileDamaged, FileError, NonexistentFile, nearest
from vrs_cli.extras import shipped_folder
from vrs_cli.files.opening import FREE, Folder, check_length, neighbours, parent_of, text_of, unreadable, without_dots
from vrs_cli.language.text.parser import DISK_END, files_named_above, named_above, program_name, programs_headed
from vrs_cli.language.words.values import key_of

if TYPE_CHECKING:
    from pathlib import Path

EXTENSION = ".v2"
PROGRAM_SUFFIXES = (".v2", ".pg")  # file name suffixes that mark program files
MAX_NEIGHBOURS = 1000  # maximum number of files in a folder that `programs_beside` looks at

MAX_PROGRAM_BYTES = 64 * 2**20  # [B] maximum size of a program file


def read_program_file(path: str | Path, within: Folder = FREE) -> str:
    """Read a program file; `.v2` may be left out of its name. Line ends become newlines. The text is decoded as UTF-8,
    as UTF-16 if it has a byte order mark, or else as Latin-1, in which all bytes are valid; callers report invalid
    characters. Raises NonexistentFile, FileError, and FileDamaged if the file is too large.
    """
    found = find_program_file(path)
    try:
        with (FREE if is_sample(found) else within).open_to_read(found) as stream:
            data = stream.read(MAX_PROGRAM_BYTES + 1)
    except OSError as error:
        raise unreadable(found, error) from error
    return decode_program(found, data)


def cell_of_program(text: str, path: str | None, folder: Folder) -> tuple[str, str] | None:
    """Return the path of a program's cell file, and words that say where the cell file is named. The comment `; cell:
    FILE` above the first program names the cell file, relative to `folder`; without this comment it is NAME.toml in the
    folder of NAME.v2. Return None if there is no cell file. Raises FileOutside.
    """
    named, span = named_above(text, "cell") or (None, None)
    if named is not None and span is not None:
        return str(folder.path(named)), f"{path or 'standard input'}:{span.line}"
    beside = "" if path is None else f"{os.path.splitext(path)[0]}.toml"
    return (beside, f"beside {path}") if os.path.isfile(beside) else None


def project_of(path: str, text: str, *, closed: bool = False) -> dict[str, str]:
    """Return, by path, the contents of a program file and of all files that belong to it: those named in comments `;
    with: FILE` above the first program, and so on from file to file. Names are relative to the file with the comment.
    `closed`: the named files must be in the folder of this file, and links are not allowed. Raises NonexistentFile,
    FileOutside, FileError, FileDamaged.
    """
    found, known, waiting = {path: text}, {os.path.realpath(path)}, [path]
    for here in waiting:  # the loop appends to the list over which it runs
        for name, span in files_named_above(found[here]):
            try:
                folder = Folder(parent_of(here), closed=closed)
                other = find_program_file(os.path.normpath(folder.path(name)))
                if (real := os.path.realpath(other)) not in known:
                    found[other] = read_program_file(other, folder)
                    known.add(real)
                    waiting.append(other)
            except FileError as wrong:
                raise type(wrong)(f"{here}:{span.line}: {wrong.detail}", wrong.hint) from None
    return found


def programs_beside(path: str) -> dict[str, str]:
    """Return the programs in the other program files of a folder: for each program's key the name of its file."""
    found: dict[str, str] = {}
    folder, own = os.path.split(path)
    for name in sorted(neighbours(path))[:MAX_NEIGHBOURS]:
        if name.lower().endswith(PROGRAM_SUFFIXES) and name != own:
            with suppress(FileError):
                text = read_program_file(os.path.join(folder, name))
                keys = programs_headed(text) or {key_of(program_name(os.path.splitext(name)[0]))}
                found |= dict.fromkeys(keys - found.keys(), name)
    return found


def decode_program(name: str, data: bytes) -> str:
    """Decode the bytes of a program file as `read_program_file` does. `name`: the file's name, for errors. Raises
    FileDamaged for more than MAX_PROGRAM_BYTES.
    """
    if len(data) > MAX_PROGRAM_BYTES:
        raise FileDamaged(f"{name} is longer than {MAX_PROGRAM_BYTES // 2**20} MB", "a program file is VAL-II text")
    utf16 = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    text = data.decode("utf-16", errors="replace") if utf16 else text_of(data)
    return text.replace("\r\n", "\n").replace("\r", "\n").rstrip(DISK_END)


def find_program_file(path: str | Path, samples: Folder | None = None) -> str:
    """Return the path of the program file with this name, or with `.v2` or `.V2` added. `samples`: if there is no such
    file and the name is in this folder, it may also name a sample program. Raises NonexistentFile, FileError.
    """
    named = without_dots(path)
    check_length(named)
    for suffix in ("", EXTENSION, EXTENSION.upper()):
        candidate = f"{named}{suffix}"
        if os.path.exists(candidate) and not os.path.isdir(candidate):
            return candidate
    folder, name = parent_of(named), os.path.basename(named)
    if samples is not None and folder == without_dots(samples.root):
        for sample in sample_programs():
            if name.lower() in (own := os.path.basename(sample), os.path.splitext(own)[0]):
                return sample
    if os.path.isdir(named):
        raise FileError(f"{named} is a folder", "name a program file")
    raise NonexistentFile(named, _near(named))


def sample_programs() -> list[str]:
    """Return the paths of the sample programs that come with vrs, sorted by name."""
    folder = shipped_folder("programs")
    return sorted(os.path.join(folder, name) for name in os.listdir(folder) if name.endswith(EXTENSION))


def is_sample(path: str) -> bool:
    """Return whether a path is in the folder of sample programs that come with vrs."""
    return parent_of(path) == shipped_folder("programs")


def _near(path: str) -> str:
    """Return a hint for a missing file, such as a file with a similar name in the folder."""
    folder, name = os.path.split(path)
    if not os.path.isdir(folder or "."):
        return f"there is no folder {folder}"
    near = nearest(name, neighbours(path), 0.7)
    if near:
        return f"did you mean {os.path.join(folder, near)}?"
    programs = sorted(name for name in neighbours(path) if name.lower().endswith(EXTENSION))
    return f"its folder has {', '.join(programs[:5])}" if programs else "its folder has no program file"
