"""Write the list of all files into docs/design.md: each with the first sentence of its docstring.

python -m docs.make_files
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "design.md"
BEGIN, END = "<!-- files: made by python -m docs.make_files -->\n", "<!-- end of files -->\n"


def first_sentence(path: Path) -> str:
    """Return the first sentence of a module's docstring, "" for a module without one."""
    words = " ".join((ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or "").split("\n\n")[0].split())
    return words.partition(". ")[0].rstrip(".:")


def rows() -> Iterator[str]:
    """Yield a row for each file that says in a docstring what it is for, folder by folder."""
    for path in sorted((ROOT / "vrs_cli").rglob("*.py"), key=lambda one: (one.parent.as_posix(), one.name)):
        if what := first_sentence(path):
            yield f"| `{path.relative_to(ROOT).as_posix()}` | {what.replace('|', '/')} |\n"


def with_files(page: str) -> str:
    """Return the page with the list as it is now."""
    head, rest = page.split(BEGIN)
    return f"{head}{BEGIN}\n| file | what it does |\n|---|---|\n{''.join(rows())}\n{END}{rest.split(END)[1]}"


if __name__ == "__main__":
    PAGE.write_text(with_files(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
