"""The part of f that is about dated events: what becomes of them when a motion is cut into the timeline.

Events up to the cut stay. An event that is tied keeps its distance to the start of its motion, or to the end of the
interrupted one. An event with a time of its own keeps that time, but comes no later than the tail begins. The tail
shifts whole, with its events. Inputs from outside never shift. If nothing is inserted (INSERT OFF, BRAKE, JOG,
steering), all events after the cut are dropped.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

from vrs_cli.trajectory.segment import Segment
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import FIRST_INPUT, Event, EventEdit

Anchors = list[tuple[float, float]]  # instants [s] of the old and of the new timeline that belong together, in order


def edit_of(
    old: Timeline, keep: int, tail: int, new: Sequence[Segment], shift: float, *, inserts: bool, own: Event | None
) -> EventEdit | None:
    """The events' part of a delta that keeps `keep` segments, puts `new` after them, and shifts those from index `tail`
    on by `shift` [s]; None if no event changes. `own`: an event that comes with the new motion, when that begins.
    """
    cut, count = new[0].start, old.event_count
    kept, coming = old.events_by(cut), () if own is None else (own._replace(time=cut),)
    if kept == count:
        return EventEdit(kept, events=coming) if coming else None
    if not inserts:
        return EventEdit(kept, count - kept, 0.0, coming)
    begins, after = inf, count
    if tail < len(old):
        begins = old[tail].start
        after = max(old.events_by(begins, before=True), kept)
    anchors = _anchors(old, keep, tail, new, shift)
    gone = [*old.event_slice(kept, after)]
    moved = [_moved(event, anchors, begins + shift) for event in gone]
    latest = max((event.time for event in moved), default=-inf)
    for event in old.event_slice(after, _after_inputs(old, after, shift)):
        gone.append(event)
        moved.append(event if _is_outside(event) else event.shifted(shift))
        latest = max(latest, moved[-1].time)
    after = kept + len(gone)
    for event in old.event_slice(after, old.events_by(latest - shift, before=True)):
        gone.append(event)  # an input from outside comes after it now
        moved.append(event.shifted(shift))
    after = kept + len(gone)
    moved.sort(key=lambda event: event.time)  # stable: in one instant, the order in which they were given
    if after == count:
        shift = 0.0
    if not coming and not shift and moved == gone:
        return None
    return EventEdit(kept, len(gone), shift, (*coming, *moved))


def _is_outside(event: Event) -> bool:
    """Return whether an event is an input from outside, which stands at its time whatever the robot does."""
    return event.channel >= FIRST_INPUT and not event.tied


def _after_inputs(old: Timeline, first: int, shift: float) -> int:
    """Return the index after the last input from outside that comes from index `first` on, if they would shift."""
    if shift and any(channel >= FIRST_INPUT for channel in old.channels):
        for index in range(old.event_count - 1, first - 1, -1):
            if _is_outside(old.event(index)):
                return index + 1
    return first


def _anchors(old: Timeline, keep: int, tail: int, new: Sequence[Segment], shift: float) -> Anchors:
    """Return when motions planned again begin, when the last of what is not planned again ends, and the tail."""
    starts: dict[int, float] = {}
    for segment in new:
        starts.setdefault(segment.motion.number, segment.start)
    anchors: Anchors = []
    number = old[keep - 1].motion.number
    for index in range(keep, tail):
        segment = old[index]
        if segment.motion.number != number:
            number = segment.motion.number
            anchors.append((segment.start, starts.get(number, segment.start)))
    end = old[max(tail, keep) - 1].finish
    begins = old[tail].start if tail < len(old) else inf
    if end > new[0].start and end < begins:  # something is interrupted, or planned again
        anchors.append((end, new[-1].finish))
    anchors.append((begins, begins + shift))
    return anchors


def _moved(event: Event, anchors: Anchors, latest: float) -> Event:
    """Return the event at its new time; `latest`: when the tail begins [s]."""
    if _is_outside(event):
        return event
    if not event.tied:
        return event._replace(time=min(event.time, latest))
    shift, until = 0.0, inf
    for before, after in anchors:
        if before > event.time:
            until = after
            break
        shift = after - before
    return event._replace(time=min(event.time + shift, until))
