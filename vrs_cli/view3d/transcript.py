"""The transcript of a panel as HTML: bounded, the newest last."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from html import escape
from threading import Lock
from typing import NamedTuple

from msgspec.structs import replace

from vrs_cli.render.blocks import PIPE, Block, Grid, line
from vrs_cli.render.colours import Ink
from vrs_cli.render.html import blocks_html, html, pieces_html
from vrs_cli.render.layout import blocks
from vrs_cli.render.scan import scan
from vrs_cli.values.numbers import count
from vrs_cli.values.replies import Plot, Reply

MOST = 100  # entries
MOST_ROWS = 60  # of one: more of them are for a file
LONGEST = 2000  # characters of a line that a program TYPEs


class TranscriptEntry(NamedTuple):
    """`open`: a line that a program TYPEs and has not ended; `again`: what takes its place if it comes next."""

    html: str
    open: str = ""
    again: str = ""


class PanelTranscript:
    """Any thread may add, and look. `version` is another one when something was added."""

    def __init__(self) -> None:
        self.version = 0
        self._entries: deque[TranscriptEntry] = deque(maxlen=MOST)
        self._lock = Lock()

    def html(self) -> str:
        with self._lock:
            return "".join(entry.html for entry in self._entries)

    def echo(self, prompt: str, text: str, again: str = "") -> None:
        """Lines as they were typed. `again`: what they are another one of, if they come one after the other."""
        lines = "\n".join(pieces_html(((prompt, Ink.NOTE), *scan(one))) for one in text.split("\n"))
        entry = TranscriptEntry(f'<pre style="font-weight:600">{lines}</pre>', again=again)
        with self._lock:
            if again and self._entries and self._entries[-1].again == again:
                self._entries.pop()
            self._add(entry)

    def reply(self, reply: Reply) -> None:
        shown = html((reply,)) if isinstance(reply, Plot) else blocks_html(_shortened(blocks(reply, PIPE)))
        self._put(shown)

    def note(self, text: str, ink: Ink = Ink.NOTE) -> None:
        self._put(f"<pre>{pieces_html(line(text, ink).pieces)}</pre>")

    def type(self, text: str, newline: bool) -> None:
        """Add what a program TYPEs; a line may come in parts."""
        with self._lock:
            before = self._entries.pop().open if self._entries and self._entries[-1].open else ""
            whole = (before + text)[:LONGEST]
            self._add(TranscriptEntry(f"<pre>{escape(whole)}</pre>", "" if newline else whole))

    def _put(self, text: str) -> None:
        with self._lock:
            self._add(TranscriptEntry(text))

    def _add(self, entry: TranscriptEntry) -> None:
        self._entries.append(entry)
        self.version += 1


def _shortened(shown: Iterable[Block]) -> Iterator[Block]:
    """The first rows; how many more there are."""
    left = MOST_ROWS
    more = 0
    for block in shown:
        rows = len(block.rows) if isinstance(block, Grid) else 1
        more += max(rows - left, 0)
        if isinstance(block, Grid) and left > 0:
            yield replace(block, rows=block.rows[:left])
        elif left > 0:
            yield block
        left -= rows
    if more:
        yield line(f"... and {count(more, 'more row')}", Ink.NOTE)
