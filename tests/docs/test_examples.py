"""README.md and docs/: every example is what really happens, every file that is named is there."""

from __future__ import annotations

import re
import subprocess
import tomllib
from collections.abc import Iterator
from contextlib import chdir
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.docs.examples import LANGUAGES, PEOPLE, ROOT, PageFault, Reader, blocks, matches
from tests.examples import quick
from tests.repl.afar import remote_front_end

README = ROOT / "README.md"
PAGES = [README, *sorted((ROOT / "docs").glob("*.md"))]
WITHOUT_EXAMPLES = {
    "CONTRIBUTING.md",
    "design.md",
    "editors.md",
    "install.md",
    "kinds.md",
    "messages.md",
    "reference.md",
    "stability.md",
    "view.md",
    "words.md",
}
IN_REAL_TIME = ("delays.md", "experiment.md", "serve.md", "teaching.md", "twin.md")  # or with a whole study
AT_A_FRONT_END = ("vrs", "val2", "toml", "xml")  # sessions, and the files that they have
CI = ROOT / ".ci" / "run"

_LINK = re.compile(r"\]\((?!https?:)([^)#]*)(#[^)]*)?\)")
_NAMED_FILE = re.compile(r"`((?:vrs_cli|docs|tests|programs|grammar|benchmarks)/[\w./-]+)`")
_SAMPLE = re.compile(r"^\| \[`?(\w+)\.v2`?\]\(programs/\1\.v2\) \|", re.MULTILINE)


def name_of(page: Path) -> str:
    return str(page.relative_to(ROOT))


# --- the pages -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("page", quick(PAGES, lambda _number, page: page.name not in IN_REAL_TIME), ids=name_of)
def test_examples(page: Path, tmp_path: Path) -> None:
    text = page.read_text(encoding="utf-8")
    runnable = [block for block in blocks(name_of(page), text) if block.language not in ("sh", "text")]
    assert bool(runnable) is not (page.name in WITHOUT_EXAMPLES)
    differences = Reader(tmp_path).differences(name_of(page), text)
    assert not differences, "\n" + "\n".join(differences)


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_sessions_are_the_same_over_a_line(page: Path, tmp_path: Path) -> None:
    sat = [
        block for block in blocks(name_of(page), page.read_text(encoding="utf-8")) if block.language in AT_A_FRONT_END
    ]
    sat = [block for block in sat if block.argument not in PEOPLE]
    reader = Reader(tmp_path, remote_front_end)
    with chdir(tmp_path):
        differences = [difference for block in sat for difference in LANGUAGES[block.language](reader, block)]
    assert not differences, "\n" + "\n".join(differences)


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_links_lead_to_files_and_headings(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert not list(dead_links(page, text))
    assert not [file for file in _NAMED_FILE.findall(text) if not (ROOT / file).exists()]


def test_every_page_is_linked_from_the_index() -> None:
    index = ROOT / "docs" / "index.md"
    assert "](docs/index.md)" in README.read_text(encoding="utf-8")
    text = index.read_text(encoding="utf-8")
    assert not [page for page in PAGES[1:] if page != index and f"]({page.name})" not in text]


def test_every_sample_program_is_in_the_table() -> None:
    listed = _SAMPLE.findall(README.read_text(encoding="utf-8"))
    assert listed == sorted(path.stem for path in (ROOT / "programs").glob("*.v2"))


@pytest.mark.skipif(not CI.exists(), reason="a source distribution has no .ci")
@pytest.mark.parametrize(
    ("what", "command"),
    [
        (
            "pytest",
            "python3 -m venv .venv && .venv/bin/pip install -q -e '.[dev]' && .venv/bin/python -m pytest -q -n 3",
        ),
        (
            "vrs demo",
            "python3 -m venv .venv && .venv/bin/pip install -q . && .venv/bin/vrs demo",
        ),
    ],
)
def test_ci_finds_the_commands_of_the_readme(what: str, command: str) -> None:
    found = re.search(r"^readme_command\(\) .*$", CI.read_text(encoding="utf-8"), re.MULTILINE)
    assert found
    script = f'{found.group()}\nreadme_command "{what}"'
    done = subprocess.run(["bash", "-c", script], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout == command + "\n"


@pytest.mark.skipif(not CI.exists(), reason="a source distribution has no .ci")
def test_ci_runs_the_tests_that_the_command_of_the_readme_leaves_out() -> None:
    options = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["pytest"]["ini_options"]
    assert options["addopts"].endswith(" -m 'not long'")
    assert "\n.venv/bin/python -m pytest -q -n 3 -m long\n" in CI.read_text(encoding="utf-8")


def test_commands_that_only_ci_runs_are_those_of_the_readme() -> None:
    commands = [
        block.text
        for page in PAGES
        for block in blocks(name_of(page), page.read_text(encoding="utf-8"))
        if block.language == "sh"
    ]
    assert len(commands) == 3, "two of the README, one for contributors"
    assert all(command.startswith("python3 -m venv .venv && ") for command in commands)


def test_the_longer_runs_are_there() -> None:
    text = (ROOT / "docs" / "CONTRIBUTING.md").read_text(encoding="utf-8")
    named = re.findall(r"^\| `python -m (\S+)", text, re.MULTILINE)
    assert len(named) > 10
    assert not [module for module in named if find_spec(module) is None]


def dead_links(page: Path, text: str) -> Iterator[str]:
    for target, anchor in _LINK.findall(text):
        file = page.parent / target if target else page
        if not file.exists():
            yield target
        elif anchor and anchor[1:] not in slugs(file.read_text(encoding="utf-8")):
            yield target + anchor


def slugs(text: str) -> set[str]:
    """The anchors of a page: those of its headings, as GitHub makes them, and its own."""
    headings = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    own = re.findall(r'<a id="([^"]+)"></a>', text)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings} | set(own)


def test_the_figures_of_the_robot_are_those_of_its_file() -> None:
    text = (ROOT / "docs" / "robots.md").read_text(encoding="utf-8")
    rows = re.findall(
        r"^\| (\d) \| (\S+) \| (\S+) \| (\S+) \| (\S+) to (\S+) \| (\S+) \| (\S+) \|$", text, re.MULTILINE
    )
    with (ROOT / "vrs_cli" / "kinematics" / "robots" / "puma560.toml").open("rb") as file:
        joints = tomllib.load(file)["joints"]
    keys = ("a", "d", "alpha", "lower", "upper", "max_velocity", "max_acceleration")
    assert [tuple(map(float, row)) for row in rows] == [
        (number, *(joint[key] for key in keys)) for number, joint in enumerate(joints, 1)
    ]


# --- the checker itself: a wrong page is found out -----------------------------------------------------------------

HELLO = """
```console
$ vrs run programs/hello.v2
Hello from a PUMA 560
The tool is 921.1 mm above the shoulder
Program completed
$ echo $?
0
```
"""
WAVE = """
```vrs
.DRIVE 1, 30, 50
.LISTR 2+3
2+3              5
..PROGRAM wave
    1.?     TYPE "hi"
    2.?     .END
Program wave: 1 step
.LISTP wave
.PROGRAM wave()
    1       TYPE "hi"
.END
```
"""
PIECE = """
```val2
IF x > 2 THEN
    TYPE x
END
```
"""


def differences(text: str, folder: Path) -> list[str]:
    return Reader(folder).differences("page", text)


@pytest.mark.parametrize("page", [HELLO, WAVE, PIECE])
def test_a_right_page_passes(page: str, tmp_path: Path) -> None:
    assert differences(page, tmp_path) == []


@pytest.mark.parametrize(
    ("page", "right", "wrong"),
    [
        (HELLO, "921.1", "921.2"),
        (HELLO, "Program completed\n", ""),
        (HELLO, "Program completed\n", "Program completed\nand more\n"),
        (HELLO, "\n0\n", "\n1\n"),
        (HELLO, "hello.v2", "helo.v2"),
        (HELLO, "vrs run", "true | vrs check"),
        (WAVE, "2+3              5", "2+3              6"),
        (WAVE, "2+3              5", "2+3  5"),
        (WAVE, "DRIVE 1, 30", "DRIVE 9, 30"),
        (WAVE, "    2.?     .END", "    3.?     .END"),
        (WAVE, "    1.?     TYPE", "    1.? TYPE"),
        (WAVE, '    1       TYPE "hi"', '    1       TYPE "ho"'),
        (PIECE, "THEN", "THN"),
        (PIECE, "END", ""),
    ],
)
def test_a_wrong_page_is_found_out(page: str, right: str, wrong: str, tmp_path: Path) -> None:
    assert right in page
    assert differences(page.replace(right, wrong), tmp_path)


@pytest.mark.parametrize(
    "page",
    [
        "```console\n$ vrs --version\n",
        "```console\nvrs --version\n```\n",
        "```console\n$ vrs --version\n...\n```\n",
        "```vrs again\n.WHERE\n```\n",
        "```vrs\n```\n",
        "```val\nMOVE a\n```\n",
        "```\nMOVE a\n```\n",
    ],
)
def test_a_page_that_shows_nothing_is_refused(page: str, tmp_path: Path) -> None:
    with pytest.raises(PageFault, match="page:1"):
        differences(page, tmp_path)


def test_an_example_reads_what_one_before_it_wrote(tmp_path: Path) -> None:
    page = '```val2 a.v2\n.PROGRAM a\nTYPE "here"\n.END\n```\n```console\n$ vrs run a.v2 --quiet\nhere\n```\n'
    assert differences(page, tmp_path) == []


def test_a_new_session_knows_nothing_of_the_one_before(tmp_path: Path) -> None:
    page = "```vrs\n.x = 3\n```\n```vrs{}\n.LISTR x\nx                3\n```\n"
    assert differences(page.format(""), tmp_path / "one") == []
    assert differences(page.format(" new"), tmp_path / "two")


@pytest.mark.parametrize(
    ("expected", "actual", "same"),
    [
        (["a", "...", "d"], ["a", "b", "c", "d"], True),
        (["a", "...", "d"], ["a", "d"], True),
        (["...", "b"], ["a", "b", "b"], True),
        (["a", "...", "d"], ["a", "b", "c"], False),
        (["..."], [], True),
        (["a"], ["a", "b"], False),
        (["a", "b"], ["a"], False),
        (["a..."], ["abc"], False),
    ],
)
def test_dots_stand_for_any_lines(expected: list[str], actual: list[str], same: bool) -> None:
    assert matches(expected, actual) is same


def test_a_dead_link_is_found() -> None:
    text = "# A Heading: `it`\n[a](README.md) [b](nowhere.md) [c](#a-heading-it) [d](#b) [e](https://example.org)"
    assert slugs(text) == {"a-heading-it"}
    assert list(dead_links(ROOT / "page.md", "[a](README.md) [b](nowhere.md) [e](https://example.org)")) == [
        "nowhere.md"
    ]
