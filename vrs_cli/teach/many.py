"""Grade many submissions at a time, each in its own process; or on a cluster.

On a Dask cluster each task grades a batch of submissions in its own process, which forks as on one machine: `python -m
vrs_cli.teach.many FOLDER`.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Generator, Mapping, Sequence
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from msgspec import structs

from vrs_cli.errors import UsageError
from vrs_cli.extras import how_to_install
from vrs_cli.teach.exercise import Exercise, read_exercise
from vrs_cli.teach.grading import Grader, Grading, Submission, lost_grading
from vrs_cli.teach.pool import Fence, work_apart
from vrs_cli.teach.reports.pages import Replay, replay_of
from vrs_cli.teach.reports.results import grading_from, grading_object
from vrs_cli.version import __version__

FENCE = Fence(cpu=30.0, wall=120.0)


class Graded(NamedTuple):
    """A grading, with the replay for its page if one was wanted and exists."""

    grading: Grading
    replay: Replay | None = None


class GradingWork:
    """Grades one submission in its own process. `replays`: also make replays for pages."""

    def __init__(self, grader: Grader, *, replays: bool) -> None:
        self._grader, self._replays = grader, replays

    def __call__(self, submission: Submission) -> bytes:
        """Grade in the current folder, which is empty; return JSON for `graded_from`."""
        grading, runs = self._grader.runs(submission)
        replay = replay_of(self._grader.exercise, grading, runs) if self._replays else None
        return json.dumps(object_of(Graded(grading, replay))).encode()


def object_of(one: Graded) -> dict[str, object]:
    """Return a graded submission as a JSON object for `graded_from`."""
    replay = None if one.replay is None else structs.asdict(one.replay)
    return {"grading": grading_object(one.grading), "replay": replay}


def graded_from(data: bytes | str) -> Graded:
    """Return the graded submission from its JSON."""
    found = json.loads(data)
    replay = found["replay"]
    shown = None if replay is None else Replay(**{**replay, "curves": tuple(replay["curves"])})
    return Graded(grading_from(found["grading"]), shown)


def grade_many(
    grader: Grader, submissions: Sequence[Submission], jobs: int, *, replays: bool = False, fence: Fence = FENCE
) -> Generator[Graded, None, None]:
    """Grade submissions, `jobs` at a time; yield results as they finish, in any order. Closing the generator ends all
    processes.
    """
    yield from (Graded(lost_grading(one, one.unread)) for one in submissions if one.unread)
    readable = [one for one in submissions if not one.unread]
    for worked in work_apart(GradingWork(grader, replays=replays), readable, jobs, fence):
        if worked.lost:
            yield Graded(lost_grading(readable[worked.number], worked.lost))
        else:
            yield graded_from(worked.result)


SCHEDULER_TIMEOUT_S = 15  # [s] maximum wait for the scheduler, and for its first worker
MIN_BATCH, MAX_BATCH = 4, 32  # submissions of a batch, which starts its own process
MAX_MESSAGE_CHARS = 500  # maximum characters of the message of a failed process


class ClusterError(UsageError, text="No cluster"):
    """There is no scheduler, or its workers cannot grade."""


def grade_on_cluster(
    address: str, exercise: Exercise, submissions: Sequence[Submission], *, replays: bool
) -> Generator[Graded, None, None]:
    """Grade submissions on the workers of a scheduler; yield results as they finish. Closing the generator cancels all
    tasks.

    Raises ClusterError.
    """
    yield from (Graded(lost_grading(one, one.unread)) for one in submissions if one.unread)
    readable = [one for one in submissions if not one.unread]
    with _client(address) as client:
        cores = _cores(client)
        size = max(MIN_BATCH, min(MAX_BATCH, len(readable) // (4 * cores)))
        batches = [readable[first : first + size] for first in range(0, len(readable), size)]
        files = client.scatter(_files_of(Path(exercise.folder)), broadcast=True, hash=False)
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
    """Return the number of cores of all workers. Raises ClusterError if there are none, or if a worker has another
    version of vrs.
    """
    try:
        client.wait_for_workers(1, timeout=SCHEDULER_TIMEOUT_S)
    except TimeoutError:
        raise ClusterError("the scheduler has no workers", "dask worker ADDRESS starts one") from None
    try:
        versions = client.run(_version)
    except Exception as error:  # a worker without vrs may raise anything
        raise ClusterError(f"a worker has no vrs: {error}", "install the same vrs on all machines") from None
    others = {worker: one for worker, one in versions.items() if one != __version__}
    if others:
        worker, other = next(iter(others.items()))
        raise ClusterError(f"the worker {worker} has vrs {other}, and this is {__version__}", "install the same on all")
    cores: Mapping[str, int] = client.ncores()
    return max(1, sum(cores.values()))


def _version() -> str:
    return __version__


def _files_of(folder: Path) -> dict[str, bytes]:
    """Return all files of an exercise by their paths in its folder, because a worker may not have that folder."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for part in ("exercise", "teacher")
        for path in sorted((folder / part).rglob("*"))
        if path.is_file()
    }


# --- on a worker -----------------------------------------------------------------------------------------------------


def grade_batch(files: Mapping[str, bytes], name: str, submissions: list[dict[str, str]], replays: bool) -> list[str]:
    """Grade a batch in its own process, because a worker has threads and must not fork.

    Return JSON for `graded_from`.
    """
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
    """Grade the submissions from standard input, and print one JSON object per line."""
    submissions = [Submission(**one) for one in json.load(sys.stdin)]
    for one in grade_many(Grader(read_exercise(folder)), submissions, 1, replays=replays, fence=FENCE):
        print(json.dumps(object_of(one)))


if __name__ == "__main__":
    main(sys.argv[1], "--replays" in sys.argv[2:])
