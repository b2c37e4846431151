"""The state of a world: values are taken back to any time."""

from __future__ import annotations

from vrs_cli.values.world import BodyCrosses, PartComes, PartsGo
from vrs_cli.world.history import WorldHistory


def test_what_happened_at_a_time_and_later_is_taken_back() -> None:
    history = WorldHistory()
    for t in (0.0, 1.0, 2.0):
        history.now = t
        history.set("x", t)
        history.plan(t + 5.0, PartComes(int(t)))
        history.add("notes", (t, "FALL", "it falls"))
    copied = history.copy()
    history.back_to(1.0)
    assert (history.get("x"), history.now, len(history.rows("notes"))) == (0.0, 1.0, 1)
    assert [due.time for due in history.due] == [5.0]
    assert (copied.get("x"), len(copied.due), len(copied.rows("notes"))) == (2.0, 3, 3)
    history.back_to(0.0)
    assert history.get("x") is None
    assert history.due == ()


def test_what_is_due_is_taken_in_order_and_can_be_dropped() -> None:
    history = WorldHistory()
    history.now = 0.0
    history.plan(2.0, PartsGo(1))
    history.plan(1.0, BodyCrosses("hand", 0, inside=True, moved=True))
    history.plan(1.0, PartComes(2))
    history.plan(1.0, PartComes(1))
    assert [due.what for due in history.due] == [
        PartComes(2),
        PartComes(1),
        BodyCrosses("hand", 0, True, True),
        PartsGo(1),
    ]
    history.drop(lambda what: what.follows_arm)
    history.drop(lambda what: isinstance(what, PartsGo))
    assert history.take().what == PartComes(2)
    assert [due.what for due in history.due] == [PartComes(1)]
