"""The line of VAL-II at a panel: history, completion, mistakes under it, questions of the robot, and what was said.

Lines are typed into a field in which Enter is a line break, as it is where a field has several rows. A field of one row
will not do: viser sends what it holds at most every 50 ms, the last of what there was; an Enter soon after a key would
take the place of that key, and SPEED 100 would be carried out as SPEED 10. A line break comes with the text that it
ends.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from html import escape
from typing import NamedTuple

import viser

from vrs_cli.interfaces.rights import STOPPING
from vrs_cli.net.messages import Asked
from vrs_cli.render.html import html
from vrs_cli.values.diagnostics import Diagnostic
from vrs_cli.values.prompt import Suggestion
from vrs_cli.values.questions import Confirmation, Parting
from vrs_cli.values.replies import Diagnosed, DiagnosticsReport
from vrs_cli.view3d.panel_front_end import PanelFrontEnd
from vrs_cli.view3d.parts import Hands, boxed, put

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
        again = self._taken and value.startswith(self._taken)  # the page has not heard yet what was taken
        late = bool(again) and (len(value) > len(self._taken) or wall < self._taken_at + SAME)
        text = self._rest + value[len(self._taken) :] if late else value
        if "\n" not in text:
            self.text = text
            self._taken = self._taken if late else ""
            return TypedText(None, text if late else None)
        if text.count("\n") == 1 and text.replace("\n", "") == self.text:
            ended, rest = self.text, ""  # Enter in the middle of a line ends all of it
        else:
            ended, _, rest = text.rpartition("\n")
        self.text, self._taken, self._taken_at, self._rest = rest, value, wall, rest
        return TypedText(ended, rest)


SUGGESTED = 8  # words at most
PATIENCE = 1.0  # [s] that a line waits to be looked at for mistakes before it is sent
EARLIER, LATER, UNDO, REDO = "\N{UPWARDS ARROW} line", "\N{DOWNWARDS ARROW} line", "Undo", "Redo"
YES, NO = "Yes", "No"
LABEL = "VAL-II"
SAID_HEIGHT = "17em"


class _Checking(NamedTuple):
    """A line that is looked at before it is sent, since that time of the day [s]."""

    text: str
    since: float


class CommandLine:
    """`hands` does what is typed and clicked, in order, in a thread of its own."""

    def __init__(self, gui: viser.GuiApi, front_end: PanelFrontEnd, hands: Hands, wall: Callable[[], float]) -> None:
        self._front_end, self._hands, self._wall = front_end, hands, wall
        self._typing, self._answering = TypingField(), TypingField()
        self._lines = deque[str]()
        self._checking: _Checking | None = None
        self._choices: tuple[Suggestion, ...] = ()
        self._asked_for = ""  # the text whose completion was asked for last
        self._at = 0  # how many lines before the newest of the history the field shows
        self._shown: Asked | None = None
        self._version = -1
        self.asked = gui.add_html("", visible=False)
        self.yes_no = gui.add_button_group("Answer", (YES, NO), visible=False)
        self.answer = gui.add_text("Answer", "", multiline=True, visible=False, hint="Enter gives the answer")
        self.field = gui.add_text(LABEL, "", multiline=True, hint="Enter carries it out")
        self.words = gui.add_button_group("Words", ("",), visible=False)
        self.mistake = gui.add_html("", visible=False)
        self.recall = gui.add_button_group("Go back", (EARLIER, LATER, UNDO, REDO))
        self.said = gui.add_html("")
        hands.on(self.field, self._typed)
        hands.on(self.answer, self._answered)
        hands.on(self.words, self._accept)
        hands.on(self.yes_no, lambda chosen: self._give(chosen == YES))
        hands.on(self.recall, self._recall)

    # --- typing ---

    def _typed(self, value: str) -> None:
        typed = self._typing.changed(value, self._wall())
        if typed.left is not None:
            self._hands.fill(self.field, typed.left)
        if typed.text is not None:
            self._at = 0
            self._take(typed.text)
        self._complete(value if typed.left is None else typed.left)
        if typed.text is None:
            self.mistake.visible = False

    def put(self, text: str) -> None:
        """Have a text in the field."""
        self._typing.put(text)
        self._hands.fill(self.field, text)

    def _take(self, text: str) -> None:
        """Lines that are ended: looked at one after the other, and sent."""
        if text.strip()[:2].upper() in {word[:2] for word in STOPPING}:  # waits for nothing
            self._front_end.type(text)
            return
        self._lines.append(text)
        self._next()

    def _next(self) -> None:
        if self._checking is not None or not self._lines:
            return
        checking = self._checking = _Checking(self._lines.popleft(), self._wall())
        self._front_end.check(checking.text, lambda mistake: self._hands.do(lambda: self._checked(checking, mistake)))

    def _checked(self, checking: _Checking, mistake: Diagnostic | None) -> None:
        """A line without mistake is sent; another one is put back, with what came after it."""
        if checking is not self._checking:
            return
        self._checking = None
        if mistake is None:
            self._front_end.type(checking.text)
            self._next()
            return
        self._lines.clear()
        if not self._typing.text:
            self.put(checking.text)
        report = DiagnosticsReport((Diagnosed(mistake, checking.text),))
        put(self.mistake, content=boxed(html((report,))), visible=True)

    def drop(self) -> None:
        """Lines that are not sent yet, and will not be."""
        lines = [*([] if self._checking is None else [self._checking.text]), *self._lines]
        self._checking = None
        self._lines.clear()
        for line in lines:
            self._front_end.drop(line)

    # --- completion and history ---

    def _complete(self, text: str) -> None:
        self._asked_for = text
        if not text.strip():
            self._suggest(text, ())
            return
        self._front_end.complete(text, lambda choices: self._hands.do(lambda: self._suggest(text, choices)))

    def _suggest(self, text: str, choices: tuple[Suggestion, ...]) -> None:
        if text != self._asked_for:
            return  # more was typed meanwhile
        self._choices = choices[:SUGGESTED]
        words = tuple(dict.fromkeys(one.text for one in self._choices))
        if words:
            self.words.options = words
        self.words.visible = bool(words)

    def _accept(self, word: str) -> None:
        text = self._asked_for
        chosen = next((one for one in self._choices if one.text == word), None)
        if chosen is not None:
            whole = text[: len(text) - chosen.length] + chosen.text
            self.put(whole)
            self._complete(whole)

    def _recall(self, what: str) -> None:
        if what in (UNDO, REDO):
            self._front_end.command(what.upper())
            return
        history = self._front_end.history
        self._at = min(max(self._at + (1 if what == EARLIER else -1), 0), len(history))
        self.put(history[-self._at] if self._at else "")

    # --- questions ---

    def _answered(self, value: str) -> None:
        typed = self._answering.changed(value, self._wall())
        if typed.left is not None:
            self._hands.fill(self.answer, typed.left)
        if typed.text is not None:
            self._give(typed.text)

    def _give(self, value: bool | str) -> None:
        if self._shown is not None:
            self._front_end.answer(self._shown, value)

    def _show_question(self) -> None:
        asked = self._front_end.question
        if asked is self._shown:
            return
        self._shown = asked
        decides = asked is not None and isinstance(asked.question, Confirmation | Parting)
        self.asked.visible = asked is not None
        self.yes_no.visible, self.answer.visible = decides, asked is not None and not decides
        if asked is not None:
            lines = (getattr(asked.question, one, "") for one in ("about", "wrong", "text"))
            spoken = " ".join(filter(None, lines)) or "a line is wanted"
            self.asked.content = boxed(f"<b>{escape(spoken)}</b>")
            self._answering.put("")
            self._hands.fill(self.answer, "")

    # --- what is seen ---

    def refresh(self) -> None:
        """Show what has come since."""
        if self._checking is not None and self._wall() > self._checking.since + PATIENCE:
            checking = self._checking
            self._hands.do(lambda: self._checked(checking, None))  # the robot has enough to do
        self._show_question()
        status = self._front_end.robot.status()
        put(self.field, label=status.prompt.strip() if status.in_program else LABEL)
        transcript = self._front_end.transcript
        if transcript.version != self._version:
            self._version = transcript.version
            # the newest is seen: what is written from below up needs no scrolling down
            style = f"height:{SAID_HEIGHT};overflow:auto;display:flex;flex-direction:column-reverse"
            self.said.content = boxed(f'<div style="{style}"><div>{transcript.html()}</div></div>')
