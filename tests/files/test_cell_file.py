"""The file of a cell, and what it does to programs."""

from __future__ import annotations

import pytest

from tests.interfaces.terminals import RecordingTerminal
from tests.render.test_layout import drawn
from vrs_cli.dialogue.replies import SignalTable
from vrs_cli.errors import FileDamaged, NonexistentFile
from vrs_cli.files.cell_file import parse_cell, read_cell
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.tasks.limits import Limits

CELL = """
[signals]
feeder.go = 3
"part.there" = 1003
camera.trigger = 4
camera.ready = 1004

[[follow]]
when = "feeder.go"
set = "part.there"
after = 0.8

[[follow]]
when = "-feeder.go"
set = -1003

[[follow]]
when = "camera.trigger"
set = "camera.ready"
after = 0.25
lasting = 0.5
variables = ["found.x", "$kind"]
rows = [[400, "nut"], [420.5, "bolt"]]
{more}
"""
PROGRAM = """
.PROGRAM main()
    FOR i = 1 TO 3
        SIGNAL 3
        WAIT SIG(1003)
        TYPE "part ", /F4.2, TIME
        SIGNAL 4
        WAIT SIG(1004)
        TYPE $kind, /F7.1, found.x, /F6.2, TIME
        SIGNAL -4, -3
        WAIT SIG(-1003, -1004)
        TYPE "empty ", /F4.2, TIME
    END
.END
"""


def session(more: str = "") -> Session:
    made = Session(RecordingTerminal(), limits=Limits(max_time=20.0))
    made.driver.surround(parse_cell(CELL.replace("{more}", more)))
    made.load_text(PROGRAM)
    return made


def test_inputs_follow_outputs_after_a_time() -> None:
    result = session("again = true").execute("main")
    assert result.fault is None
    assert result.typed == (
        "part 0.80",
        "nut  400.0  1.05",
        "empty 1.55",
        "part 2.35",
        "bolt  420.5  2.60",
        "empty 3.10",
        "part 3.90",
        "nut  400.0  4.15",
        "empty 4.65",
    )


def test_the_same_cell_gives_the_same_timeline() -> None:
    first, second = (session("again = true").execute("main").typed for _ in range(2))
    assert first == second


def test_after_the_last_row_nothing_follows() -> None:
    fault = session().execute("main").fault
    assert fault is not None
    assert "waits for SIG(1004) (1004 is camera.ready)" in fault.message


def test_signals_are_shown_by_their_names() -> None:
    made = session()
    made.perform("SIGNAL 3")
    made.perform("IO 1")
    assert isinstance(made.terminal, RecordingTerminal)
    (table,) = (one for one in made.terminal.replies if isinstance(one, SignalTable))
    assert table.banks[0].names == {3: "feeder.go", 4: "camera.trigger"}
    shown = drawn(table, 80)
    assert "3  feeder.go       on" in shown
    assert "4  camera.trigger  off" in shown
    made.perform("WATCH SIG(1003)")
    assert made.debugging.watches[0].text == "SIG(1003) (1003 is part.there)"


def test_at_the_prompt_time_brings_what_follows() -> None:
    made = session()
    made.perform("SIGNAL 3")
    assert not made.environment.signals.read(1003)
    made.perform("DELAY 1")
    assert made.environment.signals.read(1003)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("[signals", "a table declaration"),
        ("[signls]\na = 1", "signls: did you mean signals?"),
        ("[signals]\nb = 7000", "b: 7000 is no signal"),
        ("[signals]\nb = true", "b: True is no signal"),
        (
            '[signals]\npart = 1001\n[[follow]]\nwhen = "prat"\nset = 1002',
            "no signal is called prat (did you mean part?)",
        ),
        ("[[follow]]\nset = 1001", "when: it is missing"),
        ("[[follow]]\nwhen = 1\nset = 3", "an output is the program's"),
        ("[[follow]]\nwhen = 1", "nothing follows"),
        ("[[follow]]\nwhen = 1\nset = 1001\nafter = -1", "after: -1 is no time"),
        ("[[follow]]\nwhen = 1\nset = 1001\nafter = true", "after: True is no time"),
        ("[[follow]]\nwhen = 1\nset = 1001\nafterr = 1", "afterr: did you mean after?"),
        ('[[follow]]\nwhen = 1\nvariables = ["x"]', "variables and rows belong together"),
        ('[[follow]]\nwhen = 1\nvariables = ["x"]\nrows = [[1, 2]]', "row 1: a value for each of x is wanted"),
        ('[[follow]]\nwhen = 1\nvariables = ["$s"]\nrows = [[1]]', "row 1"),
        ('[[follow]]\nwhen = 1\nvariables = "x"\nrows = [[1]]', "variables: a list of names"),
        ("follow = 3", "write [signals] and [[follow]]"),
    ],
)
def test_a_cell_that_is_wrong_says_where(text: str, told: str) -> None:
    with pytest.raises(FileDamaged) as refused:
        parse_cell(text, "my.toml")
    assert told in refused.value.detail
    assert refused.value.detail.startswith("my.toml: ")


def test_a_cell_that_is_not_there() -> None:
    with pytest.raises(NonexistentFile):
        read_cell("/never/there.toml")
