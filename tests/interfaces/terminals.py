"""A terminal for tests: remembers what is said, answers what it was told to."""

from __future__ import annotations

from collections.abc import Iterable

from vrs_cli.dialogue.questions import Confirmation, LineWanted
from vrs_cli.dialogue.replies import Reply
from vrs_cli.errors import IllegalValue


class RecordingTerminal:
    """`typed` is what programs TYPE, `replies` what commands answer, `asked` the prompts that were shown."""

    def __init__(self, answers: Iterable[str] = (), sure: bool = True) -> None:
        self.answers = list(answers)
        self.sure = sure
        self.typed = ""
        self.replies: list[Reply] = []
        self.asked: list[str] = []

    def show(self, reply: Reply) -> None:
        self.replies.append(reply)

    def type(self, text: str, newline: bool) -> None:
        self.typed += text + ("\n" if newline else "")

    def ask(self, question: LineWanted) -> str:
        self.asked.append(question.text)
        if not self.answers:
            raise IllegalValue("PROMPT", "there is no more input")
        return self.answers.pop(0)

    def confirm(self, question: Confirmation) -> bool:
        self.asked.append(question.text)
        return self.sure
