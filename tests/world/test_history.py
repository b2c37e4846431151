"""The state of a world: values are taken back to any time."""

from __future__ import annotations

from vrs_cli.world.history import WorldHistory


def test_what_happened_at_a_time_and_later_is_taken_back() -> None:
    history = WorldHistory()
    for t in (0.0, 1.0, 2.0):
        history.now = t
        history.set("x", t)
        history.plan(t + 5.0, "land", f"part {t}")
        history.notes.append((t, "FALL", "it falls"))
    copied = history.copy()
    history.back_to(1.0)
    assert (history.get("x"), history.now, len(history.notes)) == (0.0, 1.0, 1)
    assert [due.time for due in history.due] == [5.0]
    assert (copied.get("x"), len(copied.due), len(copied.notes)) == (2.0, 3, 3)
    history.back_to(0.0)
    assert history.get("x") is None
    assert history.due == ()


def test_what_is_due_is_taken_in_order_and_dropped_by_name() -> None:
    history = WorldHistory()
    history.now = 0.0
    history.plan(2.0, "cross", "a")
    history.plan(1.0, "cross", "b", carried=True)
    history.plan(1.0, "land", "a")
    assert [(due.time, due.what) for due in history.due] == [(1.0, "cross"), (1.0, "land"), (2.0, "cross")]
    history.drop(what="cross", body="a")
    history.drop(carried=True)
    assert history.take().what == "land"
    assert history.due == ()
