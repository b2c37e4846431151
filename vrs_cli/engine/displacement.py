"""Which scheduled motions a change has moved or dropped: the answer to a command says so."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import islice, pairwise

from vrs_cli.engine.book import Book
from vrs_cli.trajectory.timeline import Cause, Timeline
from vrs_cli.values.motion import Motion, Start
from vrs_cli.values.results import CommandRecord, Displacement, Moved

MOST = 100  # motions that are looked at: what it costs does not depend on how much is scheduled
SAME_TIME = 5e-4  # [s] two times that are shown alike


def displacement(book: Book, before: Timeline) -> Displacement | None:
    """How the motions that were scheduled on the timeline `before`, or with a time stamp since then, have been moved;
    None where none has been. Motions that UNDO took back are not counted as dropped.
    """
    changes = book.deltas[len(book.deltas) - (book.timeline.version - before.version) :]
    if not any(delta.drop or delta.shift for delta in changes):
        return None
    since = min(delta.cut for delta in changes)
    taken_back = {delta.motion.number for delta in changes if delta.cause is Cause.UNDO}
    old = list(islice(_begins(before, since), MOST + 1))
    stamped = [
        (one.motion, one.executed)
        for one in changes[-MOST:-1]
        if one.motion.start is Start.AT and abs(one.executed - one.issued) > SAME_TIME
    ]
    new = {motion.number: begin for motion, begin in islice(_begins(book.timeline, since), 2 * MOST)}
    gone = len(new) < 2 * MOST  # what is not among these is nowhere
    rows = [
        (motion, begin, new.get(motion.number))
        for motion, begin in (*old[:MOST], *stamped)
        if motion.number not in taken_back and (gone or motion.number in new)
    ]
    if all(then is not None and abs(then - begin) <= SAME_TIME for _, begin, then in rows):
        return None
    deltas = (step.delta for step in book.history.done)
    asked = {delta.motion.number: delta.executed for delta in deltas if delta.motion.start is Start.AT}
    moved = [Moved(motion.text, asked.get(motion.number), begin, then) for motion, begin, then in rows]
    return _sorted_out(moved, more=len(old) > MOST)


def _sorted_out(moved: Sequence[Moved], *, more: bool = False) -> Displacement:
    return Displacement(
        tuple(one for one in moved if one.later > SAME_TIME),
        tuple(one for one in moved if one.later < -SAME_TIME),
        tuple(one for one in moved if one.after is None),
        more,
    )


def displacement_of(commands: Iterable[CommandRecord]) -> Displacement | None:
    """How motions have been moved from the times that were asked for them; None where none has."""
    timed = ((one, one.asked) for one in commands if one.asked is not None)
    moved = [
        Moved(one.text, asked, asked, None if one.end is None else one.executed)
        for one, asked in timed
        if one.end is None or one.displaced
    ]
    return _sorted_out(sorted(moved, key=lambda one: one.before)) if moved else None


def _begins(timeline: Timeline, since: float) -> Iterator[tuple[Motion, float]]:
    """The motions that begin at `since` or later, and when."""
    index = timeline.index_at(since)
    while index and timeline[index].start >= since:
        index -= 1
    following = (timeline[place] for place in range(index, len(timeline)))
    for before, segment in pairwise(following):
        if segment.motion.number != before.motion.number:
            yield segment.motion, segment.start
