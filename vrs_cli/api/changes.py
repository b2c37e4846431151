"""The changes of a timeline, told to whoever asked to hear of them."""

from __future__ import annotations

from collections.abc import Callable
from threading import Thread

from msgspec import Struct

from vrs_cli.engine.engine import TimelineChange
from vrs_cli.engine.feed import MissedEvents, Subscription
from vrs_cli.trajectory.timeline import Timeline, TimelineDelta


class Change(Struct, frozen=True):
    """The timeline became `timeline`, of that `version`: by a `delta`, or (None) another has taken its place."""

    version: int
    timeline: Timeline
    delta: TimelineDelta | None = None

    def __repr__(self) -> str:
        what = "another timeline" if self.delta is None else self.delta.motion.text or "a motion"
        return f"<Change to version {self.version}: {what}, to {self.timeline.end:.3f} s>"


def hear(subscription: Subscription[TimelineChange], callback: Callable[[Change], object]) -> Callable[[], None]:
    """Call back for every event, in a thread of its own; what is returned ends that, once all before it is told.

    A callback that raises hears no more; the thread reports its error.
    """

    def listen() -> None:
        timeline: Timeline | None = None
        while (event := subscription.take()) is not None:  # also those that are there when it is ended
            if isinstance(event, MissedEvents):
                continue  # what makes up for them comes next
            if isinstance(event, TimelineDelta):
                assert timeline is not None
                timeline = timeline.apply(event)
                callback(Change(timeline.version, timeline, event))
            else:
                timeline = event.timeline
                callback(Change(timeline.version, timeline))

    thread = Thread(target=listen, name="vrs subscriber", daemon=True)
    thread.start()

    def end() -> None:
        subscription.end()
        thread.join()

    return end
