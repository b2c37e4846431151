"""Write docs/words.md, and the words that the editor of the page colours, from the tables of the language.

python docs/make_words.py
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from vrs_cli.language.words.functions import FUNCTIONS, LINKS, OPERATORS
from vrs_cli.language.words.instructions import CONNECTIVES, CONTROL, INSTRUCTIONS, OPERATOR_WORDS
from vrs_cli.language.words.monitor import COMMANDS
from vrs_cli.language.words.word import Control, Word, WordRow
from vrs_cli.render.colours import LINKING

PAGE = Path(__file__).parent / "words.md"
EDITOR = Path(__file__).parent.parent / "vrs_cli/page/src/panels/words.json"
HEAD = """# Every word

This page lists all words that the shell knows. The column *from* has `1` for a word of VAL, `2` of VAL-II and `+` of
V+; it is empty for words that we added. vrs also knows the words that are not available, and refuses them by name.
`DISABLE VPLUS` refuses words that only V+ has. *Who* is the lowest role in which a user may type the word. Each word
has an anchor, such as `words.md#instruction-move`. `python docs/make_words.py` makes this page from the tables that
HELP, completion and the analyzer read.
"""
COLUMNS = "| form | what it does | example | from | who | state |\n| --- | --- | --- | --- | --- | --- |"
TABLES: tuple[tuple[str, str, Mapping[str, WordRow]], ...] = (  # title, beginning of the anchors, rows
    ("Monitor commands", "command", COMMANDS),
    ("Control structures", "control", CONTROL),
    ("Instructions", "instruction", INSTRUCTIONS),
    ("Functions and constants", "function", FUNCTIONS),
    ("Operators", "operator", OPERATORS),
    ("Words that link", "link", LINKS),
)
SIGILS = {"$": "string-", "#": "precision-"}  # a sigil in an anchor


def page() -> str:
    """The whole page."""
    return "\n".join((HEAD, *(_table(title, sort, rows.values()) for title, sort, rows in TABLES)))


def editor_words() -> str:
    """The words of each ink as JSON, as `vrs_cli/render/colours.py` colours them."""
    links = CONNECTIVES | {lead for word in COMMANDS.values() for lead in word.leads} | LINKING
    words = {
        "command": COMMANDS,
        "instruction": INSTRUCTIONS,
        "control": CONTROL,
        "function": FUNCTIONS,
        "constant": (name for name, row in FUNCTIONS.items() if row.constant),
        "link": links | set(OPERATOR_WORDS),
    }
    return json.dumps({ink: sorted(names) for ink, names in words.items()}, indent=1) + "\n"


def _table(title: str, sort: str, rows: Iterable[WordRow]) -> str:
    return "\n".join((f"## {title}\n", COLUMNS, *(row_text(row, sort) for row in rows), ""))


def row_text(row: WordRow, sort: str) -> str:
    """A row of the tables as a line of the page."""
    cells = " | ".join(cell.replace("|", chr(92) + "|") for cell in _cells(row))
    return f"| {_anchor(row.name, sort)}{cells} |"


def _anchor(name: str, sort: str) -> str:
    """`instruction-move`, `function-string-mid`; the signs among the operators have none."""
    sigil = SIGILS.get(name[0], "")
    word = name[1:] if sigil else name
    return f'<a id="{sort}-{sigil}{word.lower()}"></a>' if word[0].isalpha() else ""


def _cells(row: WordRow) -> Iterator[str]:
    yield f"`{row.form}`"
    yield row.summary
    yield f"`{row.example}`"
    yield row.where.strip()
    yield str(row.role.name).lower() if isinstance(row, Word) and not isinstance(row, Control) else ""
    yield f"{row.state.value}; {row.note}" if row.note else row.state.value


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    EDITOR.write_text(editor_words(), encoding="utf-8")
