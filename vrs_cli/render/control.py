"""Control characters in what a program or a file says: on a screen they are shown, and not obeyed.

A string may hold any character, `$CHR(27)` too, and a terminal takes orders from some of them (colours, the title of
the window, keys to send). Into files and pipes the characters go as they are.
"""

from __future__ import annotations

import re
from typing import TextIO

# the codes of TYPE itself stay: /B the bell, /U n lines up; so do tab and both ends of a line
_OBEYED = r"\x1b\[[0-9]{1,4}A"
_CONTROL = re.compile(rf"({_OBEYED})|[\x00-\x06\x08\x0b\x0c\x0e-\x1f\x7f-\x9f]")
_CARETS = [f"{'M-' * (code >= 0x80)}^{chr(code % 0x80 ^ 0x40)}" for code in range(0xA0)]


def visible(text: str) -> str:
    """The text with control characters as `cat -v` shows them: ^[ for escape, ^? for delete, M-^[ for 0x9b."""
    return _CONTROL.sub(lambda found: found[1] or _CARETS[ord(found[0])], text)


def for_stream(text: str, stream: TextIO) -> str:
    """What is written to a stream: `visible` where it is a terminal, the text as it is elsewhere."""
    return visible(text) if stream.isatty() else text
