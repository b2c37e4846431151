"""Whatever is typed, the conversation goes on."""

from io import StringIO

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.examples import examples
from vrs_cli.interfaces.conversation.conversation import Conversation
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.tasks.limits import Limits
from vrs_cli.language.words.instructions import CONTROL, INSTRUCTIONS
from vrs_cli.language.words.monitor import COMMANDS
from vrs_cli.repl.terminal import PlainTerminal

HARMLESS = sorted(
    {*COMMANDS, *INSTRUCTIONS, *CONTROL}
    - {"SAVE", "FDELETE", "FRENAME", "FCOPY", *(name for name in COMMANDS if name.startswith("STORE"))}
)
PIECES = [
    "part",
    "#safe",
    "$s",
    "x[1]",
    "5",
    "-1",
    '"text"',
    "TRUE",
    "1/0",
    ",",
    "=",
    "(",
    ")",
    ":",
    " AT ",
    " TO ",
    "CP",
]

typed_lines = st.one_of(
    st.text(max_size=30),
    st.tuples(st.sampled_from(HARMLESS), st.lists(st.sampled_from(PIECES), max_size=5)).map(
        lambda pair: f"{pair[0]} {''.join(pair[1])}"
    ),
    st.sampled_from([".PROGRAM p", ".PROGRAM p(a)", ".END", ".REALS", "EXECUTE p", "EDIT p", "EDIT p(a), 2"]),
    st.sampled_from(["", "C p", "D", "D 2", "E", "F a", "I", "L", "P 3", "R     x", "S 2", "S", "T", "TS", "a = 1"]),
)


@examples(60)
@given(st.lists(typed_lines, max_size=12))
def test_law_nothing_that_is_typed_is_an_internal_error(typed: list[str]) -> None:
    stream = StringIO()
    terminal = PlainTerminal(stream, iter([]))
    conversation = Conversation(Session(terminal, limits=Limits(max_time=10.0, max_steps=1000)))
    for line in typed:
        conversation.take(line)
    assert "internal error" not in stream.getvalue()


def conversation() -> Conversation:
    return Conversation(Session(PlainTerminal(StringIO(), iter([]))))


def test_several_lines_at_once() -> None:
    talk = conversation()
    talk.take(".PROGRAM p\na = 1\n.END\nEXECUTE p\nb = a+1")
    assert dict(talk.session.environment.kinds()).keys() == {"a", "b"}


def test_a_broken_pipe_is_for_the_caller(monkeypatch: pytest.MonkeyPatch) -> None:
    def gone(_session: Session, _line: str) -> None:
        raise BrokenPipeError

    monkeypatch.setattr(Session, "answers", gone)
    with pytest.raises(BrokenPipeError):
        conversation().take("WHERE")
