"""The reference page is made of the docstrings, which everything public has."""

from __future__ import annotations

import inspect
import re

import pytest

import vrs_cli as vrs
from tests.docs.makers import DOCS, maker
from vrs_cli import errors

NAMES = [name for name in vrs.__all__ if name != "__version__"]


def test_the_page_is_what_the_docstrings_say() -> None:
    text = (DOCS / "reference.md").read_text(encoding="utf-8")
    assert text == maker("make_reference").page(), "run python docs/make_reference.py"


def test_every_public_name_is_on_the_page_once() -> None:
    groups = [name for _, names in maker("make_reference").GROUPS for name in names]
    assert sorted(groups) == sorted(NAMES)
    anchors = re.findall(r'<a id="([^"]+)"></a>', (DOCS / "reference.md").read_text(encoding="utf-8"))
    assert len(set(anchors)) == len(anchors)


@pytest.mark.parametrize("name", NAMES)
def test_everything_public_has_a_docstring(name: str) -> None:
    it, made = getattr(vrs, name), maker("make_reference")
    assert inspect.getdoc(it)
    if not inspect.isclass(it):
        return
    for member in made.members(it):
        what = inspect.getattr_static(it, member)
        assert inspect.getdoc(getattr(what, "__func__", what)), f"{name}.{member}"


def test_errors_that_docstrings_name_can_be_caught() -> None:
    text = (DOCS / "reference.md").read_text(encoding="utf-8")
    kinds = {name for name, it in vars(errors).items() if isinstance(it, type) and issubclass(it, errors.VrsError)}
    assert kinds & set(re.findall(r"\b[A-Z]\w+\b", text)) <= set(vrs.__all__)


def test_what_raises_says_so() -> None:
    """Methods that refuse what they are given name the error, or the method that they are like."""
    made = maker("make_reference")
    for member in made.members(vrs.Robot):
        what = inspect.getattr_static(vrs.Robot, member)
        if inspect.isfunction(what) and "raise " in inspect.getsource(what):
            text = inspect.getdoc(what) or ""
            assert "Raises" in text or "As `" in text, member
