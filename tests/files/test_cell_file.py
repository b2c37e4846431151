"""The file of a cell, and what it does to programs."""

from __future__ import annotations

import pytest

from tests.interfaces.terminals import RecordingTerminal
from tests.render.test_layout import drawn
from vrs_cli.errors import FileDamaged, NonexistentFile
from vrs_cli.files.cell_file import parse_cell, read_cell
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.tasks.limits import Limits
from vrs_cli.values.replies import SignalTable

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
    assert made.tasks.watches[0].text == "SIG(1003) (1003 is part.there)"


def test_what_the_cell_fills_has_a_value() -> None:
    made = Session(RecordingTerminal())
    assert [one.detail for one in made.load_text(PROGRAM)] == [
        "$kind is given a value nowhere",
        "found.x is given a value nowhere",
    ]
    made.driver.surround(parse_cell(CELL.replace("{more}", "")))
    assert made.load_text(PROGRAM) == ()
    assert "found.x" not in made.environment.kinds, "it has none before the camera has found something"


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
        (f"a = {'1' * 5000}", "a cell is a TOML file"),
        (f"a = {'[' * 5000}", "a cell is a TOML file"),
        ("[signls]\na = 1", ":1: signls: did you mean signals?"),
        ("[signals]\n\nb = 7000", ":3: b: 7000 is no signal"),
        ("[signals]\nb = true", ":2: b: True is no signal"),
        ("[signals]\na.ab = 3\na.b = 0", ":3: a.b: 0 is no signal"),
        ("[signals.part]\nthere = 1003\ngone = 1003", ":3: part.gone: signal 1003 is called part.there already"),
        (
            '[signals]\npart = 1001\n[[follow]]\nwhen = "prat"\nset = 1002',
            ":4: [[follow]] 1: when: no signal is called prat (did you mean part?)",
        ),
        (
            "[[follow]]\nwhen = 1\nset = 1001\n\n[[follow]]\nwhen = 7000\nset = 1002",
            ":6: [[follow]] 2: when: 7000 is no signal",
        ),
        ("follow = [{when = 1, set = 7000}]", ":1: [[follow]] 1: set: 7000 is no signal"),
        ("[[follow]]\nset = 1001", ":1: [[follow]] 1: when: it is missing"),
        ("[[follow]]\nwhen = 1\nset = 3", ":3: [[follow]] 1: set: an output is the program's"),
        ("[[follow]]\nwhen = 1", ":1: [[follow]] 1: set: nothing follows"),
        ("[[follow]]\nwhen = 1\nset = 1001\nafter = -1", ":4: [[follow]] 1: after: -1 is no time"),
        ("[[follow]]\nwhen = 1\nset = 1001\nafter = true", "after: True is no time"),
        ("[[follow]]\nwhen = 1\nset = 1001\nafter = nan", "after: nan is no time"),
        ("[[follow]]\nwhen = 1\nset = 1001\nafterr = 1", ":4: [[follow]] 1: afterr: did you mean after?"),
        ('[[follow]]\nwhen = 1\nset = 1001\nagain = "no"', "again: 'no' is neither true nor false"),
        ('[[follow]]\nwhen = 1\nvariables = ["x"]', "variables and rows belong together"),
        ("[[follow]]\nwhen = 1\nrows = [[1]]", "variables and rows belong together"),
        ('[[follow]]\nwhen = 1\nvariables = ["x"]\nrows = [[1, 2]]', "row 1: a value for each of x is wanted"),
        ('[[follow]]\nwhen = 1\nvariables = ["x"]\nrows = [1]', "rows: a list of rows"),
        ('[[follow]]\nwhen = 1\nvariables = ["x"]\nrows = [[{}]]', "row 1"),
        ('[[follow]]\nwhen = 1\nvariables = ["x"]\nrows = [[nan]]', "row 1"),
        (f'[[follow]]\nwhen = 1\nvariables = ["x"]\nrows = [[1{"0" * 400}]]', "row 1"),
        ('[[follow]]\nwhen = 1\nvariables = ["$s"]\nrows = [[1]]', "row 1"),
        (f'[[follow]]\nwhen = 1\nvariables = ["$s"]\nrows = [["{"s" * 129}"]]', "row 1"),
        ('[[follow]]\nwhen = 1\nvariables = "x"\nrows = [[1]]', ":3: [[follow]] 1: variables: a list of names"),
        ('[[follow]]\nwhen = 1\nvariables = ["2x"]\nrows = [[1]]', ":3: [[follow]] 1: variables: '2x' is no name"),
        ('[[follow]]\nwhen = 1\nvariables = ["#p"]\nrows = [[1]]', "'#p' is no name"),
        ('[[follow]]\nwhen = 1\nvariables = ["x[1]"]\nrows = [[1]]', "'x[1]' is no name"),
        ('[[follow]]\nwhen = 1\nvariables = ["to"]\nrows = [[1]]', "TO is a word of the language"),
        ("follow = 3", ":1: follow: write [[follow]]"),
        ("[[follow]]\nwhen = 1\nset = 1001\n[signals.follow]\na = 3\nb = 3", ":6: follow.b: signal 3 is called"),
        ("signals = 3", ":1: signals: write [signals]"),
    ],
)
def test_a_cell_that_is_wrong_says_where(text: str, told: str) -> None:
    with pytest.raises(FileDamaged) as refused:
        parse_cell(text, "my.toml")
    assert told in f"{refused.value.detail} ({refused.value.hint})"
    assert refused.value.detail.startswith("my.toml:")
    assert "\n" not in refused.value.detail, "one mistake is told once"


def test_a_cell_that_is_not_there() -> None:
    with pytest.raises(NonexistentFile):
        read_cell("/never/there.toml")
