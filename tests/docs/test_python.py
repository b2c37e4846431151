"""The examples in Python: each runs as it stands and prints what its last comment says; the notebook runs, too."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.examples import quick

ROOT = Path(__file__).parents[2]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
HEAD = "\n# It prints:\n#\n"


@pytest.mark.parametrize(
    "path", quick(EXAMPLES, lambda _number, path: path.stem != "10_robot_body"), ids=lambda path: path.stem
)
def test_an_example_prints_what_it_says(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    code, _, printed = path.read_text(encoding="utf-8").partition(HEAD)
    expected = [line.removeprefix("#").removeprefix("   ") for line in printed.splitlines()]
    monkeypatch.chdir(tmp_path)
    exec(compile(code, str(path), "exec"), {"__name__": "__main__"})
    out, err = capsys.readouterr()
    assert err == ""
    assert out.splitlines() == expected
    assert expected
    assert len(code.splitlines()) <= 45
