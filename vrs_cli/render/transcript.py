"""The lines and replies of a session in a file, written as they come: text, HTML, or a cast that asciinema plays."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple, TextIO

from vrs_cli.render.blocks import Page, TextLine, block_lines, line
from vrs_cli.render.colours import COLOURS, Ink
from vrs_cli.render.control import visible
from vrs_cli.render.html import pieces_html
from vrs_cli.render.layout import blocks
from vrs_cli.values.replies import Reply

WIDTH, HEIGHT = 100, 30  # characters of a cast
PAGE = Page(WIDTH, unicode=True)


class TranscriptFormat(NamedTuple):
    """How a transcript begins and ends, and how a line is written that came so many seconds after the beginning."""

    begin: str
    line: Callable[[TextLine, float], str]
    end: str


def _cast_line(line: TextLine, seconds: float) -> str:
    """An event of asciicast v2 (docs.asciinema.org/manual/asciicast/v2)."""
    drawn = "".join(_ansi(text, ink) for text, ink in line.pieces)
    return json.dumps([round(seconds, 3), "o", f"{drawn}\r\n"]) + "\n"


def _ansi(text: str, ink: Ink) -> str:
    colour, bold = COLOURS[ink]
    codes = ["1"] * bold
    if colour:
        codes.append(f"38;2;{int(colour[1:3], 16)};{int(colour[3:5], 16)};{int(colour[5:7], 16)}")
    return f"\x1b[{';'.join(codes)}m{text}\x1b[0m" if codes else text


TEXT = TranscriptFormat("", lambda line, _seconds: f"{line.text}\n", "")
HTML = TranscriptFormat(
    '<!DOCTYPE html>\n<html><head><meta charset="utf-8"><title>vrs</title></head><body><pre>\n',
    lambda line, _seconds: f"{pieces_html(line.pieces)}\n",
    "</pre></body></html>\n",
)
CAST = TranscriptFormat(
    json.dumps({"version": 2, "width": WIDTH, "height": HEIGHT, "title": "vrs"}) + "\n", _cast_line, ""
)
FORMATS: Mapping[str, TranscriptFormat] = {".html": HTML, ".htm": HTML, ".cast": CAST}


class Transcript:
    """A file that is being written. Raises OSError."""

    def __init__(self, path: Path, clock: Callable[[], float]) -> None:
        self.path = path
        self._clock, self._begun, self._open_line = clock, clock(), ""
        self._format = FORMATS.get(path.suffix.lower(), TEXT)
        self._stream: TextIO = path.open("w", encoding="utf-8", newline="\n")
        self._put(self._format.begin)

    def typed(self, prompt: str, text: str) -> None:
        self._line(TextLine(((prompt, Ink.NOTE), (text, Ink.HEADING))))

    def reply(self, reply: Reply) -> None:
        for one in block_lines(blocks(reply, PAGE), WIDTH):
            self._line(one)

    def type(self, text: str) -> None:
        """Add what a program types; lines are written when they are complete."""
        *complete, self._open_line = (self._open_line + text).split("\n")
        for one in complete:
            self._line(line(one))

    def close(self) -> None:
        if self._open_line:
            self._line(line(self._open_line))
        self._put(self._format.end)
        self._stream.close()

    def _line(self, one: TextLine) -> None:
        shown = TextLine(tuple((visible(text), ink) for text, ink in one.pieces))
        self._put(self._format.line(shown, self._clock() - self._begun))

    def _put(self, text: str) -> None:
        self._stream.write(text)
        self._stream.flush()
