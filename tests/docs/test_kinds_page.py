"""docs/kinds.md is made from the table of kinds, and names each of them."""

from docs.make_kinds import PAGE, page
from vrs_cli.teach.kinds import KINDS


def test_the_page_is_what_the_table_says() -> None:
    assert PAGE.read_text(encoding="utf-8") == page(), "python -m docs.make_kinds"
    for name, kind in KINDS.items():
        section = page().split(f"\n## {name}\n")[1].split("\n## ")[0]
        assert all(f"| `{key.name}` |" in section for key in kind.keys)
