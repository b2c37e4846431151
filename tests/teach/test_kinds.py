"""Test each kind of check with a program that passes, one within the rounding, and one that just fails."""

from __future__ import annotations

from typing import NamedTuple, get_args

import pytest

from tests.teach.runs import mark_of, run
from vrs_cli.files.cell_file import parse_cell
from vrs_cli.language.run.signals import NO_CELL
from vrs_cli.teach.checks import AnyCheck
from vrs_cli.teach.judging import state
from vrs_cli.teach.kinds import COMMON_KEYS, KINDS

READY = "MOVE TRANS(-200, 500, 0, 90, 90, 0)\nBREAK"
ACROSS = "{READY}\nMOVES TRANS(200, 500, 0, 90, 90, 0)"
TABLE = """
[[part]]
name = "box"
shape = "box"
size = [40, 40, 60]
at = [0, 550, -250]
[[fixture]]
name = "table"
shape = "box"
size = [900, 500, 20]
at = [50, 550, -290]
"""
DOWN = """TOOL TRANS(0, 0, 95, 90, -90, 0)
MOVE TRANS(300, 600, -150, 90, 90, 0)
MOVES TRANS(300, 600, {}, 90, 90, 0)"""
PICK = """TOOL TRANS(0, 0, 95, 90, -90, 0)
SET part = TRANS(0, 550, -250, 90, 90, 0)
OPENI
APPRO part, 80
MOVES part
CLOSEI
DEPARTS 80"""


class Example(NamedTuple):
    """A check, and steps in which a value for {} makes it pass, pass by the rounding, or fail for this reason."""

    check: str
    steps: str
    values: tuple[object, object, object]
    reason: str
    points: float = 0.0
    cell: str = ""
    model: str = ""


EXAMPLES = {
    "tool_at": Example(
        'kind = "tool_at"\nat = [200, 500, 0]\nmm = 2',
        "MOVE TRANS({}, 500, 0, 90, 90, 0)",
        (201, 202.14, 202.16),
        "the tool ended 2.2 mm from the place, 2.0 mm allowed; at [202.2, 500.0, 0.0]",
        0.5,
    ),
    "tool_at turned": Example(
        'kind = "tool_at"\nat = [200, 500, 0, 90, 90, 0]\nmm = 2\ndeg = 1',
        "MOVE TRANS(200, 500, 0, 90, 90, {})",
        (0.5, 1.14, 1.16),
        "the tool ended 0.0 mm from the place, 2.0 mm allowed, turned by 1.2 deg, 1.0 deg allowed; "
        "at [200.0, 500.0, 0.0]",
        0.5,
    ),
    "part_at": Example(
        'kind = "part_at"\npart = "box"\nat = [100, 550, -250]\nmm = 2',
        PICK + "\nMOVES TRANS({}, 550, -249.9, 90, 90, 0)\nOPENI\nDEPARTS 50",
        (101, 102.1, 111),
        "the box ended 11.0 mm from the place, 2.0 mm allowed; at [111.0, 550.0, -250.0]",
        cell=TABLE,
    ),
    "held": Example(
        'kind = "held"\npart = "box"',
        PICK + "\n{}",
        ("", "", "OPENI"),
        "the hand holds nothing at the end, the box is wanted",
        cell=TABLE,
    ),
    "places": Example(
        'kind = "places"\nplaces = [[-100, 500, 0], [100, 500, 0]]\nmm = 3',
        READY + "\nMOVES TRANS(0, 500, 0, 90, 90, 0)\nMOVES TRANS({}, 500, 0, 90, 90, 0)",
        (100, 96.9, 96.8),
        "the tool came no nearer to [100.0, 500.0, 0.0] after 1.49 s than 3.2 mm, 3.0 mm allowed; 1 of 2 places passed",
        0.5,
    ),
    "path": Example(
        'kind = "path"\nfrom = [-200, 500, 0]\nto = [200, 500, 0]\nmm = 2',
        READY + "\nMOVES TRANS(0, {}, 0, 90, 90, 0)\nBREAK\nMOVES TRANS(200, 500, 0, 90, 90, 0)",
        (501, 502.14, 502.16),
        "the tool was 2.2 mm from the line, 2.0 mm allowed, at 1.85 s at [0.0, 502.2, 0.0]",
        0.5,
    ),
    "path turned": Example(
        'kind = "path"\nfrom = [-200, 500, 0, 90, 90, 0]\nto = [200, 500, 0]\nmm = 2\ndeg = 3',
        READY + "\nMOVES TRANS(200, 500, 0, 90, 90, {})",
        (2, 3.1, 4),
        "the tool stayed within 2.0 mm of the line; at 2.20 s it was turned by 4.0 deg, 3.0 deg allowed",
        0.5,
    ),
    "arc": Example(
        'kind = "path"\nfrom = [-150, 500, 0]\nvia = [0, 650, 0]\nto = [150, 500, 0]\nmm = 2',
        """MOVE TRANS(-150, 500, 0, 90, 90, 0)
        FOR i = 1 TO 36
            r = 150
            IF i == 18 THEN
                r = 150+{}
            END
            MOVES TRANS(-r*COS(i*5), 500+r*SIN(i*5), 0, 90, 90, 0)
            BREAK
        END""",
        (0.5, 2.14, 2.16),
        "the tool was 2.2 mm from the arc, 2.0 mm allowed, at 4.36 s at [0.0, 652.2, 0.0]",
        0.5,
    ),
    "no_stop": Example(
        'kind = "no_stop"\nfrom = [-200, 500, 0]\nto = [200, 500, 0]\nmm = 2',
        READY + "\nMOVES TRANS(0, 500, 0, 90, 90, 0)\n{}\nMOVES TRANS(200, 500, 0, 90, 90, 0)",
        ("", "SIGNAL 1", "BREAK"),
        "the arm stopped on the way, at 1.85 s at [0.0, 500.0, 0.0]",
    ),
    "keep_out": Example(
        'kind = "keep_out"\nat = [0, 500, 0]\nsize = [20, 100, 200]',
        "MOVE TRANS(-200, {0}, 0, 90, 90, 0)\nBREAK\nMOVES TRANS(200, {0}, 0, 90, 90, 0)",
        (400, 450.14, 450.16),
        "the tool entered the box at 1.74 s, 0.2 mm deep at [0.0, 450.2, 0.0]",
    ),
    "contact": Example(
        'kind = "contact"',
        DOWN,
        (-260, -267.4, -267.6),
        "the hand touched the table at 2.10 s with the tool at [300.0, 600.0, -267.5], 0.6 mm deep",
        cell=TABLE,
    ),
    "clearance": Example(
        'kind = "clearance"\nmm = 20',
        DOWN,
        (-240, -247.14, -247.16),
        "the hand came too near to the table at",
        0.5,
        cell=TABLE,
    ),
    "speed": Example(
        'kind = "speed"\nmm_s = 250\naround = [0, 500, 0]\nradius = 50',
        READY + "\nSPEED {} MMPS\nMOVES TRANS(200, 500, 0, 90, 90, 0)",
        (200, 250.14, 250.16),
        "the speed of the tool was 250.2 mm/s within 50.0 mm of [0.0, 500.0, 0.0] at 1.82 s, 250.0 mm/s allowed",
        0.5,
    ),
    "speed between": Example(
        'kind = "speed"\nmm_s = 250\nfrom = [-200, 500, 0]\nto = [200, 500, 0]',
        READY + "\nSPEED {} MMPS\nMOVES TRANS(200, 500, 0, 90, 90, 0)",
        (200, 250.14, 250.16),
        "the speed of the tool was 250.2 mm/s between [-200.0, 500.0, 0.0] and [200.0, 500.0, 0.0] at",
        0.5,
    ),
    "acceleration": Example(
        'kind = "acceleration"\nmm_s2 = 1000\naround = [200, 500, 0]\nradius = 10',
        READY + "\nACCEL {}\nMOVES TRANS(200, 500, 0, 90, 90, 0)",
        (50, 59.996, 60.001),
        "the acceleration of the tool was 1000.2 mm/s2 within 10.0 mm of [200.0, 500.0, 0.0] at 2.31 s, 1000.0 mm/s2",
        0.5,
    ),
    "cycle_time": Example(
        'kind = "cycle_time"\nmost = 3',
        "MOVE TRANS(200, 500, 0, 90, 90, 0)\nDELAY {}\nBREAK",
        (1.0, 1.54, 1.56),
        "the run took 3.03 s, 3.00 s allowed",
        0.5,
    ),
    "cycle_time between": Example(
        'kind = "cycle_time"\nmost = 2\nfrom = [-200, 500, 0]\nto = [200, 500, 0]',
        READY + "\nDURATION {}\nMOVES TRANS(200, 500, 0, 90, 90, 0)",
        (1.5, 2.0, 2.3),
        "the way from [-200.0, 500.0, 0.0] to [200.0, 500.0, 0.0] took 2.",
    ),
    "signals": Example(
        'kind = "signals"\nchanges = [1, {signal = -1, before = 2}]',
        "SIGNAL 1 AT 0.5\nSIGNAL -1 AT {}",
        (1, 2.014, 2.016),
        "signal 1 went off at 2.02 s, it is wanted by 2.00 s (1 of 2 changes right)",
        0.5,
    ),
    "signal of another number": Example(
        'kind = "signals"\nchanges = [1]',
        "SIGNAL {}",
        (1, 1, 2),
        "signal 1 did not come on (0 of 1 change right)",
    ),
    "signal since an input": Example(
        'kind = "signals"\nchanges = [{signal = 2, since = 1010, before = 1.5}]',
        "SIGNAL 3 AT 0\nSIGNAL 2 AT {}",
        (1.5, 2.014, 2.016),
        "signal 2 came on at 2.02 s, it is wanted by 1.50 s after signal 1010 came on at 0.50 s (0 of 1 change right)",
        cell="[[follow]]\nwhen = 3\nset = 1010\nafter = 0.5\n",
    ),
    "signal at a place": Example(
        'kind = "signals"\nchanges = [{signal = 2, near = [-200, 500, 0], mm = 5}]',
        "MOVE TRANS({}, 500, 0, 90, 90, 0)\nBREAK\nSIGNAL 2",
        (-200, -194.9, -194.8),
        "signal 2 came on at 1.15 s with the tool at [-194.8, 500.0, 0.0], 5.2 mm from [-200.0, 500.0, 0.0], "
        "5.0 mm allowed (0 of 1 change right)",
    ),
    "typed": Example(
        'kind = "typed"\nlines = ["begun", {pattern = "part [0-9]+", before = 2}, "done"]',
        'TYPE "begun"\nTIMER 1 = 0\nWAIT TIMER(1) >= {}\nTYPE "part 12"\nTYPE "done"',
        (1, 1.98, 2.1),
        '"part 12" was typed at 2.13 s, it is wanted by 2.00 s',
        0.33,
    ),
    "typed like the model": Example(
        'kind = "typed"\nlines = "model"\nonly = true',
        'TYPE "part 1"\nTYPE "part {}"',
        (2, 2, 3),
        '"part 2" was not typed after the 1 line before it (1 of 2 wanted lines)',
        0.5,
        model='TYPE "part 1"\nTYPE "part 2"',
    ),
    "words": Example(
        'kind = "words"\nuse = ["FRAME", "FOR"]\navoid = ["GOTO", "ENABLE CP"]',
        "SET a = FRAME(TRANS(), TRANS(1), TRANS(0,1), TRANS())\nFOR i = 1 TO 2\nEND\n{}",
        ("", "; GOTO", "GOTO 10\n10 READY"),
        "the program uses GOTO, which it must not use",
        0.75,
    ),
    "dialect": Example(
        'kind = "dialect"\ndialect = "val2"',
        "MOVE TRANS(200, 500, 0, 90, 90, 0)\n{}",
        ("", "SIGNAL 1", "x = 2**3"),
        "line 3: ** is of V+",
    ),
    "like_model": Example(
        'kind = "like_model"\nmm = 2',
        READY + "\nSPEED 30\nMOVES TRANS(0, {}, 0, 90, 90, 0)\nBREAK\nMOVES TRANS(200, 500, 0, 90, 90, 0)",
        (501, 502.12, 502.2),
        "the tool was 2.2 mm from the model's path, 2.0 mm allowed, at",
        0.5,
        model=ACROSS.format(READY=READY),
    ),
    "like_model at the same times": Example(
        'kind = "like_model"\nmm = 2\ntimes = true\ndeg = 1',
        READY + "\nMOVES TRANS(200, {}, 0, 90, 90, 0)",
        (501, 502.14, 502.16),
        "at 2.25 s the tool was 2.2 mm from where the model's is, 2.0 mm allowed",
        0.5,
        model=ACROSS.format(READY=READY),
    ),
    "no_error": Example(
        'kind = "no_error"',
        "MOVE TRANS({}, 500, 0, 90, 90, 0)",
        (200, 300, 2000),
        "the program stopped in line 2, MOVE TRANS(2000, 500, 0, 90, 90, 0): *Location too far*",
    ),
}


@pytest.mark.parametrize("name", EXAMPLES)
def test_a_check_tells_right_from_nearly_right_and_from_wrong(name: str) -> None:
    example = EXAMPLES[name]
    cell = parse_cell(example.cell) if example.cell else NO_CELL
    parts = ("box",) if example.cell else ()
    model = run(example.model) if example.model else None
    passes, within, fails = (
        mark_of(example.check, run(example.steps.format(value), cell), model, parts) for value in example.values
    )
    assert (passes.points, passes.of) == (1.0, 1.0), passes
    assert (within.points, within.of) == (1.0, 1.0), within
    assert (fails.points, fails.of) == (example.points, 1.0), fails
    assert fails.reason.startswith(example.reason)


def test_each_kind_has_an_example_and_a_judge() -> None:
    of_state = {name for name, kind in KINDS.items() if kind.judge.__module__ == state.__name__}
    assert {name.split()[0] for name in EXAMPLES} | {"path"} == {*KINDS, "arc", "signal"} - of_state
    assert {kind.check for kind in KINDS.values()} == set(get_args(AnyCheck))
    for name, kind in KINDS.items():
        fields = {key.field or key.name for key in (*COMMON_KEYS, *kind.keys)}
        assert fields == set(kind.check.__struct_fields__), name


def test_pairs_that_may_touch_do_not_count() -> None:
    ran = run(DOWN.format(-270), parse_cell(TABLE))
    assert not mark_of('kind = "contact"', ran).passed
    assert mark_of('kind = "contact"\nallow = [["link 6", "box"], ["box", "hand"]]', ran, parts=("box",)).points == 0.0
    assert mark_of('kind = "contact"\nallow = [["table", "hand"]]', ran, parts=("box", "table")).passed


def test_a_contact_of_a_motion_that_was_cut_short_does_not_count() -> None:
    """A motion is checked to its end when it is commanded."""
    steps = DOWN.format(-290) + "\nMOVES TRANS(300, 600, -150, 90, 90, 0) AT 1.75"
    ran = run(steps, parse_cell(TABLE))
    assert ran.contacts
    assert mark_of('kind = "contact"', ran).passed


def test_another_output_does_not_count_for_the_one_that_is_wanted() -> None:
    failed = mark_of('kind = "signals"\nchanges = [1]', run("SIGNAL 3 AT 0.5"))
    assert (failed.points, failed.reason) == (0.0, "signal 1 did not come on (0 of 1 change right)")


def test_a_check_earns_nothing_while_another_that_it_needs_earns_nothing() -> None:
    there = '[[check]]\nkind = "tool_at"\nname = "there"\nat = [0, 500, 0]\nmm = 1'
    text = f'kind = "speed"\nmm_s = 3000\nneeds = ["there"]\n{there}'
    assert mark_of(text, run("MOVE TRANS(0, 500, 0, 90, 90, 0)")).passed
    failed = mark_of(text, run("READY"))
    assert failed.points == 0.0
    assert failed.reason.startswith("it does not count while 'there' earns nothing (the speed of the tool stayed")


def test_without_partial_marks_it_is_all_or_nothing() -> None:
    ran = run("MOVE TRANS(203, 500, 0, 90, 90, 0)")
    check = 'kind = "tool_at"\nat = [200, 500, 0]\nmm = 2\npoints = 3'
    assert [mark_of(f"{check}\npartial = {word}", ran).points for word in ("true", "false")] == [1.5, 0.0]


def test_a_failed_check_shows_its_hint() -> None:
    check = 'kind = "no_error"\nname = "it runs"\nhint = "read the message"'
    passed, failed = (mark_of(check, run(steps)) for steps in ("READY", "MOVE TRANS(9999)"))
    assert (passed.hint, failed.hint) == ("", "read the message")


def test_another_signal_is_not_the_one_that_is_wanted() -> None:
    check = 'kind = "signals"\nchanges = [2, -2]'
    assert mark_of(check, run("SIGNAL 1\nSIGNAL 2\nDRIVE 1, 9\nBREAK\nSIGNAL -2")).passed
    missing = mark_of(check, run("SIGNAL 2\nDRIVE 1, 9\nBREAK\nSIGNAL 3"))
    assert (missing.points, missing.reason) == (0.5, "signal 2 did not go off after that (1 of 2 changes right)")
    only = mark_of(f"{check}\nonly = true", run("SIGNAL 2\nDRIVE 1, 9\nBREAK\nSIGNAL -2\nDRIVE 1, 9\nBREAK\nSIGNAL 2"))
    assert (only.points, only.passed) == (0.5, False)


def test_the_words_of_a_program_count_where_the_run_stops_in_another_one() -> None:
    ran = run("SIGNAL 1\nCALL other\n.END\n.PROGRAM other\nMOVE TRANS(9999)\n.END\n.PROGRAM idle\nREADY")
    assert ran.fault is not None
    assert ran.fault.program == "other"
    assert mark_of('kind = "words"\nuse = ["SIGNAL", "MOVE"]\navoid = ["READY"]', ran).passed


def test_runs_that_take_no_time_are_compared_with_the_model() -> None:
    still = run("SIGNAL 1")
    assert mark_of('kind = "like_model"\nmm = 2\ntimes = true\ndeg = 1', still, still).passed
