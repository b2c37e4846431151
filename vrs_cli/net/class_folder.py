"""The folder of a class, which `vrs class` makes and `vrs serve --class` serves:

tokens.toml      # the tokens themselves, so that links can be told again: for the teacher alone to read
files/ada/       # the files of each student's robots
journal/ada.vrst # what they did, and the programs and places that they know
hand-ins/ada/    # 20270311-101500-pick.v2: what was handed in, and when (UTC)
lessons/ada.json # where each student is in the lessons
collected/ada.v2 # the newest program of each, for vrs grade
"""

from __future__ import annotations

import re
import shutil
import time
import zipfile
from collections.abc import Iterable, Mapping
from io import BytesIO
from pathlib import Path

from msgspec import Struct

from vrs_cli.errors import FileError, LimitReached, UsageError
from vrs_cli.files.atomic import atomically, hold, writing
from vrs_cli.net.tokens import add_tokens, good_name, plain_tokens, read_tokens, take_out

TEACHER_NAME = "teacher"
OWN_ROBOTS = 2  # of each student: for work, and for lessons
MAX_HAND_IN_BYTES = 1_000_000
MAX_HAND_INS = 500  # of one student
SECONDS_TO_END = 20.0  # in which a running server has closed the robots of a student who was removed
_STAMP = "%Y%m%d-%H%M%S"
_HAND_IN = re.compile(r"\d{8}-\d{6}-.*\.v2")


class ClassFolder(Struct, frozen=True):
    """A class on the disk."""

    root: Path

    @property
    def tokens(self) -> Path:
        return self.root / "tokens.toml"

    @property
    def files(self) -> Path:
        return self.root / "files"

    @property
    def journal(self) -> Path:
        return self.root / "journal"

    @property
    def hand_ins(self) -> Path:
        return self.root / "hand-ins"

    @property
    def lessons(self) -> Path:
        return self.root / "lessons"

    @property
    def collected(self) -> Path:
        return self.root / "collected"

    def make(self, students: Iterable[str]) -> None:
        """Make the folder, or add students to it. Raises FileError, and UsageError for a name that is there already."""
        with writing(self.root, "name another folder"):
            self.root.mkdir(mode=0o700, parents=True, exist_ok=True)
        names = [*students, *(() if self.tokens.exists() else (TEACHER_NAME,))]
        add_tokens(self.tokens, [name for name in names if name != TEACHER_NAME], plain=True)
        if TEACHER_NAME in names:
            add_tokens(self.tokens, [TEACHER_NAME], TEACHER_NAME, plain=True)

    def students(self) -> Mapping[str, str]:
        """The tokens of the students by their names. Raises FileError."""
        return self._of(teacher=False)

    def teachers(self) -> Mapping[str, str]:
        """The tokens of the teachers by their names. Raises FileError."""
        return self._of(teacher=True)

    def _of(self, *, teacher: bool) -> Mapping[str, str]:
        grants = read_tokens(self.tokens).grants
        names = {grant.name for grant in grants if grant.teacher is teacher and not grant.body}
        return {name: token for name, token in plain_tokens(self.tokens).items() if name in names}

    # --- what was handed in ---

    def hand_in(self, student: str, name: str, text: str, now: float) -> str:
        """Keep a program that a student hands in; return the name of its file. Raises FileError, LimitReached."""
        data = text.encode()
        if len(data) > MAX_HAND_IN_BYTES:
            raise LimitReached(f"a program of {len(data)} bytes, {MAX_HAND_IN_BYTES} at most", "hand in a part of it")
        folder = self.hand_ins / student
        with writing(folder, "tell your teacher"):
            folder.mkdir(parents=True, exist_ok=True)
            there = {path.name for path in folder.iterdir()}
        if len(there) >= MAX_HAND_INS:
            raise LimitReached(f"{len(there)} programs are handed in already", "tell your teacher")
        stem = re.sub(r"[^A-Za-z0-9_-]", "_", name.removesuffix(".v2"))[:40] or "program"
        file = f"{time.strftime(_STAMP, time.gmtime(now))}-{stem}.v2"
        while file in there:
            file = f"{file.removesuffix('.v2')}_.v2"
        with atomically(folder / file) as stream:
            stream.write(data)
        return file

    def latest(self) -> Mapping[str, Path]:
        """The newest program of each student who has handed one in."""
        found = dict[str, Path]()
        for folder in sorted(self.hand_ins.iterdir()) if self.hand_ins.is_dir() else ():
            programs = self.programs(folder.name)
            if programs:
                found[folder.name] = programs[-1]
        return found

    def programs(self, student: str) -> list[Path]:
        """The programs that a student has handed in, the newest last."""
        folder = self.hand_ins / student
        return sorted(path for path in folder.glob("*.v2") if _HAND_IN.fullmatch(path.name)) if folder.is_dir() else []

    def collect(self, target: Path) -> Mapping[str, Path]:
        """Copy the newest program of each student to NAME.v2 in a folder, as `vrs grade` takes them; return what was
        copied by student. Raises FileError.
        """
        found = self.latest()
        with writing(target, "name another folder"):
            target.mkdir(parents=True, exist_ok=True)
            for student, path in found.items():
                with atomically(target / f"{student}.v2") as stream:
                    stream.write(path.read_bytes())
        return found

    def archive(self) -> bytes:
        """Return the newest programs of all students as a ZIP file. Raises FileError."""
        stream = BytesIO()
        with writing(self.hand_ins, "look at the disk"), zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as file:
            for student, path in self.latest().items():
                file.write(path, f"{student}.v2")
        return stream.getvalue()

    # --- a student who leaves ---

    def forget(self, student: str) -> None:
        """Remove a student: the token first, which puts him out of a running server, and then all files. Raises
        UsageError for a name that is not there, FileError.
        """
        if not good_name(student) or student in self.teachers():
            raise UsageError(f"{student} is no student of {self.root}", "vrs class links lists them")
        known = student in self.students()
        if known:
            take_out(self.tokens, [student])
        robots = [student, *(f"{student}-{number}" for number in range(2, OWN_ROBOTS + 1))]
        there = [path for robot in robots for path in self._files_of(robot)]
        others = self.hand_ins / student, self.lessons / f"{student}.json", self.collected / f"{student}.v2"
        there += [path for path in others if path.exists()]
        if not known and not there:
            raise UsageError(f"{student} is no student of {self.root}", "vrs class links lists them")
        for robot in robots:
            self._wait_for_end(self.journal / f"{robot}.vrst")
        with writing(self.root, "do it again when the server has ended"):
            for path in there:
                if path.is_dir() and not path.is_symlink():
                    shutil.rmtree(path)
                else:
                    path.unlink(missing_ok=True)
        self._forget_in_audits(student)

    def _files_of(self, robot: str) -> list[Path]:
        beside = (f"{robot}.vrst", f"{robot}.v2", f".{robot}.vrst.lock", f".{robot}.v2.lock")
        return [path for path in (self.files / robot, *(self.journal / name for name in beside)) if path.exists()]

    def _wait_for_end(self, journal: Path) -> None:
        """Wait until a running server has closed a robot. Raises FileError if it does not."""
        deadline = time.monotonic() + SECONDS_TO_END
        while journal.exists():
            try:
                hold(journal).release()
                return
            except FileError:
                if time.monotonic() > deadline:
                    raise
            time.sleep(0.1)

    def _forget_in_audits(self, student: str) -> None:
        """Leave out the lines of the audit that tell of a student."""
        tells = re.compile(rf'"(robot|who)": "{re.escape(student)}(-\d+)?"')
        for path in self.journal.glob("audit*.jsonl") if self.journal.is_dir() else ():
            with writing(path, "remove its lines by hand"):
                lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
                kept = [line for line in lines if not tells.search(line)]
                if len(kept) < len(lines):
                    with path.open("r+", encoding="utf-8") as stream:  # a running server goes on adding to this file
                        stream.writelines(kept)
                        stream.truncate()
