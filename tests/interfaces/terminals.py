"""A terminal for tests: remembers what is said, answers what it was told to."""

from __future__ import annotations

from collections.abc import Iterable

from vrs_cli.errors import IllegalValue
from vrs_cli.interfaces.dialogue import Reading, Running
from vrs_cli.values.questions import Answer, LineWanted, Question
from vrs_cli.values.replies import Reply


class RecordingTerminal:
    """`typed` is what programs TYPE, `replies` what commands answer, `asked` the prompts that were shown. Where it is
    not `sure`, nobody answers a question."""

    attended = False

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

    def progress(self, doing: Running | Reading) -> None:
        pass

    def ask(self, question: Question) -> Answer:
        self.asked.append(question.text)
        if not isinstance(question, LineWanted):
            return self.sure or None
        if not self.answers:
            raise IllegalValue("PROMPT", "there is no more input")
        return self.answers.pop(0)
