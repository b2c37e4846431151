"""The rules that Windows has for files, enforced elsewhere: a plugin for pytest, which needs /proc.

    python -m pytest -p tests.files.windows_rules tests/files

A file that is open can neither be removed nor renamed nor replaced, and no folder with one in it; a folder cannot be
opened; some names are devices. The modules and calls that only POSIX has are not there. A lock on a file would shut
its readers out: only lock files may be locked.
"""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path, PureWindowsPath
from typing import Any

import filelock
import pytest

from vrs_cli.files import atomic

POSIX_MODULES = ("fcntl", "grp", "pty", "pwd", "resource", "termios", "tty")
POSIX_CALLS = ("fork", "mkfifo", "O_NOFOLLOW", "O_NONBLOCK", "fchmod", "fchown")


def _place(path: Any) -> str:
    """Where a name is, without following it."""
    folder, name = os.path.split(os.path.abspath(os.fspath(path)))
    return os.path.join(os.path.realpath(folder), name)


def _open_files() -> Iterator[str]:
    for handle in os.listdir("/proc/self/fd"):
        try:
            yield os.readlink(f"/proc/self/fd/{handle}")
        except OSError:
            continue


def _check_closed(path: Any) -> None:
    place = _place(path)
    if any(one == place or one.startswith(f"{place}/") for one in _open_files()):
        raise PermissionError(errno.EACCES, "The process cannot access the file because it is being used", str(path))


def _check_name(path: Any) -> None:
    if isinstance(path, int):
        return
    name = os.path.basename(os.fspath(path))
    if PureWindowsPath(name).is_reserved() or set(name) & set('<>:"|?*') or name.endswith((".", " ")):
        raise OSError(errno.EINVAL, "The filename is incorrect", str(path))


def _removing(real: Callable[..., Any]) -> Callable[..., Any]:
    def remove(path: Any, **named: Any) -> Any:
        if "dir_fd" not in named or named["dir_fd"] is None:
            _check_closed(path)
        return real(path, **named)

    return remove


def _moving(real: Callable[..., Any], *, onto: bool) -> Callable[..., Any]:
    def move(old: Any, new: Any, *, src_dir_fd: None = None, dst_dir_fd: None = None) -> Any:
        assert src_dir_fd is dst_dir_fd is None, "folders are not opened there"
        _check_closed(old)
        _check_closed(new)
        _check_name(new)
        if not onto and os.path.lexists(new):
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(new))
        return real(old, new)

    return move


def _opening(real: Callable[..., int]) -> Callable[..., int]:
    def open_(path: Any, flags: int, *more: Any, **named: Any) -> int:
        _check_name(path)
        if os.path.isdir(path) and "dir_fd" not in named:
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))
        return real(path, flags, *more, **named)

    return open_


def _locking(real: Callable[..., bool]) -> Callable[..., bool]:
    def lock_(handle: int, **named: Any) -> bool:
        assert os.readlink(f"/proc/self/fd/{handle}").removesuffix(" (deleted)").endswith(".lock"), "shuts readers out"
        return real(handle, **named)

    return lock_


def pytest_configure() -> None:
    if sys.platform == "win32":
        return
    for name in POSIX_MODULES:
        sys.modules[name] = None  # type: ignore[assignment]
    for name in POSIX_CALLS:
        if hasattr(os, name):
            delattr(os, name)
    os.open = _opening(os.open)  # type: ignore[assignment]
    os.unlink = os.remove = _removing(os.unlink)
    os.rmdir = _removing(os.rmdir)
    os.rename = _moving(os.rename, onto=False)  # type: ignore[assignment]
    os.replace = _moving(os.replace, onto=True)  # type: ignore[assignment]
    filelock.lock_descriptor = _locking(filelock.lock_descriptor)
    atomic.WINDOWS = True


@pytest.fixture(autouse=True, scope="session")
def _rules_hold(tmp_path_factory: pytest.TempPathFactory) -> None:
    """The rules are those of Windows indeed."""
    path: Path = tmp_path_factory.mktemp("rules") / "open"
    with path.open("w"):
        for act in (path.unlink, lambda: path.rename(path.with_name("b")), lambda: path.parent.rename("c")):
            with pytest.raises(PermissionError):
                act()
    with pytest.raises(PermissionError):
        os.open(path.parent, os.O_RDONLY)
