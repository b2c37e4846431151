"""Program files (.v2): their bytes to text, whatever system they come from."""

from __future__ import annotations

import codecs
import os
from contextlib import suppress
from pathlib import Path

from vrs_cli.errors import FileDamaged, FileError, NonexistentFile, nearest
from vrs_cli.extras import shipped_folder
from vrs_cli.files.opening import FREE, Folder, check_length, neighbours, text_of, unreadable
from vrs_cli.language.text.source import DISK_END, files_named_above, named_above, program_name, programs_headed
from vrs_cli.language.words.values import key_of

EXTENSION = ".v2"
PROGRAM_SUFFIXES = (".v2", ".pg")  # how files of programs end
MAX_NEIGHBOURS = 1000  # files of a folder that are looked at for programs

LARGEST = 64 * 2**20  # bytes; a text this long is no program


def read_program_file(path: str | Path, within: Folder = FREE) -> str:
    """The text of a program file, with `.v2` added when only that file exists; line ends become newlines.

    UTF-8, or UTF-16 with its mark, or else Latin-1, which reads any byte: whoever reads the text tells of characters
    that are none. Raises NonexistentFile, FileError and, when it is too long, FileDamaged.
    """
    found = find_program_file(path)
    try:
        with (FREE if is_sample(found) else within).open_to_read(found) as stream:
            data = stream.read(LARGEST + 1)
    except OSError as error:
        raise unreadable(found, error) from error
    return decode_program(str(found), data)


def cell_of_program(text: str, path: Path | None, folder: Folder) -> tuple[Path, str] | None:
    """The file of the cell that a program is to run in, and who names it: the comment `; cell: FILE` above the first
    program, relative to `folder`, else NAME.toml beside NAME.v2. Raises FileOutside.
    """
    named, span = named_above(text, "cell") or (None, None)
    if named is not None and span is not None:
        return folder.path(named), f"{path or 'standard input'}:{span.line}"
    beside = None if path is None else path.with_suffix(".toml")
    return None if beside is None or not beside.is_file() else (beside, f"beside {path}")


def project_of(path: Path, text: str, *, closed: bool = False) -> dict[Path, str]:
    """The texts of the files of a name space, by path: a file, and those that comments `; with: FILE` name above the
    first program of one of them, relative to its folder. `closed`: they are in that folder, and no links. Raises
    NonexistentFile, FileOutside, FileError, FileDamaged.
    """
    found, known, waiting = {path: text}, {os.path.realpath(path)}, [path]
    for here in waiting:  # which grows
        for name, span in files_named_above(found[here]):
            try:
                folder = Folder(here.parent, closed=closed)
                other = find_program_file(os.path.normpath(folder.path(name)))
                if (real := os.path.realpath(other)) not in known:
                    found[other] = read_program_file(other, folder)
                    known.add(real)
                    waiting.append(other)
            except FileError as wrong:
                raise type(wrong)(f"{here}:{span.line}: {wrong.detail}", wrong.hint) from None
    return found


def programs_beside(path: Path) -> dict[str, str]:
    """The keys of the programs in the other program files of the folder, each with the name of its file."""
    found: dict[str, str] = {}
    for name in sorted(neighbours(path))[:MAX_NEIGHBOURS]:
        if name.lower().endswith(PROGRAM_SUFFIXES) and name != path.name:
            with suppress(FileError):
                text = read_program_file(path.parent / name)
                keys = programs_headed(text) or {key_of(program_name(Path(name).stem))}
                found |= dict.fromkeys(keys - found.keys(), name)
    return found


def decode_program(name: str, data: bytes) -> str:
    """The text of a program file's bytes; `name` is for the message. Raises FileDamaged when they are too many."""
    if len(data) > LARGEST:
        raise FileDamaged(f"{name} is longer than {LARGEST // 2**20} MB", "a program file is VAL-II text")
    utf16 = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    text = data.decode("utf-16", errors="replace") if utf16 else text_of(data)
    return text.replace("\r\n", "\n").replace("\r", "\n").rstrip(DISK_END)


def find_program_file(path: str | Path, samples: Folder | None = None) -> Path:
    """The file of that name, or else of that name with `.v2` or `.V2` at its end. `samples`: for a name in this folder
    that has no file, return the sample program of vrs that has the name.

    Raises NonexistentFile, FileError.
    """
    named = Path(path)
    check_length(named)
    for suffix in ("", EXTENSION, EXTENSION.upper()):
        candidate = Path(f"{named}{suffix}")
        if candidate.exists() and not candidate.is_dir():
            return candidate
    if samples is not None and named.parent == samples.root:
        for sample in sample_programs():
            if named.name.lower() in (sample.stem, sample.name):
                return sample
    if named.is_dir():
        raise FileError(f"{named} is a folder", "name a program file")
    raise NonexistentFile(str(named), _near(named))


def sample_programs() -> list[Path]:
    """The sample programs that come with vrs, by name."""
    return sorted(shipped_folder("programs").glob(f"*{EXTENSION}"))


def is_sample(path: Path) -> bool:
    """Return whether a path is that of a sample program, as `find_program_file` returns it."""
    return path.parent == shipped_folder("programs")


MOST_SHOWN = 5  # files of a folder


def _near(path: Path) -> str:
    """Say which file of the folder was perhaps meant."""
    folder = path.parent
    if not folder.is_dir():
        return f"there is no folder {folder}"
    near = nearest(path.name, neighbours(path), 0.7)
    if near:
        return f"did you mean {folder / near}?"
    programs = sorted(name for name in neighbours(path) if name.lower().endswith(EXTENSION))
    return f"its folder has {', '.join(programs[:MOST_SHOWN])}" if programs else "its folder has no program file"
