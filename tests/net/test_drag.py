"""A tool dragged from afar: the newest wish counts, all hear what holds it, and a line that is cut lets it go."""

from __future__ import annotations

from pathlib import Path

from tests.net.test_room import Wire, served
from vrs_cli.interfaces.targets import RELEASE_AFTER_S
from vrs_cli.kinematics.transform import Transform, at_position
from vrs_cli.net.messages import Drag, Pulled, Told
from vrs_cli.trajectory.timeline import TimelineDelta
from vrs_cli.values.dragging import Hold, Limit
from vrs_cli.wire.codec import Encoding, encode
from vrs_cli.wire.steered import steered_record


def drag(wire: Wire, pose: Transform | None) -> None:
    (message,) = wire.connection.receive(encode(Drag(pose), Encoding.MSGPACK), 0.0)
    wire.client.receive(message)


def at(wire: Wire, x: float, y: float, z: float) -> Transform:
    engine = wire.room.session.engine
    T = engine.position(engine.now).T_world_tool
    return at_position(T, T.px + x, T.py + y, T.pz + z)


def pulled(wire: Wire) -> Pulled:
    return wire.room._pulled


def test_the_newest_wish_counts_and_all_hear_of_it(tmp_path: Path) -> None:
    with served(tmp_path, realtime=20.0) as it:
        ann = it.call("ann")
        wish = at(ann, -0.2, 0.0, -0.3)
        for k in range(200):
            drag(ann, at_position(wish, wish.px, wish.py, wish.pz + 0.001 * (199 - k)))
        engine = it.room.session.engine
        ann.until(lambda: pulled(ann).state.by == "ann")

        def there() -> bool:
            T = engine.position(engine.now).T_world_tool
            return max(abs(a - b) for a, b in zip(T, wish, strict=True)) < 1e-5

        ann.until(there)
        assert len(engine.book.records()) == 1
        drag(ann, None)
        ann.until(lambda: pulled(ann).state.by == "")


def test_what_is_beyond_reach_is_told_and_a_cut_line_lets_go(tmp_path: Path) -> None:
    with served(tmp_path, realtime=20.0) as it:
        ann = it.call("ann")
        drag(ann, at(ann, 0.0, 3.0, 0.0))
        ann.until(lambda: Hold(Limit.REACH, which="far") in pulled(ann).state.held.holds)
        it.room.cut(ann.client, ann)
        it.now += RELEASE_AFTER_S + 0.1
        ann.until(lambda: pulled(ann).state.by == "")
        assert pulled(ann).state.why in ("the connection was lost", "nothing was heard any more")
        engine = it.room.session.engine
        ann.until(lambda: engine.end < it.room.clock().now)


def test_who_does_not_drive_is_told_so_once(tmp_path: Path) -> None:
    with served(tmp_path, realtime=20.0) as it:
        ann, bob = it.call("ann"), it.call("bob")
        assert ann.line("MOVE #PPOINT(0, -100, 90, 0, 20, 0)").ok
        for _ in range(5):
            drag(bob, at(bob, 0.0, 0.0, -0.1))
            bob.until(lambda: bob.client._pulling is None)
        assert sum(isinstance(one, Told) for one in bob.heard) == 1
        assert "ann drives" in " ".join(bob.said)
        assert pulled(ann).state.by == ""


def test_after_a_stop_wishes_are_ignored_until_the_tool_is_taken_anew(tmp_path: Path) -> None:
    with served(tmp_path, realtime=20.0) as it:
        ann = it.call("ann")
        drag(ann, at(ann, -0.1, 0.0, -0.1))
        ann.until(lambda: pulled(ann).state.by == "ann")
        assert ann.line("ABORT").ok
        said, version = len(ann.said), it.version
        for _ in range(3):
            drag(ann, at(ann, -0.1, 0.0, -0.1))
            ann.until(lambda: ann.client._pulling is None)
        assert (len(ann.said), it.version) == (said, version)
        drag(ann, None)
        drag(ann, at(ann, -0.1, 0.0, -0.1))
        ann.until(lambda: pulled(ann).state.by == "ann")


def test_a_wish_and_what_follows_from_it_are_small(tmp_path: Path) -> None:
    """Bytes: of a wish, and of a change of the timeline, in MessagePack."""
    with served(tmp_path, realtime=20.0) as it:
        ann = it.call("ann")
        wish = at(ann, -0.2, 0.0, -0.3)
        assert len(encode(Drag(wish), Encoding.MSGPACK)) <= 130
        engine = it.room.session.engine
        events = engine.events.subscribe(10_000)
        drag(ann, wish)
        ann.until(lambda: len(engine.timeline) > 60)
        drag(ann, None)
        ann.until(lambda: pulled(ann).state.by == "")
        changes = events.take_all()
    timeline, sizes = engine.book.initial, list[int]()
    for delta in changes:
        if isinstance(delta, TimelineDelta):
            record = steered_record(delta, timeline, engine.arm)
            sizes.append(9999 if record is None else len(encode(record, Encoding.MSGPACK)))
            timeline = timeline.apply(delta)
    assert len(sizes) > 20
    assert sorted(sizes)[len(sizes) // 2] <= 130, sizes
