"""Settings of Sphinx for the site of these pages: `python -m sphinx -W -c docs . build/site` (extra `site`)."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from vrs_cli.highlight.val2 import Val2Lexer
from vrs_cli.version import __version__

ROOT = Path(__file__).parents[1]
INDEX = "docs/index"
LINK = re.compile(r"\[([^]\n]*)\]\(([\w./-]+)\)")
ELSEWHERE = ("/README", "/CHANGELOG", "/tests/conformance/README", "/programs/exercises/*/exercise/text")

project, version, release = "vrs", __version__, __version__
extensions = ["myst_parser"]
root_doc = INDEX
include_patterns = ["README.md", "CHANGELOG.md", "docs/*.md", "tests/conformance/*.md", "programs/exercises/*/*/*.md"]
exclude_patterns = [".*", "build", "vrs_cli", "benchmarks", "node_modules"]
myst_heading_anchors = 4  # as GitHub names them
myst_enable_extensions = ["attrs_inline"]
html_theme = "alabaster"
html_title = f"vrs {version}"
html_copy_source = html_show_copyright = html_show_sphinx = False
html_theme_options = {
    "description": "A VAL-II shell for a virtual robot",
    "page_width": "1400px",
    "sidebar_width": "270px",
    "body_max_width": "none",
    "fixed_sidebar": True,
    "font_family": "system-ui, sans-serif",
    "head_font_family": "system-ui, sans-serif",
    "code_font_size": "0.85em",
    "show_relbars": False,
}
html_sidebars = {"**": ["about.html", "searchfield.html", "navigation.html"]}


def contents(index: str) -> str:
    """Return the pages that each part of the index links, as tables of contents that only the sidebar shows."""
    made = []
    for part in re.split(r"^## ", index, flags=re.MULTILINE)[1:]:
        pages = dict.fromkeys(re.findall(r"\]\(([\w-]+)\.md(?:#[^)]*)?\)", part))
        made.append((part.partition("\n")[0], [*pages]))
    made.append(("Beside these pages", ELSEWHERE))
    return "".join(
        "\n```{{toctree}}\n:hidden:\n:glob:\n:caption: {}\n\n{}\n```\n".format(title, "\n".join(pages))
        for title, pages in made
    )


def read(_app: Any, page: str, source: list[str]) -> None:
    """Give the index its contents, make targets of a page's own anchors, and texts of links to folders."""
    folder = (ROOT / page).parent
    source[0] = LINK.sub(lambda link: link[1] if (folder / link[2]).is_dir() else link[0], source[0])
    source[0] = re.sub(r'<a id="([\w.-]+)"></a>', r"[]{#\1}", source[0])
    if page == INDEX:
        source[0] += contents(source[0])


def finish(app: Any, error: Exception | None) -> None:
    """Let the address of the site itself lead to the index."""
    if error is None:
        (Path(app.outdir) / "index.html").write_text(
            f'<meta http-equiv="refresh" content="0; url={INDEX}.html">\n', "utf-8"
        )


def setup(app: Any) -> None:
    for name in ("val2", "vrs"):
        app.add_lexer(name, Val2Lexer)
    app.connect("source-read", read)
    app.connect("build-finished", finish)
