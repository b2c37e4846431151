"""The site of the documentation: the sidebar has every page, and pages are given to Sphinx as GitHub reads them."""

from __future__ import annotations

import re

import pytest

from tests.docs.examples import ROOT
from tests.docs.makers import DOCS, maker

MADE = maker("conf")
INDEX = (DOCS / "index.md").read_text("utf-8")


def read(page: str, text: str) -> str:
    source = [text]
    MADE.read(None, page, source)
    return source[0]


def test_the_sidebar_has_every_page_in_the_order_of_the_index() -> None:
    listed = re.findall(r"^([\w-]+)$", MADE.contents(INDEX), re.MULTILINE)
    assert sorted(listed) == sorted(path.stem for path in DOCS.glob("*.md") if path.stem != "index")
    captions = re.findall(r"^:caption: (.*)$", MADE.contents(INDEX), re.MULTILINE)
    assert captions == [*re.findall(r"^## (.*)$", INDEX, re.MULTILINE), "Beside these pages"]


def test_other_pages_of_the_sidebar_are_there() -> None:
    for pattern in MADE.ELSEWHERE:
        assert list(ROOT.glob(f"{pattern[1:]}.md"))


@pytest.mark.parametrize(
    ("page", "text", "given"),
    [
        (
            "docs/python",
            "see [examples](../examples), [one](../examples/01_first_moves.py)",
            "see examples, [one](../examples/01_first_moves.py)",
        ),
        ("README", "[examples](examples) and [docs](docs/index.md)", "examples and [docs](docs/index.md)"),
        ("docs/words", '| <a id="command-why"></a>`WHY` |', "| []{#command-why}`WHY` |"),
        ("docs/view", "[a](words.md#command-why)", "[a](words.md#command-why)"),
    ],
)
def test_what_a_site_has_not_is_left_out(page: str, text: str, given: str) -> None:
    assert read(page, text) == given


def test_the_index_gets_its_contents_once() -> None:
    assert read("docs/index", INDEX).count(":caption: To learn") == 1
    assert ":caption:" not in read("docs/view", INDEX)
