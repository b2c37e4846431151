"""SEE with real keys: what the text becomes, and what is stored."""

from __future__ import annotations

import pytest
from prompt_toolkit.application import create_app_session
from prompt_toolkit.document import Document
from prompt_toolkit.input import create_pipe_input
from prompt_toolkit.output import DummyOutput

from tests.interfaces.terminals import RecordingTerminal
from tests.repl.afar import front_end_at, question_of
from vrs_cli.errors import ProgramExists, UsageError
from vrs_cli.interfaces.dialogue import at_once
from vrs_cli.interfaces.editor.buffer import ProgramBuffer
from vrs_cli.interfaces.editor.editors import ScreenDraft
from vrs_cli.interfaces.session.session import Session
from vrs_cli.repl.screen_editor import UNSAVED, ScreenEditor
from vrs_cli.values.acts import KeepDraft
from vrs_cli.values.diagnostics import Dialect, LineRefused
from vrs_cli.values.questions import Answer, Editing, Question
from vrs_cli.values.results import Message

ENTER, SAVE, QUIT, FIND, UNDO, REDO, CUT = "\r", "\x13", "\x11", "\x06", "\x1a", "\x19", "\x0b"
F1 = "\x1bOP"
UP, DOWN, END, HOME, F3, F5 = "\x1b[A", "\x1b[B", "\x1b[F", "\x1b[H", "\x1bOR", "\x1b[15~"


def session_with(text: str = "") -> Session:
    session = Session(RecordingTerminal())
    if text:
        session.load_text(text)
    return session


def see(session: Session, keys: str, name: str = "p", step: int = 1, *, vi: bool = False) -> ScreenEditor:
    """The editor after the keys; they must leave it."""
    with create_pipe_input() as pipe, create_app_session(input=pipe, output=DummyOutput()):
        pipe.send_text(keys)
        front_end = front_end_at(session)
        editor = ScreenEditor(question_of(front_end, name, step), front_end, vi=vi)
        editor.run()
    return editor


def lines(editor: ScreenEditor) -> list[str]:
    return editor.buffer.text.split("\n")


def test_what_is_typed_is_noted_line_by_line_until_it_is_stored() -> None:
    session = session_with()
    noted: list[str] = []
    with create_pipe_input() as pipe, create_app_session(input=pipe, output=DummyOutput()):
        pipe.send_text(f"move part{ENTER}ready{ENTER}{SAVE}{QUIT}")
        front_end = front_end_at(session)
        front_end.after = lambda: noted.append(session.user_state.drafted)
        ScreenEditor(question_of(front_end, "p"), front_end).run()
    assert ".PROGRAM p()\n    MOVE part\n    \n.END\n" in noted
    assert ".PROGRAM p()\n    MOVE part\n    READY\n    \n.END\n" in noted
    assert (noted[-1], session.user_state.drafted) == ("", "")


def test_lines_become_canonical_and_blocks_indented_while_they_are_typed() -> None:
    keys = ENTER.join(["move PART", "if x>1 then", "signal 1", "else", "signal -1", "end", "ready"])
    session = session_with()
    editor = see(session, keys + SAVE + QUIT)
    assert lines(editor) == [
        ".PROGRAM p()",
        "    MOVE part",
        "    IF x > 1 THEN",
        "        SIGNAL 1",
        "    ELSE",
        "        SIGNAL -1",
        "    END",
        "    READY",
    ]
    assert session.environment.program("p").analysis.executable
    assert editor.message == "Program p: 7 steps"
    assert session.user_state.last_edited == "p"


def test_operators_group_as_in_the_dialect_of_the_session() -> None:
    session = session_with()
    session.dialect = Dialect.VAL2
    editor = see(session, f"x = 1{ENTER}y = a > 2 and b < 3{ENTER}ready{SAVE}{QUIT}")
    assert lines(editor)[2] == "    y = (a > (2 AND b)) < 3"
    again = see(session, f"{DOWN}{END} ; it{SAVE}{QUIT}")
    assert lines(again)[2] == "    y = (a > (2 AND b)) < 3 ; it"
    assert session.environment.program("p").program.dialect is Dialect.VAL2


def test_keys_of_vi() -> None:
    program = ".PROGRAM p\nMOVE a\nMOVE b\nMOVE c\n.END\n"
    editor = see(session_with(program), f"jddoready\x1b{SAVE}{QUIT}", vi=True)
    assert lines(editor) == [".PROGRAM p()", "    MOVE a", "    MOVE c", "    READY"]
    assert "NORMAL" in editor._title()
    undone = see(session_with(program), f"jddu{SAVE}{QUIT}", vi=True)
    assert lines(undone) == [".PROGRAM p()", "    MOVE a", "    MOVE b", "    MOVE c"]
    assert "NORMAL" not in see(session_with(program), QUIT)._title()


def test_leaving_a_line_by_an_arrow_makes_it_canonical() -> None:
    editor = see(session_with(".PROGRAM p\nMOVE a\nMOVE b\n.END\n"), f" ;now{DOWN}{QUIT}{QUIT}")
    assert lines(editor)[1:] == ["    ;nowMOVE a", "    MOVE b"]


def test_findings_are_told_while_typing() -> None:
    editor = see(session_with(), f"MOVEE a{QUIT}{QUIT}")
    assert [(one.code, one.span.line, one.span.column) for one in editor.findings] == [(-452, 2, 1)]


def test_structure_is_checked_as_the_text_stands() -> None:
    editor = see(session_with(), f"IF TRUE THEN{QUIT}{QUIT}")
    assert [one.code for one in editor.findings] == [-473]


def test_a_bad_line_is_kept_as_it_was_typed_and_the_program_is_not_executable() -> None:
    session = session_with()
    editor = see(session, f"movee  X{SAVE}{QUIT}")
    assert lines(editor)[1] == "movee  X"
    assert not session.environment.program("p").analysis.executable
    assert "cannot be executed" in editor.message


def test_leaving_with_changes_asks_once() -> None:
    session = session_with(".PROGRAM p\nMOVE a\n.END\n")
    editor = see(session, f"{END}b{QUIT}{QUIT}")
    assert editor.message == UNSAVED
    assert session.environment.program("p").source(0) == "MOVE a"


def test_undo_takes_a_word_back_and_redo_brings_it_again() -> None:
    assert lines(see(session_with(), f"MOVE part{UNDO}{QUIT}{QUIT}"))[1] == "MOVE"
    assert lines(see(session_with(), f"MOVE part{UNDO}{REDO}{QUIT}{QUIT}"))[1] == "MOVE part"
    assert lines(see(session_with(), f"move part{ENTER}{UNDO}{UNDO}{QUIT}{QUIT}"))[1:] == ["move"]


def test_search_and_again() -> None:
    text = ".PROGRAM p\nMOVE a\nMOVE b\nMOVE a\n.END\n"
    assert see(session_with(text), f"{FIND}b{ENTER}{QUIT}")._row == 2
    assert see(session_with(text), f"{FIND}move a{ENTER}{F3}{QUIT}")._row == 3


def test_cutting_a_line_leaves_the_heading() -> None:
    editor = see(session_with(".PROGRAM p\nMOVE a\nMOVE b\n.END\n"), f"{CUT}{UP}{CUT}{QUIT}{QUIT}")
    assert lines(editor) == [".PROGRAM p()", "    MOVE b"]


def test_the_whole_text_is_formatted_on_request() -> None:
    editor = see(session_with(), f"\x1b[200~if x then\nmove A\nend\x1b[201~{F5}{QUIT}{QUIT}")
    assert lines(editor)[1:] == ["    IF x THEN", "        MOVE a", "    END"]


def test_the_heading_can_be_changed_but_not_to_another_program() -> None:
    session = session_with(".PROGRAM p\nREADY\n.END\n.PROGRAM q\nREADY\n.END\n")
    before = session.environment.program("q")
    see(session, f"{UP}{END}\x7f\x7f\x7fq{SAVE}{QUIT}{QUIT}")
    assert session.environment.program("q") is before
    with pytest.raises(ProgramExists, match="q"):
        at_once(ScreenDraft(session, ProgramBuffer(".PROGRAM p()")).do(KeepDraft(".PROGRAM q()\n    READY")))
    editor = see(session, f"{UP}{END}\x7f\x7f\x7fnew(a){SAVE}{QUIT}")
    assert editor.message == "Program new: 1 step"
    assert "new" in session.environment.programs


def test_it_begins_at_the_step_that_was_named() -> None:
    assert see(session_with(".PROGRAM p\nMOVE a\nMOVE b\n.END\n"), QUIT, step=2)._row == 2


def test_a_text_without_a_heading_is_not_stored() -> None:
    session = session_with()
    see(session, f"{UP}{HOME}x{SAVE}{QUIT}{QUIT}")
    assert session.environment.programs == {}
    with pytest.raises(LineRefused, match="the first line names the program"):
        at_once(ScreenDraft(session, ProgramBuffer(".PROGRAM p()")).do(KeepDraft("READY")))


class Screen(RecordingTerminal):
    """A terminal that SEE may fill, with keys to come; without keys one that is too simple."""

    attended = True

    def __init__(self, keys: str) -> None:
        super().__init__()
        self.keys = keys
        self.session = Session(self)

    def ask(self, question: Question) -> Answer:
        assert isinstance(question, Editing)
        if not self.keys:
            return None
        draft = self.session.user_state.on_screen
        assert isinstance(draft, ScreenDraft)
        with create_pipe_input() as pipe, create_app_session(input=pipe, output=DummyOutput()):
            pipe.send_text(self.keys)
            front_end = front_end_at(self.session)
            ScreenEditor(question, front_end).run()
        return True


def test_the_command_shows_what_was_stored() -> None:
    terminal = Screen(f"READY{SAVE}{QUIT}")
    terminal.session.perform("SEE p")
    assert terminal.session.user_state.on_screen is None
    assert terminal.replies == [Message("Program p: 1 step")]


def test_without_a_screen_it_names_the_line_editor() -> None:
    with pytest.raises(UsageError, match="EDIT p"):
        Session(RecordingTerminal()).perform("SEE p")
    with pytest.raises(UsageError, match="this terminal cannot"):
        Screen("").session.perform("SEE p")


def test_words_and_the_names_of_the_text_are_suggestions() -> None:
    editor = see(session_with(".PROGRAM p()\n    heightlimit = 5\n    READY\n.END\n"), QUIT)
    for typed, offered in (("    x = heig", "heightlimit"), ("    SIGNA", "SIGNAL")):
        document = Document(f".PROGRAM p()\n    heightlimit = 5\n{typed}")
        assert [one.text for one in editor._suggestions(document)] == [offered]
    assert editor._suggestions(Document("heig")) == []


def test_the_form_of_the_word_stands_below_and_f1_explains_it() -> None:
    editor = see(session_with(), f"APPRO part, {F1}{QUIT}{QUIT}")
    form = editor._form()
    assert "".join(text for _, text, *_ in form).startswith(" APPRO location, distance [AT t | IN dt]")
    assert [text for style, text, *_ in form if style] == ["distance"]
