"""The page of all words, HELP, completion and the tables say the same."""

from __future__ import annotations

import re

from tests.docs.makers import DOCS, maker
from vrs_cli.interfaces.conversation.complete import _all_words
from vrs_cli.interfaces.monitor.help import overview
from vrs_cli.interfaces.monitor.help import page as help_page
from vrs_cli.language.words.functions import FUNCTIONS, LINKS, OPERATORS
from vrs_cli.language.words.instructions import CONTROL, INSTRUCTIONS, RESERVED
from vrs_cli.language.words.monitor import COMMANDS
from vrs_cli.language.words.word import State

ROWS = [*COMMANDS.values(), *CONTROL.values(), *INSTRUCTIONS.values(), *FUNCTIONS.values()]


def test_the_page_is_what_the_tables_say() -> None:
    text = (DOCS / "words.md").read_text(encoding="utf-8")
    assert text == maker("make_words").page(), "run python docs/make_words.py"


def test_the_editor_of_the_page_colours_what_the_tables_say() -> None:
    made = maker("make_words")
    assert made.EDITOR.read_text(encoding="utf-8") == made.editor_words(), "run python docs/make_words.py"


def test_every_word_has_an_anchor_of_its_own() -> None:
    found = re.findall(r'^\| <a id="([a-z0-9.-]+)"></a>`', (DOCS / "words.md").read_text("utf-8"), re.MULTILINE)
    assert len(set(found)) == len(found)
    rows = (*ROWS, *OPERATORS.values(), *LINKS.values())
    assert len(found) == sum(row.name.strip("#$")[0].isalpha() for row in rows)
    assert {"command-here", "instruction-here", "function-here", "function-string-mid", "operator-mod"} <= set(found)


def test_help_and_completion_know_every_word() -> None:
    rows = (*ROWS, *OPERATORS.values(), *LINKS.values())
    assert not [row.name for row in rows if row.form not in {entry.form for entry in help_page(row.name).entries}]
    assert {row.name for row in ROWS} <= {name for name, _ in _all_words()}


def test_help_lists_what_can_be_used() -> None:
    listed = {name for group in overview().groups for name in group.words}
    usable = {row.name for row in ROWS if row.state is State.SUPPORTED}
    assert usable <= listed
    assert not listed & ({row.name for row in ROWS} - usable)


def test_the_words_that_are_no_names() -> None:
    """The table in language.md is that of the language."""
    rows = re.findall(
        r"^\| ((?:`[A-Z]+` ?)+) \| ([a-z ]+) \|$", (DOCS / "language.md").read_text("utf-8"), re.MULTILINE
    )
    shown = {word: why for words, why in rows for word in words.replace("`", "").split()}
    assert shown == RESERVED
