"""Write docs/kinds.md from the table of kinds of checks.

python -m docs.make_kinds
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from vrs_cli.teach.kinds import COMMON_KEYS, KINDS, REQUIRED, CheckKind, Key

PAGE = Path(__file__).parent / "kinds.md"
HEAD = """# Every kind of check

This page lists the kinds of `[[check]]` in an [exercise](exercises.md) or a lesson. Keys without a default are
required. Each kind has an anchor, such as `kinds.md#part_at`. `python -m docs.make_kinds` makes this page from the
table in `vrs_cli/teach/kinds.py`.

All kinds have these keys:
"""
COLUMNS = "| key | what it is | default |\n|---|---|---|"


def page() -> str:
    """Return the whole page."""
    parts = (HEAD, _table(COMMON_KEYS), *(_section(name, kind) for name, kind in KINDS.items()))
    return "\n".join(parts)


def _section(name: str, kind: CheckKind) -> str:
    earns = f"Partial marks: {kind.partial}." if kind.partial else "All points or none."
    keys = f"\n\n{_table(kind.keys)}" if kind.keys else "\n"
    return f"\n## {name}\n\nChecks {kind.what}. {earns}{keys}".rstrip() + "\n"


def _table(keys: Iterable[Key]) -> str:
    return "\n".join((COLUMNS, *_rows(keys), ""))


def _rows(keys: Iterable[Key]) -> Iterator[str]:
    for key in keys:
        what = key.what.replace("|", "\\|")
        yield f"| `{key.name}` | {what} | {_shown(key)} |"


def _shown(key: Key) -> str:
    """Return a default as the file would say it."""
    match key.default:
        case str() as word if word == REQUIRED:
            return ""
        case bool() as state:
            return str(state).lower()
        case float() | int() as number:
            return f"{number:g}"
        case (0.0, 0.0, 0.0):
            return "[0, 0, 0]"
    return "none"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
