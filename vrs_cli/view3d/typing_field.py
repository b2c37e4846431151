"""Lines typed into a field of a page in which Enter is a line break, as it is where a field has several rows.

A field of one row will not do: viser sends what it holds at most every 50 ms, the last of what there was; an Enter soon
after a key would take the place of that key, and SPEED 100 would be carried out as SPEED 10. A line break comes with
the text that it ends.
"""

from __future__ import annotations

from typing import NamedTuple

SAME = 0.3  # [s] in which the same text once more is an echo of what was taken, and not typed again


class TypedText(NamedTuple):
    """`text`: lines that are ended, None while none is; `left`: what belongs in the field, None where that is there."""

    text: str | None
    left: str | None


class TypingField:
    """Takes what the page says that its field holds, in order. Until the page has heard that lines were taken, it still
    has them, and says so with what is typed behind them. `text`: what belongs in the field.
    """

    def __init__(self) -> None:
        self.text = ""
        self._taken, self._taken_at, self._rest = "", 0.0, ""

    def put(self, text: str) -> None:
        """The field holds another text: a suggestion, a line of before."""
        self.text, self._taken = text, ""

    def changed(self, value: str, wall: float) -> TypedText:
        """`wall`: the time of the day [s]."""
        late = self._is_late(value, wall)
        text = self._rest + value[len(self._taken) :] if late else value
        if "\n" not in text:
            self.text = text
            self._taken = self._taken if late else ""
            return TypedText(None, text if late else None)
        ended, rest = self._ended(text)
        self.text, self._taken, self._taken_at, self._rest = rest, value, wall, rest
        return TypedText(ended, rest)

    def _is_late(self, value: str, wall: float) -> bool:
        """Whether the page has not heard yet what was taken."""
        if not self._taken or not value.startswith(self._taken):
            return False
        return len(value) > len(self._taken) or wall < self._taken_at + SAME

    def _ended(self, text: str) -> tuple[str, str]:
        """The lines that are ended, and the rest. Enter in the middle of a line ends all of it."""
        if text.count("\n") == 1 and text.replace("\n", "") == self.text:
            return self.text, ""
        ended, _, rest = text.rpartition("\n")
        return ended, rest
