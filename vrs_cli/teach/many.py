"""Grade many submissions at a time, each in a process of its own."""

from __future__ import annotations

import json
from collections.abc import Generator, Sequence
from typing import NamedTuple

from msgspec import structs

from vrs_cli.teach.grading import Grader, Grading, lost_grading
from vrs_cli.teach.pool import Fence, work_apart
from vrs_cli.teach.reports.pages import Replay, replay_of
from vrs_cli.teach.reports.results import grading_from, grading_object
from vrs_cli.teach.submission import Submission

FENCE = Fence(cpu=30.0, wall=120.0)


class Graded(NamedTuple):
    """A grading, and the replay for its page, where one was asked for and there is one."""

    grading: Grading
    replay: Replay | None = None


class GradingWork:
    """The work on one submission, in a process of its own. `replays`: make replays for pages too."""

    def __init__(self, grader: Grader, *, replays: bool) -> None:
        self._grader, self._replays = grader, replays

    def __call__(self, submission: Submission) -> bytes:
        """Grade in the current folder, which is empty; return JSON for `graded_from`."""
        grading, runs = self._grader.runs(submission)
        replay = replay_of(self._grader.exercise, grading, runs) if self._replays else None
        return json.dumps(object_of(Graded(grading, replay))).encode()


def object_of(one: Graded) -> dict[str, object]:
    """Return an object of JSON for `graded_from`."""
    replay = None if one.replay is None else structs.asdict(one.replay)
    return {"grading": grading_object(one.grading), "replay": replay}


def graded_from(data: bytes | str) -> Graded:
    """Return what `GradingWork` has made, from its JSON."""
    found = json.loads(data)
    replay = found["replay"]
    shown = None if replay is None else Replay(**{**replay, "curves": tuple(replay["curves"])})
    return Graded(grading_from(found["grading"]), shown)


def grade_many(
    grader: Grader, submissions: Sequence[Submission], jobs: int, *, replays: bool = False, fence: Fence = FENCE
) -> Generator[Graded, None, None]:
    """Grade submissions, so many at a time; yields as they end, in any order. When it is closed all processes end."""
    yield from (Graded(lost_grading(one, one.unread)) for one in submissions if one.unread)
    readable = [one for one in submissions if not one.unread]
    for worked in work_apart(GradingWork(grader, replays=replays), readable, jobs, fence):
        if worked.lost:
            yield Graded(lost_grading(readable[worked.number], worked.lost))
        else:
            yield graded_from(worked.result)
