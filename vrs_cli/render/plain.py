"""Make text that needs no layout: text with visible control characters, and sentences about motions whose times
changed."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import TextIO

from vrs_cli.engine.book import SAME_TIME
from vrs_cli.values import numbers, results

# control characters except tabs, line ends, and those that TYPE may send: the bell (/B) and n lines up (/U);
# compiled on first use, because batch runs need it only at a terminal
_CONTROL = r"(\x1b\[[0-9]{1,4}A)|[\x00-\x06\x08\x0b\x0c\x0e-\x1f\x7f-\x9f]"
_CARETS = [f"{'M-' * (code >= 0x80)}^{chr(code % 0x80 ^ 0x40)}" for code in range(0xA0)]


def visible(text: str) -> str:
    """Return text in which control characters are shown as `cat -v` shows them: ^[ for escape, ^? for delete, M-^[ for
    0x9b.

    A program's string may contain any character, and a terminal obeys some of them: it changes colours or its title, or
    sends keys.
    """
    return re.sub(_CONTROL, lambda found: found[1] or _CARETS[ord(found[0])], text)


def for_stream(text: str, stream: TextIO) -> str:
    """Return the text to write to a stream: `visible` text for a terminal, unchanged text for files and pipes."""
    return visible(text) if stream.isatty() else text


MAX_NAMES = 5  # maximum number of motions that a sentence names; it gives the number of the others


def sentences(it: results.Displacement) -> Iterator[str]:
    """Describe motions whose times changed: `3 later motions begin 0.528 s later: AT 4, AT 6, AT 20`."""
    for moved, word in ((it.later, "later"), (it.earlier, "earlier")):
        if moved:
            begin = "begins" if len(moved) == 1 else "begin"
            times = [abs(one.later) for one in moved]
            low = "" if max(times) - min(times) <= SAME_TIME else f"{min(times):.3f} to "
            yield f"{_count(moved, it.more)} {begin} {low}{numbers.seconds(max(times))} {word}: {_names(moved)}"
    if it.dropped:
        yield f"{_count(it.dropped, it.more)} {'is' if len(it.dropped) == 1 else 'are'} dropped: {_names(it.dropped)}"


def _count(moved: Sequence[results.Moved], more: bool) -> str:
    return f"{len(moved)} later motions and more" if more else numbers.count(len(moved), "later motion")


def _names(moved: Sequence[results.Moved]) -> str:
    names = ", ".join(
        (one.text or "a motion") if one.asked is None else f"AT {one.asked:.3f}".rstrip("0").rstrip(".")
        for one in moved[:MAX_NAMES]
    )
    return names if len(moved) <= MAX_NAMES else f"{names} and {len(moved) - MAX_NAMES} more"


def untrue_sentence(it: results.Untrue) -> str:
    """Describe a command that depended on a signal reading which no longer holds. Example: `MOVE b was given when 1001
    came on at 3.200 s; it no longer does (pick step 4: WAIT SIG(1001))`."""
    signal, state = f"{it.signal} ({it.name})" if it.name else str(it.signal), "on" if it.on else "off"
    does, verb = ("came", "does") if it.changed else ("was", "is")
    given = f"{it.command} was given" if it.command else "a program went on"
    place = f" ({it.place})" if it.place else ""
    return f"{given} when {signal} {does} {state} at {numbers.seconds(it.time)}; it no longer {verb}{place}"
