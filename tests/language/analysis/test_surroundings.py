"""Test the memory around a program, and names that another may have been meant for."""

from __future__ import annotations

from collections.abc import Mapping

import pytest

from vrs_cli.language.analysis import analyzer as surroundings
from vrs_cli.language.analysis.analyzer import MAX_COMPARED_NAMES, Candidates, Surroundings, analyze_among
from vrs_cli.language.text.ast import Program
from vrs_cli.language.text.parser import parse_file
from vrs_cli.language.words.values import Kind

MANY = [f"name{i}" for i in range(MAX_COMPARED_NAMES + 1)]


def programs(**bodies: str) -> Mapping[str, Program]:
    text = "".join(f".PROGRAM {name}\n{body}\n.END\n" for name, body in bodies.items())
    return {part.key: part for part in parse_file(text)[0].parts if isinstance(part, Program)}


@pytest.mark.parametrize("typed", ["name17", "nmae17", "nam17", "namme17", "mame17", "name71"])
def test_of_many_names_those_one_slip_away_are_compared(typed: str) -> None:
    near = Candidates(MANY).of(typed)
    assert "name17" in near
    assert len(near) < MAX_COMPARED_NAMES / 2


def test_few_names_are_compared_all() -> None:
    few = MANY[:MAX_COMPARED_NAMES]
    assert Candidates(few).of("whatever") is few


def test_who_gives_a_name_a_value() -> None:
    memory = programs(a="x = 1", b="x = y\nz = 2", c="AUTO w\nw = 1")
    around = Surroundings({}, memory)
    told = [around.given_elsewhere(key, memory["b"]) for key in ("x", "y", "z", "w")]
    assert told == [True, False, False, False]
    assert around.given_keys == {"x", "z"}


def test_what_a_name_may_have_been_meant_for() -> None:
    memory = programs(a="x = cuont\nCALL pik\nMOVE hme", b="count = 1", pick="y = 1")
    found = analyze_among(Surroundings({"home": Kind.LOCATION}, memory), memory["a"])

    assert [one.hint for one in found.diagnostics] == [f"did you mean {name}?" for name in ("count", "pick", "home")]


def test_no_program_is_walked_for_each_of_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    memory = programs(**{f"p{i}": f"x{i} = name{i}" for i in range(50)})
    walked: list[Program] = []
    monkeypatch.setattr(
        surroundings, "names_given_in", lambda program: walked.append(program) or frozenset({program.name})
    )
    around = Surroundings({}, memory)
    for program in memory.values():
        analyze_among(around, program)
    assert len(walked) == 2 * len(memory)
