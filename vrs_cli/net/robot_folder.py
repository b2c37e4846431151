"""The files of a robot that is served: put, fetched and listed within its folder, which no name leads out of."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator, Sequence
from itertools import islice

from vrs_cli.errors import FileError, FileExists, LimitReached
from vrs_cli.files.atomic import atomically
from vrs_cli.files.disk import BLOCK
from vrs_cli.files.folder import existing
from vrs_cli.files.opening import Folder, unreadable
from vrs_cli.net.limits import UNMEASURED, Allowance
from vrs_cli.net.messages import StoredFile

LARGEST = 50_000_000  # bytes of a file that is fetched
MOST_LISTED = 10_000


def put(folder: Folder, name: str, data: bytes, allowance: Allowance, *, replace: bool) -> None:
    """Write a file, whole or not at all. Raises FileError, FileOutside, FileExists, LimitReached."""
    path = folder.inside(name)
    if path.is_dir():
        raise FileError(f"{name} is a folder", "name a file")
    if os.path.lexists(path) and not replace:
        raise FileExists(name, "--replace overwrites it")
    if not path.parent.is_dir():
        raise FileError(f"{name}: there is no such folder", "a name without folders is always good")
    check_room(folder, allowance, (len(data),))
    with atomically(path, folder) as stream:
        stream.write(data)


def fetch(folder: Folder, name: str) -> bytes:
    """Raises NonexistentFile, FileError, FileOutside."""
    path = existing(folder.inside(name))
    try:
        with folder.open_to_read(path) as stream:
            data = stream.read(LARGEST + 1)
    except OSError as error:
        raise unreadable(path, error) from None
    if len(data) > LARGEST:
        raise FileError(f"{name} has more than {LARGEST} bytes", "fetch it from the server's own disk")
    return data


def listed(folder: Folder) -> tuple[StoredFile, ...]:
    """All files, those in folders below with their way; hidden ones are left out."""
    found: list[StoredFile] = []
    for place, there in _files(folder):
        if len(found) == MOST_LISTED:
            break
        found.append(StoredFile(place, there.st_size, there.st_mtime))
    return tuple(sorted(found, key=lambda one: one.name))


def check_room(folder: Folder, allowance: Allowance, new: Sequence[int] = ()) -> None:
    """Raises LimitReached for a folder that holds too much, beside `new` files of these sizes."""
    if allowance.folder >= UNMEASURED:
        return
    there = (found.st_size for _, found in _files(folder))
    sizes = [*islice(there, allowance.files + 1), *new]
    held = sum(max(size, BLOCK) for size in sizes)
    if len(sizes) > allowance.files:
        raise LimitReached(f"the robot's folder would hold more than {allowance.files} files", "FDELETE makes room")
    if held > allowance.folder:
        what = f"the robot's folder would hold {held} bytes, {allowance.folder} at most (a file has {BLOCK} at least)"
        raise LimitReached(what, "FDELETE makes room")


def _files(folder: Folder) -> Iterator[tuple[str, os.stat_result]]:
    for parent, folders, names in os.walk(folder.root):
        folders[:] = [one for one in folders if not one.startswith(".")]
        for name in names:
            path = os.path.join(parent, name)
            try:
                there = os.lstat(path)
            except OSError:
                continue  # it has just been deleted
            if not name.startswith(".") and stat.S_ISREG(there.st_mode):
                yield os.path.relpath(path, folder.root).replace(os.sep, "/"), there
