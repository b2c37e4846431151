"""A file layer that fails when it is told to: each call of the system that changes a file is counted, and one of them,
or all from one on, go wrong. What has been synced is remembered, as a disk has it after a power cut."""

from __future__ import annotations

import errno
import io
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Any

import pytest

CALLS = ("open", "write", "fsync", "ftruncate", "replace", "chmod", "unlink")


class Fault(Enum):
    """How a call goes wrong: with an error, or a write that takes only part and fails with the rest."""

    FULL = errno.ENOSPC
    BROKEN = errno.EIO
    SHORT = errno.EDQUOT


@dataclass(eq=False)
class Faults:
    """The calls from the one numbered `first` to the one numbered `last` fail; `calls` are the names of all so far."""

    fault: Fault = Fault.BROKEN
    first: float = float("inf")
    last: float = float("inf")
    calls: list[str] = field(default_factory=list)
    synced: dict[Path, bytes] = field(default_factory=dict)
    _opened: dict[int, Path] = field(default_factory=dict)

    def call(self, name: str, real: Callable[..., Any], *arguments: Any) -> Any:
        self.calls.append(name)
        if self.first <= len(self.calls) <= self.last:
            if self.fault is Fault.SHORT and name == "write" and len(arguments[1]) > 1:
                handle, data = arguments
                return real(handle, bytes(data)[: len(data) // 2])
            raise OSError(self.fault.value, os.strerror(self.fault.value))
        done = real(*arguments)
        self._remember(name, arguments, done)
        return done

    def _remember(self, name: str, arguments: tuple[Any, ...], done: Any) -> None:
        if name == "open":
            self._opened[done] = Path(arguments[0])
        elif name == "replace":
            self.synced[Path(arguments[1])] = self.synced.pop(Path(arguments[0]))
        elif name == "fsync" and (path := self._opened[arguments[0]]).is_file():
            self.synced[path] = path.read_bytes()


class _Raw(io.FileIO):
    """A file whose writes can be counted."""

    def write(self, data: Any) -> int:
        return os.write(self.fileno(), data)


@contextmanager
def faulty(faults: Faults) -> Iterator[Faults]:
    """The file layer of this process is that one until the end of the block."""
    with pytest.MonkeyPatch.context() as patch:
        for name in CALLS:
            real = getattr(os, name)

            def call(*arguments: Any, _name: str = name, _real: Callable[..., Any] = real, **named: Any) -> Any:
                return faults.call(_name, lambda *given: _real(*given, **named), *arguments)

            patch.setattr(os, name, call)
        patch.setattr(os, "fdopen", lambda handle, mode: io.BufferedWriter(_Raw(handle, mode)))
        yield faults
