"""Memory that a request keeps after it has ended."""

from __future__ import annotations

import gc
from types import FrameType

import pytest

from tests.interfaces.holders.holder import Holder
from vrs_cli.interfaces.dialogue import Dialogue, Notes, Ticket
from vrs_cli.interfaces.session.acts import act_on
from vrs_cli.interfaces.session.session import Session
from vrs_cli.values.acts import Define, Evaluate, Execute, Undo

REFUSED_LINES = (
    "MOVE nowhere",
    "TYPE (((1",
    "SPEED -5",
    "EXECUTE nothing",
    "LOAD nothing",
    "x = 1/0",
    "DRIVE 9, 1",
    "WHY",
)
REFUSED_ACTS = (Evaluate("+".join(["1"] * 500)), Undo(3), Execute("nothing"), Define(".PROGRAM a()\nx = = 1\n.END\n"))


def left_in_cycles(session: Session, dialogue: Dialogue[object]) -> list[object]:
    """The stack frames that only the collector of cycles can free, when a request of a served robot has ended."""
    gc.disable()
    gc.freeze()  # what is there already is not looked through: that takes seconds behind many other tests
    try:
        ended: list[str] = []

        def hear(ticket: Ticket[object], said: object) -> None:
            if said is None:
                ended.append(type(ticket.error(0.0)).__name__)

        Holder(session).submit(dialogue, outlet=hear)
        while not ended:
            session.actor.step()
        assert ended != ["NoneType"], "it is refused"
        gc.set_debug(gc.DEBUG_SAVEALL)
        gc.collect()
        return [one for one in gc.garbage if isinstance(one, FrameType)]
    finally:
        gc.set_debug(0)
        gc.garbage.clear()
        gc.enable()


@pytest.mark.parametrize("line", REFUSED_LINES)
def test_a_refused_line_leaves_nothing_in_cycles(line: str) -> None:
    session = Session(Notes())
    assert not left_in_cycles(session, session.answers(line))


@pytest.mark.parametrize("act", REFUSED_ACTS, ids=lambda act: type(act).__name__)
def test_a_refused_act_leaves_nothing_in_cycles(act: Define | Evaluate | Execute | Undo) -> None:
    session = Session(Notes())
    assert not left_in_cycles(session, act_on(session, act))
