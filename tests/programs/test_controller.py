"""Files in the style of those of controllers: they are checked, printed and run as they are.

`python -m tests.programs.test_controller` prints which constructs they have, and in how many files.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.files.opening import Folder
from vrs_cli.files.program_file import read_program_file
from vrs_cli.files.timed_lines import parse_signals
from vrs_cli.interfaces.inspection import inspect
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.tasks.limits import Limits
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.language.analysis.structure import canonical_text
from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import Program, Section
from vrs_cli.language.text.parser import parse_file
from vrs_cli.values.diagnostics import Dialect, errors

HERE = Path(__file__).parent
FILES = sorted((HERE / "controller").glob("*.v2"))
DRIVERS = sorted((HERE / "drivers").glob("*.v2"))


def lines_of(text: str, word: str) -> list[str]:
    """Return what stands behind `; word:` in comments."""
    start = f"; {word}:"
    return [line.removeprefix(start).strip() for line in text.splitlines() if line.startswith(start)]


def constructs(path: Path) -> Iterator[str]:
    """The words and forms of a file, each as often as it stands there."""
    file, _ = parse_file(read_program_file(path), name=path.stem)
    for part in file.parts:
        if isinstance(part, Section):
            yield part.name
        elif isinstance(part, Program):
            yield ".PROGRAM"
            for step in part.steps:
                yield from ("label",) if step.label is not None else ()
                for node in ast.nodes(step.statement):
                    if isinstance(node, ast.Instruction):
                        yield node.word
                    elif isinstance(node, ast.Call):
                        yield f"{node.name}()"
                    elif isinstance(node, ast.If | ast.IfGoto | ast.While | ast.For | ast.Case | ast.Until | ast.Goto):
                        yield {"IfGoto": "IF ... GOTO"}.get(type(node).__name__, type(node).__name__.upper())
                    elif isinstance(node, ast.Variable) and node.indexes is not None:
                        yield "a[], a[i,]" if node.many else "a[i]"


def test_there_are_forty_programs_with_most_of_the_words() -> None:
    found = Counter(word for path in (*FILES, *DRIVERS) for word in constructs(path))
    assert found[".PROGRAM"] >= 40
    assert len(found) >= 120


@pytest.mark.parametrize("path", [*FILES, *DRIVERS], ids=lambda path: path.stem)
def test_a_file_is_checked_and_printed(path: Path) -> None:
    text = read_program_file(path)
    assert not list(errors(inspect(text, load_robot("puma560"), name=path.stem)))
    printed = canonical_text(text, Dialect.VPLUS, path.stem)
    assert isinstance(printed, str)
    assert canonical_text(printed, Dialect.VPLUS, path.stem) == printed


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_file_runs_as_it_is(path: Path, tmp_path: Path) -> None:
    text = read_program_file(path)
    session = Session(RecordingTerminal(), limits=Limits(max_time=100.0), folder=Folder(tmp_path))
    session.load_text(text, path.stem)
    session.driver.inputs = parse_signals("\n".join(lines_of(text, "signals")))
    result = session.execute(next(iter(session.environment.programs.values())).name, all_tasks=True)
    assert [line.strip() for line in result.typed] == lines_of(text, "expect")
    assert result.fault is None
    session.close()


if __name__ == "__main__":
    each = {path.stem: Counter(constructs(path)) for path in (*FILES, *DRIVERS)}
    words = Counter(word for found in each.values() for word in found)
    total = sum((found for found in each.values()), Counter[str]())
    print(f"{total['.PROGRAM']} programs in {len(each)} files, {len(words)} constructs: files, times")
    for word, files in sorted(words.items(), key=lambda one: (-one[1], one[0])):
        print(f"{word:16} {files:3} {total[word]:4}")
