"""Make the pictures of the documentation from what the program really prints and draws.

    python docs/make_pictures.py

session.svg is the shell on a terminal, corner.svg what `vrs run programs/corner.v2 --plot corner.svg` draws (with the
extra `plot`). The same program gives the same pictures, byte by byte.
"""

from __future__ import annotations

import io
import re
import sys
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.text import Text

from vrs_cli.__main__ import main as vrs
from vrs_cli.interfaces.conversation.conversation import Conversation
from vrs_cli.interfaces.session.session import Session
from vrs_cli.render.blocks import TextLine
from vrs_cli.render.colours import Ink, scan
from vrs_cli.render.console import TerminalRenderer, rich_text
from vrs_cli.repl.interactive import IDLE
from vrs_cli.repl.prompt import toolbar
from vrs_cli.repl.shell import BANNER
from vrs_cli.repl.terminal import ShellTerminal

ROOT = Path(__file__).parents[1]
IMAGES = ROOT / "docs" / "images"
WIDTH = 84  # columns
HEIGHT = 40  # rows of the terminal
FONT = "ui-monospace, SFMono-Regular, Menlo, Consolas, 'DejaVu Sans Mono', monospace"

SESSION = (
    "SET part = TRANS(0, 550, -250, 90, 90, 0)",
    "APPRO part, 100",
    "MOVES part",
    "WHERE AT 0.5",
    "TIMELINE",
    "MOVE TRANS(1000, 500, 0)",
    "PLOT 1, 2, 3",
)


def recorded(lines: Sequence[str]) -> Console:
    """A console that has recorded a session: each line after the prompt, in its colours, then the answer."""
    console = Console(
        record=True,
        width=WIDTH,
        height=HEIGHT,
        file=io.StringIO(),
        force_terminal=True,
        color_system="standard",
        highlight=False,
    )
    renderer = TerminalRenderer()
    renderer.console = console
    beside = io.StringIO()  # what comes and goes on a slow machine, such as how far a long answer is
    terminal = ShellTerminal(lambda _prompt: "", lambda: renderer, stream=beside)
    conversation = Conversation(Session(terminal))
    console.print(BANNER)
    for line in lines:
        entry = conversation.entry
        console.print(Text(entry.prompt + entry.indent if entry else IDLE) + _coloured(line))
        conversation.perform(conversation.lines(line))
    console.print(IDLE)
    bar = toolbar(conversation.status(), terminal.last, WIDTH)
    console.print(rich_text(TextLine(((bar, Ink.COMMENT),))))
    return console


def _coloured(line: str) -> Text:
    return rich_text(TextLine(tuple(scan(line))))


def session_svg() -> str:
    """The session as a picture. Fonts are those of the reader: nothing is fetched."""
    svg = recorded(SESSION).export_svg(title="vrs", unique_id="session")
    without_fonts = re.sub(r"\s*@font-face \{.*?\}", "", svg, flags=re.DOTALL)
    return without_fonts.replace("font-family: Fira Code, monospace", f"font-family: {FONT}")


def session_text() -> str:
    return recorded(SESSION).export_text()


def main() -> int:
    IMAGES.mkdir(exist_ok=True)
    (IMAGES / "session.svg").write_text(session_svg(), encoding="utf-8")
    return vrs(["run", "programs/corner.v2", "--quiet", "--plot", str(IMAGES / "corner.svg")])


if __name__ == "__main__":
    sys.exit(main())
