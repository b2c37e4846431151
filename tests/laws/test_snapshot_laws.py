"""A snapshot and the deltas after it are the timeline to the bit, whatever is commanded, undone, tried or merged."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from math import inf, radians

from hypothesis import given
from hypothesis import strategies as st

from tests.engine.mirror import windowed
from tests.examples import examples
from tests.laws.test_motion_laws import ABOVE_THE_TABLE, MODEL, any_request
from vrs_cli.engine.branches import Branches
from vrs_cli.engine.engine import Engine, TimelineChange
from vrs_cli.engine.feed import MissedEvents, Snapshot, Subscription, TimelineReplaced, fit_delta
from vrs_cli.engine.position import position_at
from vrs_cli.errors import MotionError, UsageError
from vrs_cli.interfaces.streams import Steering
from vrs_cli.trajectory.timeline import Timeline

READY = MODEL.poses["ready"]


@dataclass
class Mirror:
    """Somebody who was given a snapshot, all of it or a window, and is told of what comes; `lost`: from before it."""

    events: Subscription[TimelineChange]
    snapshot: Snapshot
    timeline: Timeline
    lost: bool = False

    @classmethod
    def of(cls, engine: Engine, begin: float = -inf, end: float = inf) -> Mirror:
        events = engine.events.subscribe()
        first = events.take()
        assert isinstance(first, TimelineReplaced)
        snapshot = (
            Snapshot.of(first.timeline, first.settings)
            if begin == -inf
            else windowed(Snapshot.of(first.timeline, first.settings), begin, end)
        )
        return cls(events, snapshot, snapshot.timeline())

    def catch_up(self) -> None:
        for event in self.events.take_all():
            self.hear(event)

    def hear(self, event: TimelineChange | MissedEvents) -> None:
        assert not isinstance(event, MissedEvents)
        if isinstance(event, TimelineReplaced):
            self.snapshot, self.timeline, self.lost = Snapshot.of(event.timeline, event.settings), event.timeline, False
        elif not self.lost:
            delta = fit_delta(event, self.timeline, self.snapshot.first)
            self.lost = delta is None
            self.timeline = self.timeline if delta is None else self.timeline.apply(delta)


def bits(timeline: Timeline) -> str:
    return repr((timeline.version, list(timeline)))


def steers(branches: Branches) -> None:
    """Some targets of a stream, the last of them now and then the end of it."""
    engine = branches.engine
    steering, begin = Steering(engine), engine.now
    for k in range(4):
        steering.to((radians(5.0 * k), *READY[1:]), begin + 0.02 * k)


acts = st.lists(
    st.tuples(any_request, st.booleans())
    | st.sampled_from(
        [
            lambda branches: branches.engine.undo(),
            lambda branches: branches.engine.undo(2),
            lambda branches: branches.engine.redo(),
            lambda branches: branches.engine.stop(),
            lambda branches: (branches.change_over if "trial" in branches else branches.make)("trial"),
            lambda branches: branches.change_over("main"),
            lambda branches: branches.merge("trial"),
            steers,
        ]
    ),
    min_size=4,
    max_size=14,
)


def do(branches: Branches, act: object) -> None:
    with suppress(MotionError, UsageError):
        if isinstance(act, tuple):
            branches.engine.perform(act[0], program=act[1])
        else:
            act(branches)  # type: ignore[operator]


@examples(150)
@given(acts)
def test_a_snapshot_at_any_version_and_what_comes_after_it_are_the_timeline(sequence: list[object]) -> None:
    engine = Engine(MODEL)
    branches, mirrors = Branches(engine), list[Mirror]()
    do(branches, (ABOVE_THE_TABLE, True))
    for act in sequence:
        mirrors.append(Mirror.of(engine))
        do(branches, act)
    for mirror in mirrors:
        mirror.catch_up()
        assert bits(mirror.timeline) == bits(engine.timeline)


@examples(150)
@given(acts, st.floats(0.0, 8.0), st.floats(0.0, 3.0) | st.just(inf), st.integers(0, 6))
def test_in_a_window_of_it_the_robot_is_where_it_is(
    sequence: list[object], begin: float, lasting: float, joins: int
) -> None:
    """Inside the window; what comes behind it is not known there."""
    engine = Engine(MODEL)
    branches, mirror = Branches(engine), Mirror.of(engine)
    do(branches, (ABOVE_THE_TABLE, True))
    for number, act in enumerate(sequence):
        if number == joins:
            mirror = Mirror.of(engine, begin, begin + lasting)
        do(branches, act)
        mirror.catch_up()
        if number >= joins and not mirror.lost and mirror.snapshot.first:
            theirs = mirror.timeline
            assert theirs.version == engine.timeline.version
            for k in range(8):
                t = theirs.start + (theirs.end - theirs.start) * k / 8.0
                assert repr(position_at(engine.arm, theirs, t)) == repr(engine.position(t))


def test_the_settings_in_force_come_with_it() -> None:
    engine = Engine(MODEL)
    before = Snapshot.of(engine.timeline, engine.settings)
    branches = Branches(engine)
    branches.make("trial")
    events = engine.events.subscribe()
    branches.change_over("main")
    assert [
        Snapshot.of(event.timeline, event.settings)
        for event in events.take_all()
        if isinstance(event, TimelineReplaced)
    ][1:] == [before]
