"""Return replies as text for outputs other than the shell's terminal: plain text for pipes and files, and styled text
for clients that draw it themselves."""

from __future__ import annotations

from collections.abc import Iterator

from vrs_cli.render.plain import visible
from vrs_cli.values.replies import Message, Reply, StyledLine


def plain_text(reply: Reply) -> str:
    """Return the text of a reply, in which each line ends with a newline; "" for an empty reply."""
    # return early, because most runs show only such a message, and loading the layouts takes a while
    if isinstance(reply, Message):
        return "".join(f"{line.rstrip()}\n" for line in reply.text.split("\n"))
    from vrs_cli.render.blocks import PIPE, text_of
    from vrs_cli.render.layout import blocks

    return text_of(blocks(reply, PIPE))


def styled_lines(reply: Reply, columns: int) -> Iterator[StyledLine]:
    """Yield the lines of a reply for a screen of `columns` characters, as pieces (text, name of an `Ink`). Tables that
    grow with time end after `SCREEN_ROWS` rows, as on a terminal."""
    from vrs_cli.render.blocks import SCREEN_ROWS, Page, block_lines
    from vrs_cli.render.layout import blocks

    page = Page(columns, SCREEN_ROWS, colours=True, unicode=True)
    for line in block_lines(blocks(reply, page), columns):
        yield tuple((visible(text), ink.value) for text, ink in line.pieces)
