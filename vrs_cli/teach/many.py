"""Grade many submissions at the same time, each in its own process, or on a cluster.

On one machine a forked process handles each item, in an empty folder and with limits of the operating system. A fork
already has all loaded modules and caches. Where forking is unsafe, each item gets a new process.

On a Dask cluster each task grades a batch of submissions in its own process, which forks as on one machine: `python -m
vrs_cli.teach.many FOLDER`.
"""

from __future__ import annotations

import gc
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections import deque
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from multiprocessing import get_all_start_methods, get_context
from multiprocessing.connection import wait
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple, TypeVar

from msgspec import Struct, structs

from vrs_cli.errors import UsageError
from vrs_cli.extras import how_to_install
from vrs_cli.teach.exercise import Exercise, read_exercise
from vrs_cli.teach.grading import Grader, Grading, Submission, lost_grading
from vrs_cli.teach.reports.pages import Replay, replay_of
from vrs_cli.teach.reports.results import grading_from, grading_object
from vrs_cli.version import __version__

# fork only where it is safe: system libraries of macOS fail after a fork
FORK = "fork" in get_all_start_methods() and sys.platform != "darwin"
MAX_RESULT_BYTES = 64_000_000
RESULT, ERROR = b"+", b"-"  # first byte of the message that a process sends
NO_MEMORY = 71  # exit status of a process that ran out of memory
GRACE = 2.0  # [s] time that the parent waits after the deadline of a process before it kills the process

Item = TypeVar("Item")


class ProcessLimits(Struct, frozen=True):
    """Limits of the operating system for one process: processor time and wall time [s], memory in addition to the
    parent's, and size of a file [bytes]. They stop a process that the limits of the VAL-II interpreter did not stop."""

    cpu: float = 60.0
    wall: float = 300.0
    memory: int = 1_000_000_000
    file: int = 100_000_000


class Worked(NamedTuple):
    """The result of processing one item, or the reason why it has none (`lost`). `number`: the index of the item, from
    0."""

    number: int
    result: bytes
    lost: str = ""


def core_count() -> int:
    """Return the number of processor cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def work_apart(
    work: Callable[[Item], bytes], items: Sequence[Item], jobs: int, limits: ProcessLimits
) -> Generator[Worked, None, None]:
    """Process all items, `jobs` at the same time; yield results as they finish. A killed process loses only its own
    item.

    `work` is called in an empty folder, which is removed afterwards. Without fork `work` is pickled. Closing the
    generator ends all processes.
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
                    process = context.Process(
                        target=_run_apart, args=(work, item, sending, folder, limits), daemon=True
                    )
                    with _signals_held():
                        process.start()
                    # close the parent's copy of this end, so that the pipe closes when the process ends
                    sending.close()
                    running[receiving] = _Process(number, process, folder, time.monotonic() + limits.wall + GRACE)
                due = min(one.deadline for one in running.values())
                for receiving in wait(list(running), max(due - time.monotonic(), 0.0)):
                    yield running.pop(receiving).take_result(receiving, limits)
                for receiving, one in list(running.items()):
                    if time.monotonic() > one.deadline:
                        one.end()
                        yield running.pop(receiving).take_result(receiving, limits)
        finally:
            for one in running.values():
                one.end()


class _Process(NamedTuple):
    """A running process: its item, its folder, and its deadline [s, monotonic]."""

    number: int
    process: Any
    folder: Path
    deadline: float

    def take_result(self, receiving: Any, limits: ProcessLimits) -> Worked:
        """Return the result of a process that has sent a message or has ended."""
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
        return Worked(self.number, b"", sent[1:].decode(errors="replace") or _why(self.process.exitcode, late, limits))

    def end(self) -> None:
        """Kill the process and its process group."""
        if hasattr(os, "killpg"):
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(self.process.pid, signal.SIGKILL)
        self.process.kill()
        self.process.join()


def _why(status: int | None, late: bool, limits: ProcessLimits) -> str:
    """Describe why a process ended without a result."""
    if status == NO_MEMORY:
        return f"it needed more than {limits.memory // 1_000_000} MB of memory"
    by = -(status or 0)
    if late or by == getattr(signal, "SIGALRM", None):
        return f"it took longer than {limits.wall:g} s"
    if by == getattr(signal, "SIGXCPU", None):
        return f"it took more than {limits.cpu:g} s of the processor"
    return (
        f"its process was ended by {signal.Signals(by).name}" if by > 0 else f"its process ended with status {status}"
    )


@contextmanager
def _shared_memory() -> Iterator[None]:
    """Keep the current memory shared with forked processes: the garbage collector must not touch its objects. Objects
    that the caller froze stay frozen."""
    frozen_by_caller = gc.get_freeze_count()
    if FORK:
        gc.collect()
        gc.freeze()
    try:
        yield
    finally:
        if FORK and not frozen_by_caller:
            gc.unfreeze()


@contextmanager
def _signals_held() -> Iterator[None]:
    """Block signals during a fork, because an exception raised by a signal handler would be lost."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGINT, signal.SIGTERM, signal.SIGHUP))
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


# --- in the child process that processes one item --------------------------------------------------------------------


def _run_apart(work: Callable[[Item], bytes], item: Item, sending: Any, folder: Path, limits: ProcessLimits) -> None:
    """Process an item in this process, and send the result to the parent."""
    try:
        _confine(folder, limits)
        sent = RESULT + work(item)
    except MemoryError:
        os._exit(NO_MEMORY)
    except Exception as error:  # catch everything: an internal error of vrs must lose only this item
        sent = ERROR + f"vrs itself failed: {type(error).__name__}: {error}"[:1000].encode(errors="replace")
    sending.send_bytes(sent)
    sending.close()


def _confine(folder: Path, limits: ProcessLimits) -> None:
    """Prepare this process: enter the folder, start a session without a terminal, and set the limits of the operating
    system."""
    os.chdir(folder)
    os.umask(0o077)
    gc.set_threshold(100_000, 50, 100)  # collect garbage rarely, because the process ends soon
    if hasattr(os, "setsid"):
        os.setsid()
    nothing = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1, 2):
        os.dup2(nothing, stream)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # ignore Ctrl-C here: the parent handles it and ends this process
    for name in ("SIGTERM", "SIGALRM", "SIGXCPU", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_DFL)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_SETMASK, ())
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_REAL, limits.wall)  # a timer that ends the process even if the parent is gone
    try:
        import resource
    except ImportError:  # Windows lacks these modules: only the parent's deadline applies
        return
    _limit(resource.RLIMIT_CPU, max(1, round(limits.cpu)))
    _limit(resource.RLIMIT_FSIZE, limits.file)
    _limit(resource.RLIMIT_CORE, 0)
    # set no memory limit where it fails: only Linux reports the current size and enforces this limit
    with suppress(OSError, ValueError):
        pages = int(Path("/proc/self/statm").read_text().split()[0])
        _limit(resource.RLIMIT_AS, pages * resource.getpagesize() + limits.memory)


def _limit(what: int, most: int) -> None:
    """Lower the operating system's limit `what` of this process to `most`; never raise it."""
    import resource

    _, hard = resource.getrlimit(what)
    least = most if hard == resource.RLIM_INFINITY else min(most, hard)
    with suppress(ValueError, OSError):
        resource.setrlimit(what, (least, hard))


GRADING_LIMITS = ProcessLimits(cpu=30.0, wall=120.0)


class Graded(NamedTuple):
    """A grading, with a replay for its page if one was requested and a run exists."""

    grading: Grading
    replay: Replay | None = None


def grade_one(grader: Grader, replays: bool, submission: Submission) -> bytes:
    """Grade a submission in the current folder, which is empty; return JSON for `graded_from`. `replays`: also make a
    replay for its page."""
    grading, runs = grader.runs(submission)
    replay = replay_of(grader.exercise, grading, runs) if replays else None
    return json.dumps(object_of(Graded(grading, replay))).encode()


def object_of(one: Graded) -> dict[str, object]:
    """Return a graded submission as a JSON object for `graded_from`."""
    replay = None if one.replay is None else structs.asdict(one.replay)
    return {"grading": grading_object(one.grading), "replay": replay}


def graded_from(data: bytes | str) -> Graded:
    """Return the graded submission that a JSON text describes."""
    found = json.loads(data)
    replay = found["replay"]
    shown = None if replay is None else Replay(**{**replay, "curves": tuple(replay["curves"])})
    return Graded(grading_from(found["grading"]), shown)


def grade_many(
    grader: Grader,
    submissions: Sequence[Submission],
    jobs: int,
    *,
    replays: bool = False,
    limits: ProcessLimits = GRADING_LIMITS,
) -> Generator[Graded, None, None]:
    """Grade submissions, `jobs` at the same time; yield results in the order in which they finish. Closing the
    generator ends all processes."""
    yield from (Graded(lost_grading(one, one.unread)) for one in submissions if one.unread)
    readable = [one for one in submissions if not one.unread]
    for one in work_apart(partial(grade_one, grader, replays), readable, jobs, limits):
        yield Graded(lost_grading(readable[one.number], one.lost)) if one.lost else graded_from(one.result)


SCHEDULER_TIMEOUT_S = 15  # [s] maximum wait for the scheduler, and for its first worker
MIN_BATCH, MAX_BATCH = 4, 32  # minimum and maximum number of submissions in a batch, which one process grades
MAX_MESSAGE_CHARS = 500  # maximum characters of the message of a failed process


class ClusterError(UsageError, text="No cluster"):
    """The error raised if no scheduler can be reached, or if its workers cannot grade."""


def grade_on_cluster(
    address: str, exercise: Exercise, submissions: Sequence[Submission], *, replays: bool
) -> Generator[Graded, None, None]:
    """Grade submissions on the workers of a scheduler; yield results in the order in which they finish. Closing the
    generator cancels all tasks. Raises ClusterError."""
    yield from (Graded(lost_grading(one, one.unread)) for one in submissions if one.unread)
    readable = [one for one in submissions if not one.unread]
    with _client(address) as client:
        size = max(MIN_BATCH, min(MAX_BATCH, len(readable) // (4 * _cores(client))))
        batches = [readable[first : first + size] for first in range(0, len(readable), size)]
        folder = Path(exercise.folder)  # a worker may not have this folder, so it gets the contents of the files
        paths = (path for part in ("exercise", "teacher") for path in sorted((folder / part).rglob("*")))
        contents = {path.relative_to(folder).as_posix(): path.read_bytes() for path in paths if path.is_file()}
        files = client.scatter(contents, broadcast=True, hash=False)
        futures = {
            client.submit(grade_batch, files, exercise.name, [*map(structs.asdict, one)], replays, pure=False): one
            for one in batches
        }
        try:
            distributed: Any = import_module("distributed")
            for future in distributed.as_completed(futures, raise_errors=False):
                if future.status == "finished":
                    yield from map(graded_from, future.result())
                else:
                    why = f"the task on the cluster failed: {future.exception()}"[:MAX_MESSAGE_CHARS]
                    yield from (Graded(lost_grading(one, why)) for one in futures[future])
        finally:
            client.cancel(list(futures))


def _client(address: str) -> Any:
    """Connect to the scheduler. Raises ClusterError."""
    if find_spec("distributed") is None:
        raise ClusterError("--dask needs distributed, which is not installed", how_to_install("dask distributed"))
    distributed: Any = import_module("distributed")
    try:
        return distributed.Client(address, timeout=SCHEDULER_TIMEOUT_S)
    except (OSError, ValueError, TimeoutError) as error:
        raise ClusterError(f"no scheduler answers at {address}: {error}", "dask scheduler tells its address") from None


def _cores(client: Any) -> int:
    """Return how many cores all workers have together. Raises ClusterError if there are no workers, or if a worker has
    another version of vrs."""
    try:
        client.wait_for_workers(1, timeout=SCHEDULER_TIMEOUT_S)
    except TimeoutError:
        raise ClusterError("the scheduler has no workers", "dask worker ADDRESS starts one") from None
    try:
        versions = client.run(_version)
    except Exception as error:  # catch everything: without vrs installed, a worker may raise any exception
        raise ClusterError(f"a worker has no vrs: {error}", "install the same vrs on all machines") from None
    for worker, other in ((worker, one) for worker, one in versions.items() if one != __version__):
        raise ClusterError(f"the worker {worker} has vrs {other}, and this is {__version__}", "install the same on all")
    cores: Mapping[str, int] = client.ncores()
    return max(1, sum(cores.values()))


def _version() -> str:
    return __version__


# --- on a worker -----------------------------------------------------------------------------------------------------


def grade_batch(files: Mapping[str, bytes], name: str, submissions: list[dict[str, str]], replays: bool) -> list[str]:
    """Grade a batch of submissions in a new process, because a worker has threads and must not fork. Return JSON for
    `graded_from`."""
    with TemporaryDirectory(prefix="vrs-grade-", ignore_cleanup_errors=True) as root:
        folder = Path(root, name)
        for path, content in files.items():
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / path).write_bytes(content)
        command = [sys.executable, "-m", __name__, str(folder), *["--replays"] * replays]
        done = subprocess.run(command, input=json.dumps(submissions), capture_output=True, text=True, check=False)
        if done.returncode:
            raise RuntimeError(done.stderr[-MAX_MESSAGE_CHARS:].strip())
        return done.stdout.splitlines()


def main(folder: str, replays: bool) -> None:
    """Grade the submissions that are read from standard input, and print one JSON object per line."""
    submissions = [Submission(**one) for one in json.load(sys.stdin)]
    for one in grade_many(Grader(read_exercise(folder)), submissions, 1, replays=replays, limits=GRADING_LIMITS):
        print(json.dumps(object_of(one)))


if __name__ == "__main__":
    main(sys.argv[1], "--replays" in sys.argv[2:])
