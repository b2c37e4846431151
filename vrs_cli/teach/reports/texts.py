"""Text of students as reports show it: nothing of it is obeyed, by a terminal, a table or a browser."""

from __future__ import annotations

import re

from vrs_cli.files.opening import DEVICES

JOINERS = "\u200c\u200d"  # letters of some scripts are written with them
FORMULA = ("=", "+", "-", "@", "\t", "\r")  # spreadsheets compute what begins so
_SLUG = re.compile(r"[^A-Za-z0-9_.-]+")


def plain(text: str) -> str:
    """Return a text of one line: blanks for ends of lines, and characters that have no look as `^[` or `<U+202E>`."""
    return "".join(one if one.isprintable() or one in JOINERS else _shown(one) for one in text)


def _shown(character: str) -> str:
    code = ord(character)
    if character in "\n\r\t":
        return " "
    return f"^{chr(code ^ 0x40)}" if code < 0x80 else f"<U+{code:04X}>"


def cell(text: str) -> str:
    """Return a text as a cell of a table of CSV: one that a spreadsheet would compute begins with an apostrophe."""
    return f"'{plain(text)}" if text.lstrip().startswith(FORMULA) or text.startswith(FORMULA) else plain(text)


def points_text(points: float) -> str:
    """Return points without needless zeros: `7`, `7.5`."""
    return f"{points:.2f}".rstrip("0").rstrip(".")


def file_stem(name: str, taken: set[str]) -> str:
    """Return a name for a file that is good on every system, and none of those `taken`, to which it is added."""
    stem = _SLUG.sub("_", name)[:60].strip(".") or "_"
    if stem.split(".")[0].casefold() in DEVICES:
        stem = f"_{stem}"
    found, number = stem, 1
    while found.casefold() in taken:
        number += 1
        found = f"{stem}-{number}"
    taken.add(found.casefold())
    return found
