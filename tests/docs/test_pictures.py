"""The pictures of the documentation show what the program does now."""

from __future__ import annotations

import importlib.util
import re
from itertools import groupby
from pathlib import Path
from types import ModuleType
from xml.etree import ElementTree

import pytest

from tests.docs.examples import ROOT

IMAGES = ROOT / "docs" / "images"
LARGEST = 1_000_000  # [bytes]
TEXT = "{http://www.w3.org/2000/svg}text"
REMAKE = "python docs/make_pictures.py makes the pictures anew"

_FETCHED = re.compile(r"@import|@font-face|(?:href|src)\s*=\s*\"https?:|url\(\s*[\"']?https?:")


@pytest.fixture(scope="module")
def pictures() -> ModuleType:
    """docs/make_pictures.py, which is a script and no module."""
    spec = importlib.util.spec_from_file_location("make_pictures", ROOT / "docs" / "make_pictures.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def without_blanks(text: str) -> str:
    return "".join(text.split())


def shown(svg: str) -> list[str]:
    """The lines of text of a terminal picture, without blanks and empty lines."""
    pieces = [(element.get("y"), element.text or "") for element in ElementTree.fromstring(svg).iter(TEXT)]
    lines = ("".join(text for _, text in line) for _, line in groupby(pieces, key=lambda piece: piece[0]))
    return [line for line in map(without_blanks, lines) if line]


def now(pictures: ModuleType) -> list[str]:
    return ["vrs", *filter(None, map(without_blanks, pictures.session_text().splitlines()))]


def test_the_session_is_what_the_shell_shows_now(pictures: ModuleType) -> None:
    assert shown((IMAGES / "session.svg").read_text(encoding="utf-8")) == now(pictures), REMAKE


def test_another_session_would_be_noticed(pictures: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pictures, "SESSION", (*pictures.SESSION, "LISTR 2+3"))
    assert "2+35" in now(pictures)
    assert shown((IMAGES / "session.svg").read_text(encoding="utf-8")) != now(pictures)


def test_the_same_session_gives_the_same_picture(pictures: ModuleType) -> None:
    assert pictures.session_svg() == pictures.session_svg()


@pytest.mark.parametrize("picture", sorted(IMAGES.glob("*.svg")), ids=lambda picture: picture.name)
def test_a_picture_is_whole_and_fetches_nothing(picture: Path) -> None:
    svg = picture.read_text(encoding="utf-8")
    assert ElementTree.fromstring(svg).tag.endswith("svg")
    assert not _FETCHED.search(svg)


@pytest.mark.parametrize("picture", sorted(IMAGES.iterdir()), ids=lambda picture: picture.name)
def test_a_picture_is_small_and_on_a_page(picture: Path) -> None:
    assert picture.stat().st_size < LARGEST
    pages = [ROOT / "README.md", *(ROOT / "docs").glob("*.md")]
    assert any(f"images/{picture.name})" in page.read_text(encoding="utf-8") for page in pages)


def test_what_would_be_fetched_is_noticed() -> None:
    assert _FETCHED.search('@font-face { src: url("https://example.org/a.woff") }')
    assert _FETCHED.search('<image href="http://example.org/a.png"/>')
