"""Test the search for similar submissions: names do not matter, given text does not count."""

from __future__ import annotations

import random
import re
from time import process_time

from tests.teach.test_grading import COPIED
from vrs_cli.teach.reports.results import Likeness, similar

OTHER = """\
.PROGRAM stack()
    FOR i = 1 TO 4
        SET goal = SHIFT(corner BY 60*i, 0, 0)
        MOVE goal
        WAIT SIG(1001)
        SIGNAL 3, -4
        DELAY 0.5
        IF i == 2 THEN
            TYPE "half", /F5.1, 2.5*i
        END
    END
    DRIVE 1, 30, 50
    SPEED 40 ALWAYS
    TYPE "over"
.END
"""


def renamed(text: str) -> str:
    """Return the program with other names, comments and blanks."""
    names = {"pick": "work", "start": "p1", "goal": "p2", "gripper": "hand1"}
    changed = re.sub(r"\b(pick|start|goal|gripper)\b", lambda found: names[found[0]], text)
    return "\n".join(f"  {line.lower()}   ; mine" if line and line[0] != "." else line for line in changed.split("\n"))


def test_other_names_blanks_and_comments_make_no_difference() -> None:
    assert similar({"ann": COPIED, "bob": renamed(COPIED)}, (), 0.5) == (Likeness("ann", "bob", 1.0),)


def test_different_programs_are_not_alike() -> None:
    (found,) = similar({"ann": COPIED, "bob": OTHER}, (), 0.0)
    assert found.similarity < 0.1
    assert similar({"ann": COPIED, "bob": OTHER}, (), 0.1) == ()


def test_a_few_changed_lines_leave_most_alike() -> None:
    changed = COPIED.replace("APPRO start, 80", "APPRO start, 100").replace('TYPE "done"', 'TYPE "ready"')
    (found,) = similar({"bob": changed, "ann": COPIED}, (), 0.3)
    assert (found.first, found.second) == ("ann", "bob")
    assert 0.5 < found.similarity < 0.95


def test_what_was_given_does_not_count() -> None:
    assert similar({"ann": COPIED, "bob": renamed(COPIED)}, (COPIED,), 0.0) == ()


def test_the_most_alike_come_first() -> None:
    changed = COPIED.replace("OPENI", "OPEN").replace("80", "90")
    found = similar({"ann": COPIED, "bob": changed, "carl": COPIED}, (), 0.05)
    assert (found[0].first, found[0].second) == ("ann", "carl")
    assert [one.similarity for one in found] == sorted((one.similarity for one in found), reverse=True)


def test_no_share_no_pairs() -> None:
    assert similar({"ann": COPIED, "bob": COPIED}, (), None) == ()


def test_the_cost_is_bounded() -> None:
    R = random.Random(1)
    words = ["MOVE", "a", "b", "TYPE", '"x"', "1", "+", "(", ")", "WAIT", "\n"]
    texts = {f"s{k}": " ".join(R.choices(words, k=100_000)) for k in range(6)}
    began = process_time()
    similar(texts, (), 0.0)
    assert process_time() - began < 10.0
