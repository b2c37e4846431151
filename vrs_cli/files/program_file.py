"""Find program files (.v2) and decode them. Also keep recovery files, which contain programs that exist only in a
shell's memory. A shell with unsaved programs writes a recovery file and holds a lock; the system releases the lock when
the shell ends for any reason. So a recovery file whose lock is free was left by a shell that was killed.
"""

from __future__ import annotations

import codecs
import os
import time
from contextlib import suppress
from datetime import datetime
from pathlib import Path

from msgspec import Struct

from vrs_cli.errors import FileDamaged, FileError, NonexistentFile, nearest
from vrs_cli.extras import shipped_folder
from vrs_cli.files.atomic import HeldLock, hold, write_atomically
from vrs_cli.files.opening import FREE, Folder, check_length, neighbours, text_of, unreadable
from vrs_cli.language.text.parser import DISK_END, files_named_above, named_above, program_name, programs_headed
from vrs_cli.language.words.values import key_of

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
    return decode_program(str(found), data)


def cell_of_program(text: str, path: Path | None, folder: Folder) -> tuple[Path, str] | None:
    """Return the path of a program's cell file, and words that say where the cell file is named. The comment `; cell:
    FILE` above the first program names the cell file, relative to `folder`; without this comment it is NAME.toml in the
    folder of NAME.v2. Return None if there is no cell file. Raises FileOutside.
    """
    named, span = named_above(text, "cell") or (None, None)
    if named is not None and span is not None:
        return folder.path(named), f"{path or 'standard input'}:{span.line}"
    beside = None if path is None else path.with_suffix(".toml")
    return None if beside is None or not beside.is_file() else (beside, f"beside {path}")


def project_of(path: Path, text: str, *, closed: bool = False) -> dict[Path, str]:
    """Return, by path, the contents of a program file and of all files that belong to it: those named in comments `;
    with: FILE` above the first program, and so on from file to file. Names are relative to the file with the comment.
    `closed`: the named files must be in the folder of this file, and links are not allowed. Raises NonexistentFile,
    FileOutside, FileError, FileDamaged.
    """
    found, known, waiting = {path: text}, {os.path.realpath(path)}, [path]
    for here in waiting:  # the loop appends to the list over which it runs
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
    """Return the programs in the other program files of a folder: for each program's key the name of its file."""
    found: dict[str, str] = {}
    for name in sorted(neighbours(path))[:MAX_NEIGHBOURS]:
        if name.lower().endswith(PROGRAM_SUFFIXES) and name != path.name:
            with suppress(FileError):
                keys = programs_headed(read_program_file(path.parent / name)) or {key_of(program_name(Path(name).stem))}
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


def find_program_file(path: str | Path, samples: Folder | None = None) -> Path:
    """Return the path of the program file with this name, or with `.v2` or `.V2` added. `samples`: if there is no such
    file and the name is in this folder, it may also name a sample program. Raises NonexistentFile, FileError.
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
    """Return the paths of the sample programs that come with vrs, sorted by name."""
    return sorted(shipped_folder("programs").glob(f"*{EXTENSION}"))


def is_sample(path: Path) -> bool:
    """Return whether a path is in the folder of sample programs that come with vrs."""
    return path.parent == shipped_folder("programs")


def _near(path: Path) -> str:
    """Return a hint for a missing file, such as a file with a similar name in the folder."""
    folder = path.parent
    if not folder.is_dir():
        return f"there is no folder {folder}"
    near = nearest(path.name, neighbours(path), 0.7)
    if near:
        return f"did you mean {folder / near}?"
    programs = sorted(name for name in neighbours(path) if name.lower().endswith(EXTENSION))
    return f"its folder has {', '.join(programs[:5])}" if programs else "its folder has no program file"


KEPT, DECLINED = "unstored-", "declined-"
# [s] time for which a recovery file that the user declined is kept before it is deleted
KEEP_DECLINED_S = 30 * 86_400.0
PRIVATE = 0o700  # permissions of the folder of recovery files (XDG Base Directory Specification)


class Recovery:
    """The recovery file of one shell, created when there is something to write. Its methods raise no errors: if the
    file cannot be created, nothing can be recovered later. A thread writes the file, because syncing may be slow; if
    `write` is called several times meanwhile, the thread then writes only the last version.
    """

    def __init__(self, folder: Path) -> None:
        from concurrent.futures import ThreadPoolExecutor  # imported here because most commands have no recovery file

        self._folder = folder
        self._writer = ThreadPoolExecutor(max_workers=1, thread_name_prefix="recovery")
        self._text: str | None = None
        self._path: Path | None = None
        self._held: HeldLock | None = None

    def write(self, text: str) -> None:
        """Write the programs (`text`) in the thread, in place of the previous version."""
        self._text = text
        self._writer.submit(self._write)

    def remove(self) -> None:
        """Remove the recovery file, and wait until it is removed."""
        self._text = None
        self._writer.submit(self._remove).result()

    def wait(self) -> None:
        """Wait until the thread has written everything."""
        self._writer.submit(lambda: None).result()

    # --- called in the thread ---

    def _write(self) -> None:
        text, self._text = self._text, None
        if text is not None:
            with suppress(OSError, FileError):
                write_atomically(self._path or self._begin(), text)

    def _begin(self) -> Path:
        self._folder.mkdir(mode=PRIVATE, parents=True, exist_ok=True)
        path = self._folder / f"{KEPT}{os.getpid()}-{os.urandom(4).hex()}{EXTENSION}"
        self._held, self._path = hold(_mark(path)), path
        return path

    def _remove(self) -> None:
        if self._path is not None:
            with suppress(OSError):
                self._path.unlink(missing_ok=True)
        if self._held is not None:
            self._held.release()
        self._path = self._held = None


class LeftFile(Struct, frozen=True):
    """A recovery file that a killed shell has left; it is locked until `remove` or `decline` is called."""

    path: Path
    written: datetime
    text: str
    held: HeldLock

    def remove(self) -> None:
        """Delete the file. Call this after its programs have been restored."""
        with suppress(OSError):
            self.path.unlink()
        self.held.release()

    def decline(self) -> Path:
        """Rename the file, so that no shell offers it to the user again. Return its new path."""
        place = self.path.with_name(self.path.name.replace(KEPT, DECLINED, 1))
        with suppress(OSError):
            self.path.rename(place)
        self.held.release()
        return place


def recovery_files(folder: Path) -> list[Path]:
    """Return the paths of all recovery files in a folder, of running and of killed shells."""
    return list(folder.glob(f"{KEPT}*{EXTENSION}"))


def left_files(folder: Path) -> list[LeftFile]:
    """Return the readable recovery files of killed shells, the oldest first, and lock them. Also delete declined files
    older than KEEP_DECLINED_S.
    """
    for path in folder.glob(f"{DECLINED}*{EXTENSION}"):
        with suppress(OSError):
            if time.time() - path.stat().st_mtime > KEEP_DECLINED_S:
                path.unlink()
    found = [one for path in recovery_files(folder) if (one := _lock_left(path)) is not None]
    return sorted(found, key=lambda one: one.written)


def _lock_left(path: Path) -> LeftFile | None:
    """Lock a recovery file and return it; return None if its shell is still running."""
    with suppress(OSError, FileError):
        held = hold(_mark(path))
        try:
            if held.firm:
                return LeftFile(
                    path, datetime.fromtimestamp(path.stat().st_mtime), path.read_text(encoding="utf-8"), held
                )
        except (OSError, UnicodeDecodeError):
            pass
        held.release()
    return None


def _mark(path: Path) -> Path:
    """Return a path, separate from that of the recovery file, whose lock a shell holds while it runs. (The recovery
    file itself is locked only while it is written.)
    """
    return path.with_suffix(".shell")
