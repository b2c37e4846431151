"""What others may do to a file that somebody writes: each takes it away in its own manner."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from tests.files.trajectories import initial, puma
from vrs_cli.files.trajectory_file import write_trajectory


def _saved(path: Path) -> Path:
    write_trajectory(path, puma(), [initial()], ())
    return path


def _lead_elsewhere(path: Path) -> None:
    path.rename(path.with_name("old.vrst"))
    path.symlink_to(_saved(path.with_name("other.vrst")))


def _make_folder(path: Path) -> None:
    path.unlink()
    path.mkdir()


def _make_pipe(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


def _loop(path: Path) -> None:
    path.unlink()
    path.symlink_to(path)


def _add(path: Path) -> None:
    with path.open("ab") as stream:
        stream.write(b"from elsewhere\n")


def _the_same_again(path: Path) -> None:
    content = path.read_bytes()
    path.unlink()
    path.write_bytes(content)


def _by(path: Path, size: int) -> None:
    os.truncate(path, path.stat().st_size + size)


CHANGES: dict[str, Callable[[Path], object]] = {
    "rm": Path.unlink,
    "mv": lambda path: path.rename(path.with_name("old.vrst")),
    "emptied": lambda path: os.truncate(path, 0),
    "cut short": lambda path: _by(path, -7),
    "grown by a hole": lambda path: _by(path, 7),
    "added to": _add,
    "replaced": lambda path: os.replace(_saved(path.with_name("other.vrst")), path),
    "written over": lambda path: path.write_bytes(b"something else\n"),
    "the same again": _the_same_again,
    "a folder": _make_folder,
    "a link elsewhere": _lead_elsewhere,
    "a link to itself": _loop,
} | ({"a pipe": _make_pipe} if hasattr(os, "mkfifo") else {})
