"""Test RAPID as written: a machine of our own carries it out, with the same places and outputs as the program."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from tests.convert.playing import done_in, farthest
from tests.convert.rapid_machine import RapidMachine
from tests.convert.readers import Matrix
from tests.convert.test_executed import NEAR, SLOW, program
from tests.examples import examples, quick
from tests.interfaces.terminals import RecordingTerminal
from tests.programs.test_samples import SAMPLES, peers_of, robot_for
from vrs_cli import Robot
from vrs_cli.convert.as_written import RapidTranslator, Translated
from vrs_cli.convert.steps import executed_run
from vrs_cli.files.opening import Folder
from vrs_cli.files.timed_lines import parse_signals
from vrs_cli.interfaces.session.session import Session

WHOLE = ("corner", "hanoi", "hello", "palletize", "pick_and_place", "sorting", "star")  # samples without a remainder


def translated(text: str, folder: Path, inputs: str = "") -> tuple[Session, Translated]:
    session = Session(RecordingTerminal(), robot_for(text), folder=Folder(folder), outside=peers_of(text))
    if inputs:
        session.driver.inputs = parse_signals(inputs)
    session.load_text(text)
    before = session.environment.copy()
    session.execute(next(iter(session.environment.programs.values())).name)
    programs = [stored.analysis for stored in session.environment.programs.values()]
    run = executed_run(session.engine.arm, session.engine.timeline)
    return session, RapidTranslator(session.environment, programs, run, before, "sample").translate()


def moved(places: list[Matrix]) -> list[Matrix]:
    """Return the places that differ from those before them."""
    pairs = zip(places, [np.zeros((4, 4)), *places], strict=False)
    return [place for place, before in pairs if np.abs(place - before).max() > NEAR]


def check(text: str, folder: Path, inputs: str = "") -> RapidMachine:
    session, found = translated(text, folder, inputs)
    assert found.unsaid == ()
    machine = RapidMachine(
        found.text,
        Robot(session.engine.model),
        [(one.time, one.signal, one.on) for one in parse_signals(inputs).changes],
    )
    expected = done_in(session.engine.arm, session.engine.timeline)
    assert farthest(moved(machine.places), moved(expected.places)) < NEAR
    assert machine.done.outputs == expected.outputs
    return machine


@pytest.mark.parametrize("name", quick(WHOLE, lambda _number, name: name not in SLOW))
def test_samples_lead_to_the_same_places(name: str, tmp_path: Path) -> None:
    check((SAMPLES[0].parent / f"{name}.v2").read_text(), tmp_path)


@pytest.mark.parametrize(
    "path", [path for path in SAMPLES if path.stem not in (*WHOLE, "planar")], ids=lambda p: p.stem
)
def test_what_has_no_counterpart_is_named_with_its_line(path: Path, tmp_path: Path) -> None:
    text = path.read_text()
    _, found = translated(text, tmp_path)
    assert found.unsaid
    lines = text.splitlines()
    for line, what in found.unsaid:
        assert what.split()[0].split("(")[0].lower() in lines[line - 1].lower() or " " in what
        assert f"NOT SAID: {what} (line {line})" in found.text
    for opener, closer in (("IF", "ENDIF"), ("WHILE", "ENDWHILE"), ("FOR", "ENDFOR"), ("TEST", "ENDTEST")):
        opened = [one for one in map(str.strip, found.text.splitlines()) if one.startswith(f"{opener} ")]
        blocks = [one for one in opened if opener != "IF" or one.endswith("THEN")]
        assert len(blocks) == found.text.count(f" {closer}\n")


def test_blocks_jumps_and_references(tmp_path: Path) -> None:
    text = (
        program(
            "n = 0",
            "10 n = n+1",
            "IF n < 3 GOTO 10",
            "DO",
            "n = n+1",
            "IF n == 6 THEN",
            "EXIT",
            "END",
            "UNTIL n > 100",
            "CALL twice(n, 4)",
            "FOR i = 3 TO 1 STEP -1",
            "IF i == 2 THEN",
            "NEXT",
            "END",
            "MOVE SHIFT(a BY 10*i, n)",
            "END",
            "CASE n OF",
            "VALUE 1, 2:",
            "SIGNAL 1",
            "VALUE 16:",
            "SIGNAL 2",
            "ANY",
            "SIGNAL 3",
            "END",
            "WHILE NOT (n < 14) AND TRUE DO",
            "n = n-1",
            "END",
            "MOVE #PPOINT(n, -90, 90)",
            "DRIVE 2, -20, 50",
            "DEPART 10",
            'TYPE "n is ", /I0, n',
        )
        + ".PROGRAM twice(x, more)\nx = 2*x+more\n.END\n"
    )
    machine = check(text, tmp_path)
    assert machine.typed == ["n is 13"]


def test_compounds_tool_and_base(tmp_path: Path) -> None:
    lines = ("TOOL grip", "BASE 10, 20, 0, 15", "SET p = a:TRANS(5, 6, 7, 80, -80, 10)", "MOVE p", "APPROS b, 40")
    more = (
        "MOVES b:RZ(20)",
        "SET q = INVERSE(INVERSE(b))",
        "DEPARTS 30",
        "MOVE q",
        "BREAK",
        "HERE r",
        "ACCEL 40",
        "MOVES SHIFT(r BY 1, 2, 3)",
    )
    check(program(*lines, *more), tmp_path)


def test_reactions_are_traps(tmp_path: Path) -> None:
    text = program("REACTI 1003, halt.it, 10", "MOVE a", "IGNORE 1003") + ".PROGRAM halt.it()\nSIGNAL 5\n.END\n"
    _, found = translated(text, tmp_path)
    assert found.unsaid == ()
    trap = "  TRAP trap1003\n    StopMove \\Quick;\n    ClearPath;\n    StartMove;\n    halt_it;\n  ENDTRAP\n"
    assert trap in found.text
    assert "CONNECT at_trap1003 WITH trap1003;" in found.text
    assert "ISignalDI \\Single, di3, 1, at_trap1003;" in found.text
    assert "VAR intnum at_trap1003;" in found.text


def test_reactions_are_carried_out(tmp_path: Path) -> None:
    """REACT calls once; REACT again allows a second call; another program replaces it; IGNORE ends it."""
    text = program(
        "REACT 1003, first",
        "REACT -1004, fell",
        *(
            "MOVE a",
            "BREAK",
            "MOVE b",
            "BREAK",
            "DELAY 20",
            "BREAK",
            "SIGNAL 1",
            "MOVE c",
            "BREAK",
            "DELAY 20",
            "BREAK",
        ),
        "REACT 1003, third",
        *("DELAY 20", "BREAK", "SIGNAL 2", "REACT 1003, first", "IGNORE 1003", "DELAY 20", "BREAK", "MOVE a"),
    )
    text += "".join(
        f".PROGRAM {name}\n{line}\n.END\n"
        for name, line in (
            ("first", "SIGNAL 11\nREACT 1003, second"),
            ("second", "SIGNAL 12\nMOVES SHIFT(c BY 0, 20)"),
            ("third", "SIGNAL 13"),
            ("fell", "SIGNAL 14"),
        )
    )
    told = [(0.2, 3, "on"), (8, 3, "off"), (15, 3, "on"), (30, 4, "on"), (31, 4, "off"), (33, 3, "off")]
    told += [(55, 3, "on"), (56, 3, "off"), (80, 3, "on")]
    machine = check(text, tmp_path, "\n".join(f"{time}, {1000 + signal}, {state}" for time, signal, state in told))
    assert [number for number, _ in machine.done.outputs] == [11, 12, 1, 14, 13, 2]


def test_variables_of_a_program_are_its_own(tmp_path: Path) -> None:
    """LOCAL keeps its values, two programs have their own; with AUTO each call has its own. Also arrays."""
    text = program(
        "LOCAL n, v[4]", "n = 1", "v[2] = 7", "FOR i = 0 TO 2", "CALL kept(i)", "END", "CALL down(3)", "m = 4"
    )
    text = text.replace("m = 4", "m = 4\nMOVE SHIFT(a BY n, v[2], m)")
    text += """.PROGRAM kept(k)
LOCAL n, v[], #j
IF k == 0 THEN
n = 30
SET #j = #PPOINT(10, -100, 80)
END
n = n+1
v[k] = 10*n
MOVE SHIFT(b BY v[k], n)
MOVE #j
.END
.PROGRAM down(k)
AUTO m, v[3], p
m = 10*k
v[1] = -m
SET p = SHIFT(c BY m)
IF k > 0 THEN
CALL down(k-1)
END
MOVE SHIFT(p BY v[1], m)
.END
"""
    check(text, tmp_path)


def test_a_loop_that_is_not_carried_out(tmp_path: Path) -> None:
    """FOR of RAPID always carries out its first value."""
    lines = ("FOR i = 1 TO n", "MOVE SHIFT(a BY i)", "END", "FOR j = 1 TO 0", "MOVE SHIFT(a BY j)", "END")
    check(
        program(
            "n = 0",
            *lines,
            "FOR k = 1 TO 2 STEP -1",
            "SIGNAL 2",
            "END",
            *("FOR k = 1 TO 2", "SIGNAL 3", "END", "MOVE b"),
        ),
        tmp_path,
    )


def test_a_parameter_follows_the_variable_it_was_given(tmp_path: Path) -> None:
    text = program("n = 1", "CALL sub(n)", "CALL sub((n))")
    text += ".PROGRAM sub(x)\nCALL more()\nMOVE SHIFT(a BY 10*x)\n.END\n.PROGRAM more()\nn = n+4\n.END\n"
    check(text, tmp_path)


def test_arrays_of_the_file_keep_their_values(tmp_path: Path) -> None:
    lines = ("MOVE p[1]", "MOVES p[3]", "MOVE #j[0]", "SET p[5] = p[1]", "MOVE SHIFT(p[n] BY 5)", "MOVE p[5]")
    text = program("n = r[2,1]+r[0,0]-1", *lines)
    text += """.LOCATIONS
p[1] 300 450 -200 90 90 0
p[3] 200 500 -200 90 90 10
#j[0] 10 -100 80 0 20 0
.END
.REALS
r[2,1] 3
r[0,0] 1
.END
"""
    check(text, tmp_path)


def test_names_do_not_meet(tmp_path: Path) -> None:
    """Words of RAPID, names of routines and data, and names that differ in one language only stay distinct."""
    text = program(
        *("both = 1", "logical = 2", "z50 = 3", "do1 = 4", "dohand = 5", "l10 = 6", "pow = both**2", "held = 7"),
        *("s_m = 8", '$m = "m"', "a.b = 9", "a_b = 10", "sub = 11", "goal = 12", "temporary1 = 13", "orient = 14"),
        *("x = 15", "CALL sub(both, $m, s_m)", "CALL a.b(x)", "10 n = both+logical+z50+do1+dohand+l10+pow+held"),
        *("n = n+s_m+a.b+a_b+sub+goal+temporary1+orient+x", "TYPE $m, n", "MOVE SHIFT(a BY n)", "SIGNAL 1"),
    )
    text += """.PROGRAM sub(sub, $s, s_s)
AUTO sub_, a_b, $x, s_x
a_b = 20
s_x = 21
$x = $s
sub_ = 22
s_s = sub+a_b+s_x+sub_
$s = $x+"!"
CALL a.b(sub_)
.END
.PROGRAM a.b(x)
both = x
x = x+1
.END
"""
    machine = check(text, tmp_path)
    assert machine.typed[0].startswith("m!")


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("n = 6 BAND 3", "6 BAND 3"),
        ("MOVES a AT 3", "MOVES at a time"),
        ("SIGNAL 1+1", "SIGNAL of a number that is computed"),
        ("x = SIG(n)", "SIG of a number that is computed"),
        ("IGNORE 1000+n", "IGNORE of a number that is computed"),
        ("DECOMPOSE x[1] = a", "DECOMPOSE of a transformation"),
        ("OPEN 30", "OPEN of a width"),
        ("ALIGN", "ALIGN"),
        ("$s = $CHR(65)", "$CHR(65)"),
    ],
)
def test_what_cannot_be_said_is_named(line: str, told: str, tmp_path: Path) -> None:
    _, found = translated(program("MOVE b", line), tmp_path)
    assert found.unsaid == ((3, told),)


# --- random programs ------------------------------------------------------------------------------------------------

REALS = st.sampled_from(["n", "m", "v[1]", "v[n1]", "k"])
EXPRESSIONS = st.recursive(
    st.one_of(REALS, st.integers(-9, 9).map(str), st.just("2.5")),
    lambda of: st.one_of(
        st.tuples(of, st.sampled_from("+-"), of).map(lambda it: f"({''.join(it)})"),
        of.map(lambda it: f"ABS({it})"),
        of.map(lambda it: f"5*SIN(30*{it})"),
        of.map(lambda it: f"INT({it}/3)"),
        st.tuples(of, of).map(lambda it: f"({it[0]} < {it[1]})"),
    ),
    max_leaves=4,
)
CONDITIONS = st.one_of(
    st.tuples(EXPRESSIONS, st.sampled_from(["==", "<>", "<", ">=", "<=", ">"]), EXPRESSIONS).map(" ".join),
    st.integers(1, 3).map(lambda signal: f"SIG({signal})"),
    st.tuples(REALS, REALS).map(lambda it: f"NOT (({it[0]} > 1) AND ({it[1]} < 5))"),
    st.just("(n > 2) OR SIG(-1, 2)"),
)
SIMPLE = st.one_of(
    st.tuples(REALS, EXPRESSIONS).map(lambda it: f"{it[0]} = 6*SIN({it[1]})"),
    st.tuples(REALS, EXPRESSIONS).map(lambda it: f"{it[0]} = INT(9*COS({it[1]}))"),
    st.integers(-3, 3).map(lambda signal: f"SIGNAL {signal or 1}"),
    st.tuples(st.sampled_from(["MOVE", "MOVES"]), st.sampled_from("abcp"), EXPRESSIONS).map(
        lambda it: f"{it[0]} SHIFT({it[1]} BY 20*SIN({it[2]}), 5)"
    ),
    st.tuples(st.sampled_from(["MOVE", "APPROS"]), st.sampled_from("abcp")).map(
        lambda it: f"{it[0]} {it[1]}{', 30' * (it[0] == 'APPROS')}"
    ),
    st.sampled_from(["BREAK", "DEPARTS 10", "OPENI", "CLOSEI", "SET p = SHIFT(b BY 10, n)", "MOVE #q", "SPEED 40"]),
    st.tuples(REALS, EXPRESSIONS).map(lambda it: f"CALL first({it[0]}, {it[1]})"),
    st.tuples(EXPRESSIONS, REALS).map(lambda it: f"CALL second({it[0]}, {it[1]}, p)"),
)


@st.composite
def bodies(draw: st.DrawFn, depth: int = 2) -> list[str]:
    """Yield lines of a program. Loops count on their own variables, which have the depth in their names."""
    lines = list[str]()
    for _ in range(draw(st.integers(1, 4))):
        kind = draw(st.sampled_from(["", "", "IF", "WHILE", "FOR", "CASE", "DO", "GOTO"]))
        if not kind or not depth:
            lines.append(draw(SIMPLE))
            continue
        inside, cond, count = draw(bodies(depth - 1)), draw(CONDITIONS), draw(st.integers(1, 3))
        leave = draw(st.sampled_from([[], [], [f"IF {cond} THEN", "EXIT", "END"], [f"IF {cond} THEN", "NEXT", "END"]]))
        if kind == "IF":
            other = ["ELSE", *draw(bodies(depth - 1))] if draw(st.booleans()) else []
            lines += [f"IF {cond} THEN", *inside, *other, "END"]
        elif kind == "WHILE":
            lines += [f"w{depth} = {count}", f"WHILE w{depth} > 0 DO", f"w{depth} = w{depth}-1", *leave, *inside, "END"]
        elif kind == "DO":
            lines += [f"w{depth} = {count}", "DO", f"w{depth} = w{depth}-1", *leave, *inside, f"UNTIL w{depth} <= 0"]
        elif kind == "FOR":
            step, seen = (
                draw(st.sampled_from(["", " STEP 2", " STEP -1"])),
                draw(st.sampled_from([[], [f"k = i{depth}"]])),
            )
            lines += [f"FOR i{depth} = 1 TO {count}{step}", *leave, *seen, *inside, "END", *seen]
        elif kind == "CASE":
            lines += [f"CASE INT({draw(EXPRESSIONS)}) OF", "VALUE 0, 1:", *inside, "VALUE 2:", draw(SIMPLE), "ANY"]
            lines += [draw(SIMPLE), "END"]
        elif kind == "GOTO":
            lines += [f"IF {cond} GOTO @", *inside, f"@ {draw(SIMPLE)}"]
    return lines


def numbered(lines: list[str]) -> Iterator[str]:
    """Yield the lines with a number for each label."""
    jumps = list[int]()
    for place, line in enumerate(lines):
        if line.endswith("@"):
            jumps.append(place + 1)
            yield line.replace("@", str(place + 1))
        else:
            yield f"{jumps.pop()}{line[1:]}" if line.startswith("@") else line


@settings(examples(100), phases=(Phase.explicit, Phase.generate))
@given(bodies(), bodies(1), bodies(0))
def test_random_programs(
    tmp_path_factory: pytest.TempPathFactory, main: list[str], first: list[str], second: list[str]
) -> None:
    """Programs that call each other, with references, LOCAL and AUTO, lead to the same places and outputs."""
    begin = [
        "n = 1",
        "n1 = 1",
        "m = 2",
        "k = 3",
        "v[1] = 4",
        "SET p = a",
        "SET #q = #PPOINT(-100, -130, -15, 0, -35, -95)",
        "MOVE b",
    ]
    first = [re.sub("CALL first.*", "SIGNAL 3", line) for line in first]
    first = ["LOCAL w1, k", "AUTO i1", "k = m", *numbered(first), "n = n+k"]
    second = ["AUTO k, v[2]", "k = m", "v[1] = n", *(line for line in second if "CALL" not in line), "m = v[1]"]
    text = program(*begin, *numbered(main), 'TYPE /F0.4, n, " ", m, " ", k, " ", v[1]')
    text += "\n".join(["\n.PROGRAM first(n, m)", *first, ".END"])
    text += "\n".join(["\n.PROGRAM second(n, m, p)", *second, ".END\n"])
    check(text, tmp_path_factory.getbasetemp())
