"""The working folder of one run: all that the run writes is in it; what the run reads is copied into it first."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from msgspec import field

from vrs_cli.errors import FileError, FileOutside
from vrs_cli.files.bounds import Folder

MAX_COPY_BYTES = 100_000_000


class WorkingFolder(Folder, frozen=True, kw_only=True):
    """A closed folder in which the files of `source` seem to be: a file is copied when it is first named. Links,
    devices and pipes are not; `below`: nor are files in folders below `source`, unless it is true.
    """

    source: Path
    closed: bool = True
    below: bool = True
    _named: dict[Path, os.stat_result | None] = field(default_factory=dict)  # and what was copied

    def inside(self, name: str, *, pattern: bool = False) -> Path:
        path = Folder.inside(self, name, pattern=pattern)
        if path not in self._named:
            self._named[path] = None
            self._named[path] = self._copied(path)
        return path

    def _copied(self, path: Path) -> os.stat_result | None:
        """The copy of a file, where there is one that can be read. Raises FileError where it cannot be copied."""
        inner = path.relative_to(self.root)
        if path.exists() or (len(inner.parts) > 1 and not self.below):
            return None
        given = Folder(self.source, closed=True)
        try:
            original = given.inside(inner.as_posix())
            if original.parent.is_dir():
                path.parent.mkdir(parents=True, exist_ok=True)
            with given.open_to_read(original) as stream:
                if (size := os.fstat(stream.fileno()).st_size) > MAX_COPY_BYTES:
                    raise FileError(f"{path.name} has {size} bytes", f"a folder run reads {MAX_COPY_BYTES} at most")
                try:
                    with path.open("xb") as copy:
                        shutil.copyfileobj(stream, copy)
                except OSError as error:
                    hint = "the folder of the run has no room for a copy"
                    raise FileError(f"{path.name}: {error.strerror}", hint) from None
                return path.stat()
        except (OSError, FileOutside):  # it is not there, or cannot be read
            return None

    def drop_copies(self) -> None:
        """Remove the copies that the run has not written to."""
        for path, copied in self._named.items():
            if copied is None or not path.is_file():
                continue
            now = path.stat()
            if (now.st_ino, now.st_mtime_ns, now.st_size) == (copied.st_ino, copied.st_mtime_ns, copied.st_size):
                path.unlink()
                for folder in path.relative_to(self.root).parents[:-1]:
                    if not any((self.root / folder).iterdir()):
                        (self.root / folder).rmdir()


@contextmanager
def working_folder(source: Path, kept: Path | None = None, *, below: bool = True) -> Iterator[WorkingFolder]:
    """A working folder for one run, which is removed after it; `kept`: it is this one, and what was written stays.

    Raises FileError where it cannot be made.
    """
    if kept is None:
        with TemporaryDirectory(prefix="vrs-run-", ignore_cleanup_errors=True) as made:
            yield WorkingFolder(root=Path(made), source=source, below=below)
        return
    try:
        kept.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(f"{kept}: {error.strerror}", "name another folder") from None
    folder = WorkingFolder(root=kept, source=source, below=below)
    try:
        yield folder
    finally:
        folder.drop_copies()
