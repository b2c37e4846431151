"""Contacts of motions that an edit does not plan anew: behind an inserted command, after REDO and MERGE."""

from __future__ import annotations

from random import Random

import pytest

pytest.importorskip("mujoco")

from tests.contacts.edits import missed
from tests.contacts.test_watch import INTO, session_of
from vrs_cli.errors import CollisionAhead
from vrs_cli.interfaces.session.session import Session

POSTED = """
[[fixture]]
name = "table"
shape = "box"
size = [800, 600, 20]
at = [100, 600, -210]

[[fixture]]
name = "post"
shape = "box"
size = [40, 40, 180]
at = [100, 500, -110]

[[part]]
name = "tall"
shape = "box"
size = [40, 40, 80]
at = [-100, 500, -160]
"""
PASS_BY = """.PROGRAM pass.by
TOOL TRANS(0, 0, 95, 90, -90, 0)
SET take = TRANS(-100, 500, -140, 90, 90, 0)
OPENI
MOVE TRANS(-100, 500, -80, 90, 90, 0)
MOVES take
DELAY 1
DEPARTS 200
MOVES TRANS(300, 500, 20, 90, 90, 0)
.END
"""
"""The hand passes above the post, to which the part in it would reach down."""


def passed_by() -> tuple[Session, float]:
    """Return a session in which the hand stood at the part without taking it, and a time at which it stood."""
    session = session_of(POSTED)
    session.load_text(PASS_BY)
    assert session.execute("pass.by").fault is None
    assert not session.contacts.contacts
    stands = next(one for one in session.engine.timeline if one.motion.text == "DELAY 1")
    return session, stands.start


def test_a_part_in_the_hand_touches_on_motions_that_are_as_they_were() -> None:
    session, stands = passed_by()
    before = session.engine.timeline
    session.perform(f"CLOSEI AT {stands:.3f}")
    ((text, contact),) = session.contacts.contacts
    assert text == f"CLOSEI AT {stands:.3f}"
    assert {contact.first, contact.second} == {"tall", "post"}
    on = before.locate(contact.t)[0].motion.text
    assert on == "MOVES TRANS(300, 500, 20, 90, 90, 0)"


def test_what_would_touch_later_is_refused() -> None:
    session, stands = passed_by()
    session.perform("ENABLE COLLISION")
    before = session.engine.timeline
    with pytest.raises(CollisionAhead, match=r"CLOSEI AT .*: tall touches post at .*\(on MOVES TRANS\(300"):
        session.perform(f"CLOSEI AT {stands:.3f}")
    assert session.engine.timeline is before
    session.perform(f"SIGNAL 1 AT {stands:.3f}")
    session.perform(f"MOVE TRANS(-100, 500, -130, 90, 90, 0) AT {stands:.3f}")


def test_motions_that_are_shifted_alone_are_not_looked_at_again() -> None:
    session, stands = passed_by()
    session.perform(f"CLOSEI AT {stands:.3f}")
    assert len(session.contacts.contacts) == 1
    session.perform("DRIVE 1, 5 AT 0")
    session.perform("SIGNAL 1 AT 0.1")
    assert len(session.contacts.contacts) == 1


def test_what_random_edits_let_touch_is_told() -> None:
    assert missed(Random(5)) == []


def test_redo_is_refused_as_a_motion_is() -> None:
    session = session_of()
    session.perform(f"DO {INTO}")
    session.perform("UNDO")
    session.perform("ENABLE COLLISION")
    with pytest.raises(CollisionAhead, match=f"{INTO}: .* touches wall"):
        session.perform("REDO")
    assert session.engine.end == 0.0
    session.perform("DISABLE COLLISION")
    session.perform("REDO")
    assert session.engine.end > 0.0
    assert [text for text, _ in session.contacts.contacts] == [INTO, INTO]


@pytest.mark.parametrize("main_has_changed", [False, True])
def test_merge_is_refused_where_collision_is_enabled_on_main(main_has_changed: bool) -> None:
    session = session_of()
    session.perform("ENABLE COLLISION")
    session.perform("BRANCH trial")
    session.perform("DISABLE COLLISION")
    session.perform(f"DO {INTO}")
    if main_has_changed:
        session.perform("BRANCH main")
        session.perform("DO DRIVE 4, 10")
    main = session.branches.book("main").timeline
    with pytest.raises(CollisionAhead, match="touches wall"):
        session.perform("MERGE trial")
    assert session.branches.book("main").timeline is main
    session.perform("BRANCH main")
    session.perform("DISABLE COLLISION")
    session.perform("MERGE trial")
    assert session.branches.book("main").timeline is not main
    assert [text for text, _ in session.contacts.contacts] == [INTO, INTO]


def test_a_branch_that_has_undone_a_command_of_main_is_checked() -> None:
    session = session_of()
    session.perform("DO DRIVE 1, 90, 100")
    session.perform("BRANCH trial")
    session.perform("UNDO")
    session.perform(f"DO {INTO}")
    session.perform("BRANCH main")
    session.perform("ENABLE COLLISION")
    with pytest.raises(CollisionAhead, match="touches wall"):
        session.perform("MERGE trial")


def test_undo_is_never_refused() -> None:
    session = session_of()
    session.perform(f"DO {INTO}")
    touching = session.engine.timeline
    session.perform("DO DRIVE 2, -60, 100")
    session.perform("ENABLE COLLISION")
    session.perform("UNDO")
    assert session.engine.timeline == touching
