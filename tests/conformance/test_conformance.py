"""The suite of VAL-II: vrs does what each program says, and the manifest is whole."""

from __future__ import annotations

import re
import tomllib
from math import degrees
from pathlib import Path

import pytest

from tests.conformance import cases
from tests.interfaces.terminals import RecordingTerminal
from tests.programs.test_samples import keeps_limits
from vrs_cli.files.opening import Folder
from vrs_cli.files.timed_lines import parse_signals
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.tasks.limits import Limits
from vrs_cli.values.results import RunOutcome

NAMES = sorted(path.stem for path in (cases.HOME / "programs").glob("*.v2"))
RULES = cases.read_rules()


# --- vrs, in this process --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
def test_program(name: str, tmp_path: Path) -> None:
    case = cases.read_case(name)
    for file, content in case.files.items():
        (tmp_path / file).write_text(content)
    session = Session(RecordingTerminal(list(case.answers)), limits=Limits(max_time=100.0), folder=Folder(tmp_path))
    diagnostics = session.load_text(case.text)
    assert not [one for one in diagnostics if one.severity.name == "ERROR"], diagnostics
    session.driver.inputs = parse_signals("\n".join(case.signals))
    result = session.execute(case.main)
    assert tuple(line.strip() for line in result.typed) == case.expected
    fault = result.fault
    assert (() if fault is None else (str(fault.code), fault.program, str(fault.step))) == case.fault
    beside = [one.fault for one in result.beside if one.fault is not None]
    assert tuple(word for one in beside for word in (str(one.code), one.program, str(one.step))) == case.task
    assert result.outcome in (RunOutcome.COMPLETED, RunOutcome.HALTED, RunOutcome.FAILED)
    if case.end:
        end = session.engine.position(session.engine.end).joints
        assert [degrees(joint) for joint in end] == pytest.approx(case.end, abs=cases.NEAR)
    session.close()
    assert {one.name: one.read_text() for one in tmp_path.iterdir()} == case.written
    keeps_limits(session)


# --- the manifest ----------------------------------------------------------------------------------------------------


def test_every_program_belongs_to_one_rule() -> None:
    assert sorted(name for rule in RULES for name in rule.programs) == NAMES
    assert len(NAMES) >= 290
    assert len({rule.name for rule in RULES}) == len(RULES)


def test_every_rule_says_how_sure_it_is_and_where_it_was_found() -> None:
    sources = tomllib.loads((cases.HOME / "manifest.toml").read_text("utf-8"))["sources"]
    for rule in RULES:
        assert rule.confidence in cases.CONFIDENCES
        assert rule.language in ("VAL", "VAL-II", "V+", "vrs")
        assert {source.split()[0] for source in rule.sources} <= set(sources)
        assert rule.sources or rule.confidence != "found"


@pytest.mark.parametrize("name", NAMES)
def test_every_line_above_a_program_is_of_the_format(name: str) -> None:
    text = cases.read_case(name).text
    above = text[: text.index(".PROGRAM")]
    assert set(re.findall(r"^; ([a-z]+):", above, re.MULTILINE)) <= set(cases.WORDS)
    assert not re.search(r"^;\s*(?:expect|end|answer|signals|file|written|fault)\s*:", text[len(above) :], re.MULTILINE)


def test_the_page_describes_the_format() -> None:
    page = (cases.HOME / "README.md").read_text("utf-8")
    assert f"{len(NAMES)} small programs" in page
    for word in cases.WORDS:
        assert f"`; {word}:" in page
    for word in cases.CONFIDENCES:
        assert f"| `{word}` |" in page
