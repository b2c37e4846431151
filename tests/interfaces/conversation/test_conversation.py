"""Whatever is typed, the conversation goes on."""

from io import StringIO
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.examples import examples
from vrs_cli.interfaces.conversation.conversation import Conversation
from vrs_cli.interfaces.dialogue import Dialogue, at_once
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.tasks.limits import Limits
from vrs_cli.interfaces.users import UserState
from vrs_cli.language.words.instructions import CONTROL, INSTRUCTIONS
from vrs_cli.language.words.monitor import COMMANDS
from vrs_cli.language.words.word import Role
from vrs_cli.repl.loop import PlainTerminal
from vrs_cli.values.acts import KeepDraft, Kept, ReadDraft
from vrs_cli.values.diagnostics import LineRefused

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
        conversation.perform(conversation.lines(line))
    assert "internal error" not in stream.getvalue()


def conversation() -> Conversation:
    return Conversation(Session(PlainTerminal(StringIO(), iter([]))))


def test_several_lines_at_once() -> None:
    dialogue = conversation()
    dialogue.perform(dialogue.lines(".PROGRAM p\na = 1\n.END\nEXECUTE p\nb = a+1"))
    assert dict(dialogue.session.environment.kinds).keys() == {"a", "b"}


def test_a_program_is_read_and_stored_where_no_see_is_open() -> None:
    typed = conversation()

    def do(act: ReadDraft | KeepDraft) -> Any:
        return at_once(typed.act(act))

    wrong = do(ReadDraft(".PROGRAM p(n)\nMOVEE part\nx = n"))
    assert [one.span.line for one in wrong.findings] == [2]
    assert "p" not in typed.session.programs, "it was looked at"
    assert do(KeepDraft(".PROGRAM p(n)\nx = n")) == Kept("p", "Program p: 1 step")
    assert do(KeepDraft(".PROGRAM p(n)\nMOVEE part")).said.endswith("it cannot be executed yet")
    assert len(typed.session.programs) == 1, "it took the place of the one before"
    with pytest.raises(LineRefused):
        do(KeepDraft("MOVE part"))


def test_a_broken_pipe_is_for_the_caller(monkeypatch: pytest.MonkeyPatch) -> None:
    def gone(*_arguments: object) -> None:
        raise BrokenPipeError

    monkeypatch.setattr(Session, "answers", gone)
    typed = conversation()
    with pytest.raises(BrokenPipeError):
        typed.perform(typed.lines("WHERE"))


# --- at a desk of one's own ----------------------------------------------------------------------------------------


def said(session: Session, user_state: UserState, dialogue: Dialogue[None]) -> list[str]:
    """What a talk says at somebody's desk, as a pipe would have it."""
    session.converse(session.at(user_state, dialogue))
    assert isinstance(session.terminal, PlainTerminal)
    assert isinstance(session.terminal.stream, StringIO)
    text = session.terminal.stream.getvalue()
    session.terminal.stream.truncate(0)
    session.terminal.stream.seek(0)
    return text.splitlines()


def test_two_who_type_do_not_hear_of_each_others_program() -> None:
    session = Session(PlainTerminal(StringIO(), iter([])))
    one, other = (Conversation(session, UserState()) for _ in range(2))
    assert said(session, one.user_state, one.lines(".PROGRAM p\na = 1")) == []
    assert (one.status().prompt, one.status().indent, other.status().prompt) == ("    2.? ", "    ", ".")
    assert said(session, other.user_state, other.lines("LISTR 2")) == ["2                2"]
    assert said(session, one.user_state, one.lines(".END")) == ["Program p: 1 step"]


def test_who_may_only_look_types_no_program() -> None:
    session = Session(PlainTerminal(StringIO(), iter([])))
    viewer = Conversation(session, UserState(role=Role.OBSERVER))
    assert said(session, viewer.user_state, viewer.lines(".PROGRAM p\na = 1\n.END\nWHERE t"))[0].startswith(
        "*Not in your role*"
    )
    assert not session.programs


@pytest.mark.parametrize("pasted", [(), ("a = 1",), ("TYPE 1", "TYPE 2", ".END", "TYPE 7")], ids=len)
def test_a_program_that_is_refused_to_who_is_there_goes_with_its_paste(pasted: tuple[str, ...]) -> None:
    session = Session(PlainTerminal(StringIO(), iter([])))
    viewer = Conversation(session, UserState(role=Role.OBSERVER, attended=True))
    first, *more = said(session, viewer.user_state, viewer.lines("\n".join((".PROGRAM q", *pasted))))
    assert first.startswith("*Not in your role*")
    assert [line for line in more if line] == [" 7"] * (".END" in pasted), "no step of it is done as a command"
    assert (viewer.entry, viewer.status().prompt, viewer.in_program) == (None, ".", False)
    assert said(session, viewer.user_state, viewer.lines("TYPE 8")) == [" 8"]


def test_who_leaves_a_robot_that_others_hold_is_asked_nothing() -> None:
    session = Session(PlainTerminal(StringIO(), iter([])))
    visitor = Conversation(session, UserState(attended=True))
    assert said(session, visitor.user_state, visitor.lines("a = 1\nEXIT")) == []


def test_the_status_is_what_a_prompt_shows() -> None:
    dialogue = conversation()
    dialogue.user_state.attended = True
    dialogue.perform(dialogue.lines("SPEED 50\nDRIVE 1, 10\nhand = 3"))
    status = dialogue.status()
    assert (status.prompt, status.running, status.monitor_speed, status.speed_unit) == (".", False, 50.0, "%")
    assert status.clock == status.end > 0.0
    assert (status.hidden, status.pace, status.branch) == (("hand",), None, "main")


PASTED = """\
.PROGRAM pick()
    MOVE part
.END
.PROGRAM place()
    TYPE "placed"
.END

.LOCATIONS
part 500 150 -100 90 90 0
.END
EXECUTE
"""


def test_places_may_stand_behind_the_programs_of_a_paste() -> None:
    stream = StringIO()
    conversation = Conversation(Session(PlainTerminal(stream, iter([]))))
    conversation.perform(conversation.lines('.PROGRAM before\nTYPE "before"\n.END\nEXECUTE'))
    conversation.perform(conversation.lines(PASTED))
    assert stream.getvalue() == (
        "Program before: 1 step\nbefore\nProgram completed\n"
        "Program pick: 1 step\nProgram place: 1 step\nProgram completed\n"
    )
    assert conversation.session.engine.position().T_world_tool.px == pytest.approx(0.5)


def test_the_name_of_a_program_may_be_cut_short() -> None:
    stream = StringIO()
    conversation = Conversation(Session(PlainTerminal(stream, iter([]))))
    conversation.perform(conversation.lines(PASTED.replace("EXECUTE", "EX pl\nLISTP pla\nEX pi\nEX p\nDELETEP pla")))
    said = stream.getvalue()
    assert "placed\nProgram completed\n.PROGRAM place()\n" in said
    assert "program p (pick, place begin so)" in said
    assert said.endswith("program pla (did you mean place?)\n")
