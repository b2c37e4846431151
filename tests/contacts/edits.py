"""Random edits of a program that picks a part up: where a motion comes to touch something, that is told.

`python -m tests.contacts.edits SESSIONS SEED`: in each session a part is taken, carried past a post and put down; then
the hand is opened and closed, and joints are driven, at random times. All motions are searched before and after each
edit. Status 1 where a motion touches something that touched nothing before, and nothing was told.
"""

from __future__ import annotations

from random import Random

from tests.by_hand import command
from tests.contacts.test_sweep import CELL, PICK
from tests.contacts.test_watch import session_of
from vrs_cli.errors import VrsError
from vrs_cli.interfaces.session.session import Session
from vrs_cli.trajectory.timeline import Timeline

EDITS = 6  # in a session
POST = """
[[fixture]]
name = "post"
shape = "box"
size = [40, 40, 150]
at = [{x}, {y}, -125]
"""
Touches = dict[int, frozenset[str]]  # what touches first on each motion, by its number


def first_touches(session: Session, timeline: Timeline) -> Touches:
    """Search all motions, one by one."""
    watch, found, ends = session.contacts, Touches(), dict[int, tuple[float, float]]()
    for segment in timeline:
        begun = ends.get(segment.motion.number, (segment.start,))[0]
        ends[segment.motion.number] = begun, segment.finish
    for number, (begin, end) in ends.items():
        contact = watch.first_contact(timeline, begin, end, session.engine.settings)
        if contact is not None:
            found[number] = frozenset((contact.first, contact.second))
    return found


def random_edit(rng: Random, end: float) -> str:
    t, joint, degrees = rng.uniform(0.0, end), rng.randint(1, 6), rng.uniform(-8.0, 8.0)
    return rng.choice((f"CLOSEI AT {t:.3f}", f"OPENI AT {t:.3f}", f"DO DRIVE {joint}, {degrees:.1f} AT {t:.3f}"))


def missed(rng: Random) -> list[str]:
    """Return the edits of a session after which something touches, and nothing was told."""
    session = session_of(CELL + POST.format(x=rng.uniform(-60.0, 100.0), y=rng.uniform(480.0, 520.0)))
    session.load_text(PICK.format(take=-180.0, put=-179.0, x=150.0, y=500.0, open="OPENI"))
    session.execute("pick")
    found = list[str]()
    for _ in range(EDITS):
        before, told = first_touches(session, session.engine.timeline), len(session.contacts.contacts)
        line = random_edit(rng, session.engine.end)
        try:
            session.perform(line)
        except VrsError:  # a line that the arm cannot follow any more
            continue
        after = first_touches(session, session.engine.timeline)
        new = {number: pair for number, pair in after.items() if number not in before}  # motions are told once
        if new and len(session.contacts.contacts) == told:
            found.append(f"{line}: {new}")
    return found


def main(sessions: int, seed: int) -> int:
    found = [f"session {k}: {line}" for k in range(sessions) for line in missed(Random(seed + k))]
    print(*found, f"{sessions} sessions of {EDITS} edits: {len(found)} missed", sep="\n")
    return int(bool(found))


if __name__ == "__main__":
    command(main)
