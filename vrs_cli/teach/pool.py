"""Process items in separate processes, each forked from this warm one, in an empty folder with limits of the system.

If forking is unsafe, each item gets a new process.
"""

from __future__ import annotations

import gc
import os
import shutil
import signal
import sys
import time
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager, suppress
from multiprocessing import get_all_start_methods, get_context
from multiprocessing.connection import wait
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple, TypeVar

from msgspec import Struct

FORK = "fork" in get_all_start_methods() and sys.platform != "darwin"  # libraries of macOS break when forked
MAX_RESULT_BYTES = 64_000_000
RESULT, ERROR = b"+", b"-"  # first byte of the message of a process
NO_MEMORY = 71  # exit status of a process that ran out of memory
GRACE = 2.0  # [s] that the parent waits after the deadline of a process

Item = TypeVar("Item")


class Fence(Struct, frozen=True):
    """Limits of the system for one process: processor time and wall time [s], memory beyond that of the parent, and
    size of a file [bytes].

    They stop what the limits of the interpreter did not stop.
    """

    cpu: float = 60.0
    wall: float = 300.0
    memory: int = 1_000_000_000
    file: int = 100_000_000


class Worked(NamedTuple):
    """The result of an item, or why there is none (`lost`). `number`: of the item, from 0."""

    number: int
    result: bytes
    lost: str = ""


def core_count() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def work_apart(
    work: Callable[[Item], bytes], items: Sequence[Item], jobs: int, fence: Fence
) -> Generator[Worked, None, None]:
    """Process all items, `jobs` at a time; yield results as they finish. A killed process loses only its own item.

    `work` is called in an empty folder, which is removed afterwards. Without fork it is pickled. Closing the generator
    ends all processes.
    """
    context: Any = get_context("fork" if FORK else "spawn")
    waiting, running = deque(enumerate(items)), dict[Any, _Process]()
    with TemporaryDirectory(prefix="vrs-grade-", ignore_cleanup_errors=True) as root, _shared_memory():
        try:
            while waiting or running:
                while waiting and len(running) < jobs:
                    number, item = waiting.popleft()
                    folder = Path(root, str(number))
                    folder.mkdir()
                    receiving, sending = context.Pipe(duplex=False)
                    process = context.Process(target=_run_apart, args=(work, item, sending, folder, fence), daemon=True)
                    with _signals_held():
                        process.start()
                    sending.close()  # so that the pipe closes when the process is gone
                    running[receiving] = _Process(number, process, folder, time.monotonic() + fence.wall + GRACE)
                due = min(one.deadline for one in running.values())
                for receiving in wait(list(running), max(due - time.monotonic(), 0.0)):
                    yield running.pop(receiving).take_result(receiving, fence)
                for receiving, one in list(running.items()):
                    if time.monotonic() > one.deadline:
                        one.end()
                        yield running.pop(receiving).take_result(receiving, fence)
        finally:
            for one in running.values():
                one.end()


class _Process(NamedTuple):
    """A running process: its item, its folder, and its deadline [s, monotonic]."""

    number: int
    process: Any
    folder: Path
    deadline: float

    def take_result(self, receiving: Any, fence: Fence) -> Worked:
        """Return the result of a process that has sent one or has ended."""
        try:
            sent = receiving.recv_bytes(MAX_RESULT_BYTES)
        except (EOFError, OSError):
            sent = b""
        receiving.close()
        self.process.join(0.0 if sent else GRACE)
        late = time.monotonic() > self.deadline
        self.end()
        shutil.rmtree(self.folder, ignore_errors=True)
        if sent[:1] == RESULT:
            return Worked(self.number, sent[1:])
        why = sent[1:].decode(errors="replace") or _why(self.process.exitcode, late, fence)
        return Worked(self.number, b"", why)

    def end(self) -> None:
        """Kill the process and its group."""
        if hasattr(os, "killpg"):
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(self.process.pid, signal.SIGKILL)
        self.process.kill()
        self.process.join()


def _why(status: int | None, late: bool, fence: Fence) -> str:
    """Describe why a process ended without a result."""
    if status == NO_MEMORY:
        return f"it needed more than {fence.memory // 1_000_000} MB of memory"
    by = -(status or 0)
    if late or by == getattr(signal, "SIGALRM", None):
        return f"it took longer than {fence.wall:g} s"
    if by == getattr(signal, "SIGXCPU", None):
        return f"it took more than {fence.cpu:g} s of the processor"
    if by > 0:
        return f"its process was ended by {signal.Signals(by).name}"
    return f"its process ended with status {status}"


@contextmanager
def _shared_memory() -> Iterator[None]:
    """Share the current memory with forked processes: the garbage collector leaves its objects alone. Objects that the
    caller froze stay frozen.
    """
    if not FORK:
        yield
        return
    frozen_by_caller = gc.get_freeze_count()
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        if not frozen_by_caller:
            gc.unfreeze()


@contextmanager
def _signals_held() -> Iterator[None]:
    """Block signals during a fork, because an exception of their handler would be lost."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGINT, signal.SIGTERM, signal.SIGHUP))
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


# --- in the process of an item ---------------------------------------------------------------------------------------


def _run_apart(work: Callable[[Item], bytes], item: Item, sending: Any, folder: Path, fence: Fence) -> None:
    """Process an item, and send the result."""
    try:
        _confine(folder, fence)
        sent = RESULT + work(item)
    except MemoryError:
        os._exit(NO_MEMORY)
    except Exception as error:  # a fault of vrs itself loses only this item
        sent = ERROR + f"vrs itself failed: {type(error).__name__}: {error}"[:1000].encode(errors="replace")
    sending.send_bytes(sent)
    sending.close()


def _confine(folder: Path, fence: Fence) -> None:
    """Enter the folder, with its own session, without a terminal, and with the limits of the system."""
    os.chdir(folder)
    os.umask(0o077)
    gc.set_threshold(100_000, 50, 100)  # rarely, because the process ends soon
    if hasattr(os, "setsid"):
        os.setsid()
    nothing = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1, 2):
        os.dup2(nothing, stream)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent ends this process
    for name in ("SIGTERM", "SIGALRM", "SIGXCPU", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_DFL)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_SETMASK, ())
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_REAL, fence.wall)  # works even if the parent is gone
    try:
        import resource
    except ImportError:  # Windows has only the parent's deadline
        return
    _limit(resource.RLIMIT_CPU, max(1, round(fence.cpu)))
    _limit(resource.RLIMIT_FSIZE, fence.file)
    _limit(resource.RLIMIT_CORE, 0)
    with suppress(OSError, ValueError):  # only Linux reports the current size and enforces this limit
        pages = int(Path("/proc/self/statm").read_text().split()[0])
        _limit(resource.RLIMIT_AS, pages * resource.getpagesize() + fence.memory)


def _limit(what: int, most: int) -> None:
    """Lower a limit of this process; never raise it."""
    import resource

    _, hard = resource.getrlimit(what)
    least = most if hard == resource.RLIM_INFINITY else min(most, hard)
    with suppress(ValueError, OSError):
        resource.setrlimit(what, (least, hard))
