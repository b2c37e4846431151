"""Write the timeline and the memory of a served robot to the disk before a command is answered; keep the robot's files,
and an audit of all commands.

`DurableLog` replaces the journal of the book (`engine/book.py`), so that one sync writes journal and memory for many
commands.

`MemoryFile` keeps programs, variables and settings for the next start of the server. It is a program file (.v2), which
LOAD can read. Before a command is answered, its changes are appended as one part. Each part ends in a line with its
checksum; an incomplete last part is ignored. The file is rewritten when something is deleted, and when later parts have
replaced most of it.
"""

from __future__ import annotations

import json
import os
import re
import stat
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from itertools import islice
from pathlib import Path
from zlib import crc32

from vrs_cli.engine.book import JournalWriter
from vrs_cli.engine.settings import Settings
from vrs_cli.errors import FileError, FileExists, LimitReached
from vrs_cli.files.atomic import as_file_error, atomically, write_atomically
from vrs_cli.files.disk import BLOCK, check_file
from vrs_cli.files.opening import Folder, reason, unreadable
from vrs_cli.files.past import GrowingFile
from vrs_cli.files.store import EVERYTHING, MemoryPart, sections_of, store
from vrs_cli.interfaces.dialogue import Dialogue, beside
from vrs_cli.interfaces.editor.buffer import ProgramBuffer, closes_entry, opens_entry
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.station.loaded_file import LONG_PROGRAM
from vrs_cli.language.text.ast import Program
from vrs_cli.language.text.printer import print_file, print_program
from vrs_cli.net import messages
from vrs_cli.net.limits import UNMEASURED, Allowance
from vrs_cli.trajectory.timeline import TimelineDelta
from vrs_cli.values.diagnostics import Diagnostic
from vrs_cli.wire.codec import Reader, to_json
from vrs_cli.wire.records import RecordError


class DurableLog:
    """The `journal` and the `memory` file of one robot, None if it has none. `length`: returns the number of segments
    of its timeline; `most`: the maximum number of segments."""

    def __init__(
        self,
        length: Callable[[], int],
        most: int,
        journal: JournalWriter | None = None,
        memory: MemoryFile | None = None,
    ) -> None:
        self._length, self._most, self._journal, self._memory = length, most, journal, memory

    def record(self, deltas: Sequence[TimelineDelta], *, happens: bool = False) -> None:
        """Write deltas into the journal. Raises FileError, and LimitReached if the timeline would be too long."""
        longer = sum(len(delta.segments) - delta.drop for delta in deltas)
        if longer > 0 and self._length() + longer > self._most and not happens:
            raise LimitReached(
                f"the timeline has {self._most} segments, and the server allows no more", "{UNDO} takes some back"
            )
        if self._journal is not None:
            self._journal.record(deltas, happens=happens)

    @property
    def unsettled(self) -> bool:
        journal, memory = self._journal, self._memory
        return (journal is not None and journal.unsettled) or (memory is not None and memory.changed)

    def settle(self) -> None:
        """Write everything to the disk. Raises FileError."""
        try:
            if self._journal is not None:
                self._journal.settle()
        finally:
            if self._memory is not None:
                self._memory.write()

    def note(self) -> None:
        """Record whether the memory differs from its file, because a command may have changed it."""
        if self._memory is not None:
            self._memory.note()

    def prepare(self) -> Dialogue[None]:
        """Print long new programs in another thread, before the memory is written."""
        if self._memory is not None:
            yield from self._memory.prepare()

    def check(self) -> None:
        """Repeat the last write of the memory if it failed. Raises FileError if it fails again."""
        memory = self._memory
        if memory is not None and memory.failing:
            memory.changed = True
            memory.write()


SLACK = 100_000  # [bytes] the file is rewritten when it is this much longer than twice its length at the last rewrite
WAITS = "nothing is changed until the server can write it"
_SEAL = re.compile(rb"; part ([0-9a-f]{8})\n")
_SETTINGS = "; settings "
_settings: Reader[Settings] = Reader(Settings)


class MemoryFile:
    """The memory file of one session. `failing`: the error of the last write; empty if it succeeded."""

    def __init__(self, session: Session, path: Path) -> None:
        self.path, self.failing = path, ""
        self.changed = False  # whether the memory has changed since the file was written
        self._session = session
        session.unstored.watch()
        self._file: GrowingFile | None = None
        self._programs: Mapping[str, Program] = {}  # the programs in the file
        self._texts: dict[str, tuple[Program, str]] = {}  # printed text of each program in the file, by key
        self._printing: set[str] = set()  # keys of programs that another thread is printing
        self._settings: Settings | None = None
        self._least = 0  # bytes of the file when it was last rewritten

    def bring_back(self) -> tuple[Diagnostic, ...]:
        """Load the file, if it exists, and rewrite it; return the errors in it. Raises FileError."""
        found: tuple[Diagnostic, ...] = ()
        if self.path.exists():
            text = _undamaged_text(self.path)
            programs = _program_lines(text)
            found = tuple(one for one in self._session.load_text(text) if one.span.line not in programs)
            settings = [line for line in text.splitlines() if line.startswith(_SETTINGS)]
            with suppress(RecordError):  # settings of another version are ignored: the defaults apply
                for line in settings[-1:]:
                    self._session.engine.settings = _settings.read(line.removeprefix(_SETTINGS))
        self._session.unstored.news()
        self._replace()
        return found

    def note(self) -> None:
        """Set `changed` if the memory differs from the file."""
        if not self.changed:
            session, now, there = self._session, self._now(), self._programs
            self.changed = (
                session.unstored.fresh
                or session.engine.settings is not self._settings
                or there.keys() != now.keys()
                or any(there[key] is not one for key, one in now.items())  # comparing steps would be slow
            )

    def prepare(self) -> Dialogue[None]:
        """Print long new programs in another thread, so that the next write is short."""
        new = {key: one for key, one in self._now().items() if not self._is_printed(key, one)}
        if sum(len(one.steps) for one in new.values()) <= LONG_PROGRAM:
            return
        self._printing |= new.keys()
        try:
            texts = yield from beside(lambda: [print_program(one) for one in new.values()])
            self._texts |= {key: (one, text) for (key, one), text in zip(new.items(), texts, strict=True)}
        finally:
            self._printing -= new.keys()
            self.note()

    def _is_printed(self, key: str, program: Program) -> bool:
        return key in self._texts and self._texts[key][0] is program

    def _text(self, key: str, program: Program) -> str:
        if not self._is_printed(key, program):
            self._texts[key] = program, print_program(program)
        return self._texts[key][1]

    def write(self) -> None:
        """Write changes to the disk. Raises FileError; the next change then writes them again."""
        if not self.changed:
            return
        self.changed = False
        try:
            self._write()
        except FileError as error:
            failed = FileError(error.detail, WAITS)
            self.failing = str(failed)
            self._least = -1  # rewrite the whole file the next time
            raise failed from error
        self.failing = ""

    def close(self) -> None:
        file, self._file = self._file, None
        if file is not None:
            file.close()

    def _now(self) -> dict[str, Program]:
        """Return the programs in memory."""
        return {key: stored.program for key, stored in self._session.environment.programs.items()}

    def _to_write(self) -> dict[str, Program]:
        """Return the programs to write. For a program that another thread is printing, return the version in the file,
        if there is one."""
        now, there = self._now(), self._programs
        for key in self._printing & now.keys():
            if key in there:
                now[key] = there[key]
            else:
                del now[key]
        return now

    def _write(self) -> None:
        items, programs = self._session.unstored.news(), self._to_write()
        environment = self._session.environment
        gone = self._programs.keys() - programs.keys() or any(environment.value(item) is None for item in items)
        file = self._file
        if gone or file is None or self._least < 0 or file.size > 2 * self._least + SLACK or file.find_change():
            self._replace()
            return
        new = [self._text(key, one) for key, one in programs.items() if self._programs.get(key) is not one]
        text = "".join(new) + print_file(sections_of(environment, items))
        if self._session.engine.settings is not self._settings:
            text += self._settings_line()
        with as_file_error(self.path):
            file.add(_seal(text), durable=True)
        self._programs, self._settings = programs, self._session.engine.settings

    def _settings_line(self) -> str:
        return f"{_SETTINGS}{to_json(self._session.engine.settings)}\n"

    def _replace(self) -> None:
        """Write a new file with all programs, variables and settings."""
        programs = self._to_write()
        printed = "".join(self._text(key, one) for key, one in programs.items())
        text = printed + store(self._session.environment, EVERYTHING - {MemoryPart.PROGRAMS}) + self._settings_line()
        self._texts = {key: self._texts[key] for key in programs}
        write_atomically(self.path, _seal(text).decode())
        self.close()
        with as_file_error(self.path):
            self._file = GrowingFile(self.path)
        self._least = self._file.size
        self._programs, self._settings = programs, self._session.engine.settings


def _program_lines(text: str) -> frozenset[int]:
    """Return the numbers of the lines inside programs; errors in these lines are not reported again."""
    inside, found = False, set[int]()
    for number, line in enumerate(text.split("\n"), start=1):
        inside = inside or (opens_entry(line) and ProgramBuffer(line).is_program)
        if inside:
            found.add(number)
            inside = not closes_entry(line)
    return frozenset(found)


def _seal(text: str) -> bytes:
    data = text.encode("utf-8")
    return data + b"; part %08x\n" % crc32(data)


def _undamaged_text(path: Path) -> str:
    """Return the text of a file up to its first damaged part; all of it if it has no checksum lines, because a user
    wrote it."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise unreadable(path, error) from None
    begin = 0
    seals = list(_SEAL.finditer(data))
    for seal in seals:
        if crc32(data[begin : seal.start()]) != int(seal[1], 16):
            break
        begin = seal.end()
    return (data[:begin] if seals else data).decode("utf-8", "replace")


MAX_AUDIT_BYTES = 10_000_000  # maximum bytes of one audit file; there are two files
MAX_COMMAND_CHARS = 1000  # maximum number of characters kept of one command
MAX_NAME_CHARS = 40  # maximum number of characters kept of a name: a client without a token may send any name
ADDING = os.O_WRONLY | os.O_APPEND | os.O_CREAT | getattr(os, "O_BINARY", 0)  # flags: append, create if missing
PRIVATE = 0o600  # permissions of the audit file: only its owner reads and writes it


class Audit:
    """The audit: a file with one line for each command, and for each user who enters or leaves. Without a path nothing
    is written. `now` returns seconds since 1970. `tell` is called when writing fails, and when it succeeds again;
    commands continue meanwhile. When the file reaches `most` bytes, it is renamed to audit.1.jsonl, which replaces the
    previous file of this name. A line:

        {"when": "2027-03-01T09:30:00.123Z", "robot": "cell1", "who": "ada", "from": "10.0.0.7:51344",
         "what": "MOVE part", "result": "done"}

    Raises FileError if the file cannot be made.
    """

    def __init__(
        self, path: Path | None, now: Callable[[], float], tell: Callable[[str], None], most: int = MAX_AUDIT_BYTES
    ) -> None:
        self._path, self._now, self._tell, self._most = path, now, tell, most
        self._handle, self._size = -1, 0
        self._failing = False
        if path is not None:
            with as_file_error(path, "name another place"):
                self._open(path)

    def note(self, robot: str, who: str, address: str, what: str, result: str) -> None:
        """Add a line: the command of a user at an address to a robot, and its result. Never raises."""
        if self._path is None:
            return
        when = datetime.fromtimestamp(self._now(), UTC).isoformat(timespec="milliseconds")
        row = {
            "when": when.replace("+00:00", "Z"),
            "robot": robot[:MAX_NAME_CHARS],
            "who": who[:MAX_NAME_CHARS],
            "from": address,
            "what": what
            if len(what) <= MAX_COMMAND_CHARS
            else f"{what[:MAX_COMMAND_CHARS]}... ({len(what)} characters)",
            "result": result[:MAX_COMMAND_CHARS],
        }
        try:
            self._add(self._path, json.dumps(row).encode() + b"\n")
        except OSError as error:
            if not self._failing:
                self._tell(f"*File error* the audit {self._path} cannot be written: {reason(error)}; commands go on")
            self._failing = True
        else:
            if self._failing:
                self._tell(f"the audit {self._path} is written again")
            self._failing = False

    def close(self) -> None:
        handle, self._handle = self._handle, -1
        if handle >= 0:
            os.close(handle)

    def _add(self, path: Path, line: bytes) -> None:
        if self._handle < 0:
            self._open(path)
        if self._size + len(line) > self._most:
            self.close()
            os.replace(path, path.with_suffix(f".1{path.suffix}"))
            self._open(path)
        written = os.write(self._handle, line)
        if written < len(line):  # the disk is full: remove the incomplete line
            os.ftruncate(self._handle, self._size)
            raise OSError(0, "there is no room")
        self._size += written

    def _open(self, path: Path) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        self._handle = os.open(path, ADDING, PRIVATE)
        self._size = os.fstat(self._handle).st_size


MAX_FETCHED_BYTES = 50_000_000  # maximum bytes of one fetched file
MAX_LISTED_FILES = 10_000


class RobotFiles:
    """The files in the folder of a served robot, within the limits of the server."""

    def __init__(self, folder: Folder, allowance: Allowance) -> None:
        self._folder, self._allowance = folder, allowance

    def put(self, name: str, data: bytes, *, replace: bool) -> None:
        """Write a file completely or not at all. Raises FileError, FileOutside, FileExists, LimitReached."""
        path = self._folder.inside(name)
        if path.is_dir():
            raise FileError(f"{name} is a folder", "name a file")
        if os.path.lexists(path) and not replace:
            raise FileExists(name, "--replace overwrites it")
        if not path.parent.is_dir():
            raise FileError(f"{name}: there is no such folder", "a name without folders is always good")
        self.check_room(len(data))
        with atomically(path, self._folder) as stream:
            stream.write(data)

    def fetch(self, name: str) -> bytes:
        """Read a file. Raises NonexistentFile, FileError, FileOutside."""
        path = check_file(self._folder.inside(name))
        try:
            with self._folder.open_to_read(path) as stream:
                data = stream.read(MAX_FETCHED_BYTES + 1)
        except OSError as error:
            raise unreadable(path, error) from None
        if len(data) > MAX_FETCHED_BYTES:
            raise FileError(f"{name} has more than {MAX_FETCHED_BYTES} bytes", "fetch it from the server's own disk")
        return data

    def list(self) -> tuple[messages.StoredFile, ...]:
        """Return all files, also those in subfolders, by their relative paths; hidden files are left out."""
        found = [
            messages.StoredFile(path, it.st_size, it.st_mtime) for path, it in islice(self._files(), MAX_LISTED_FILES)
        ]
        return tuple(sorted(found, key=lambda one: one.name))

    def check_room(self, *new: int) -> None:
        """Check that the folder has room for new files of these sizes [bytes]. Raises LimitReached."""
        allowance = self._allowance
        if allowance.folder >= UNMEASURED:
            return
        sizes = [*islice((found.st_size for _, found in self._files()), allowance.files + 1), *new]
        held = sum(max(size, BLOCK) for size in sizes)
        if len(sizes) > allowance.files:
            raise LimitReached(f"the robot's folder would hold more than {allowance.files} files", "FDELETE makes room")
        if held > allowance.folder:
            raise LimitReached(
                f"the robot's folder would hold {held} bytes, {allowance.folder} at most (a file has {BLOCK} at least)",
                "FDELETE makes room",
            )

    def _files(self) -> Iterator[tuple[str, os.stat_result]]:
        root = self._folder.root
        for parent, folders, names in os.walk(root):
            folders[:] = [one for one in folders if not one.startswith(".")]
            for name in names:
                path = os.path.join(parent, name)
                try:
                    there = os.lstat(path)
                except OSError:
                    continue  # the file has just been deleted
                if not name.startswith(".") and stat.S_ISREG(there.st_mode):
                    yield os.path.relpath(path, root).replace(os.sep, "/"), there
