"""Units and files of programs as a session has them: at the prompt, in tasks that stop and go on, at the end."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.errors import EndOfInput, FileOutside, IllegalValue, UnitNotAttached
from vrs_cli.files.opening import Folder
from vrs_cli.interfaces.session.session import Session


@pytest.fixture
def terminal() -> RecordingTerminal:
    return RecordingTerminal()


@pytest.fixture
def session(terminal: RecordingTerminal, tmp_path: Path) -> Session:
    return Session(terminal, folder=Folder(tmp_path))


def load(session: Session, *lines: str, name: str = "main") -> None:
    found = session.load_text("\n".join([f".PROGRAM {name}()", *lines, ".END", ""]))
    assert not [one for one in found if one.severity.name == "ERROR"], found


def test_a_file_stays_open_from_line_to_line_of_the_prompt(session: Session, tmp_path: Path) -> None:
    for line in ('ATTACH (lun, 4) "DISK"', 'FOPENW (lun) "a.txt"', 'WRITE (lun) "one"', 'WRITE (lun) "two"'):
        session.perform(line)
    session.perform("x = IOSTAT(lun)")
    session.close()
    assert (tmp_path / "a.txt").read_text() == "one\ntwo\n"
    assert session.environment.reference("x").value() == 1.0
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]


def test_a_program_has_none_of_the_units_of_the_prompt(session: Session) -> None:
    session.perform("ATTACH (5)")
    load(session, 'FOPENW (5) "a.txt"')
    fault = session.execute("main").fault
    assert fault is not None
    assert fault.code == UnitNotAttached.code


def test_a_program_that_pauses_goes_on_writing(session: Session, tmp_path: Path) -> None:
    load(
        session,
        "ATTACH (5)",
        'FOPENW (5) "a.txt"',
        'WRITE (5) "one"',
        "PAUSE",
        'WRITE (5) "two"',
        "x = IOSTAT(5)",
    )
    session.execute("main")
    assert (tmp_path / "a.txt").read_text() == "one\n"
    session.converse(session.wait(session.resume()))
    assert (tmp_path / "a.txt").read_text() == "one\ntwo\n"
    assert session.environment.reference("x").value() == 1.0


@pytest.mark.parametrize("again", ["EXECUTE 2 other", "KILL 2"])
def test_what_a_task_has_open_is_closed_when_it_is_cleared(session: Session, tmp_path: Path, again: str) -> None:
    load(session, "ATTACH (5)", 'FOPENA (5) "a.txt"', 'WRITE (5) "one"', "WAIT.EVENT", name="other")
    session.perform("EXECUTE 2 other")
    session.perform("ABORT 2")
    assert (tmp_path / "a.txt").read_text() == "one\n"
    session.perform(again)
    load(session, "ATTACH (5)", 'FDELETE (5) "a.txt"', "x = IOSTAT(5)")
    session.execute("main")
    assert session.environment.reference("x").value() == (1.0 if again == "KILL 2" else -506.0)


def test_a_program_that_ends_leaves_nothing_open(session: Session, tmp_path: Path) -> None:
    load(session, "ATTACH (5)", 'FOPENW (5) "a.txt"', 'WRITE (5) "one"')
    session.execute("main")
    assert (tmp_path / "a.txt").read_text() == "one\n"
    load(session, "WRITE (5) 2", name="later")
    fault = session.execute("later").fault
    assert fault is not None
    assert fault.code == UnitNotAttached.code


@pytest.mark.parametrize(
    "line",
    ["ATTACH (3)", "ATTACH (5.7, 9)", "ATTACH (5, 4)", "ATTACH (9)", 'ATTACH (4) "TCP"', 'ATTACH (5) "TERMINAL"',
     'ATTACH (0) "DISK"', "DETACH (20)", "FCMND (4, 600)",
     'FOPEN (4, 16) "/LOCAL_PORT 1"', 'FOPENR (4) "a"', "FCLOSE (4)", "WRITE (0) 1", "READ (99) x"],
)  # fmt: skip
def test_units_that_there_are_not(session: Session, line: str) -> None:
    with pytest.raises(IllegalValue):
        session.perform(line)


def test_mode_4_wants_a_unit_that_is_free(session: Session) -> None:
    for _ in range(7):
        session.perform("ATTACH (lun, 4)")
    with pytest.raises(UnitNotAttached):
        session.perform("ATTACH (lun, 4)")


def test_the_prompt_names_any_file_and_a_program_none_outside(session: Session, tmp_path: Path) -> None:
    outside = tmp_path.parent / f"{tmp_path.name}-outside.txt"
    outside.write_text("x\n")
    session.perform("ATTACH (5)")
    with pytest.raises(FileOutside):
        session.perform(f'DO FDELETE (5) "{outside}"')
    session.perform(f"FDELETE {outside}")
    assert not outside.exists()


def test_the_terminal_ends(session: Session) -> None:
    def nobody(_question: object) -> str:
        raise EndOfInput("the input has ended")

    session.terminal.ask = nobody  # type: ignore[method-assign]
    load(session, "READ (4) $s", "x = IOSTAT(4)", "y = GETC(4)")
    assert session.execute("main").fault is None
    assert session.environment.reference("x").value() == session.environment.reference("y").value() == -504.0


@pytest.mark.parametrize(
    ("lines", "step", "values"),
    [
        (["A", "B"], "SET p = TRANS(GETC(4), GETC(4), GETC(4))", [65, 13, 66]),
        (["", "", ""], "SET p = TRANS(GETC(4), GETC(4), GETC(4))", [13, 13, 13]),
        (["A"], "SET p = TRANS(GETC(4), GETC(4), GETC(4))", [65, 13, -504]),
        ([], "SET p = TRANS(GETC(4), GETC(4), GETC(4))", [-504, -504, -504]),
        (["AB", "C"], "a = GETC(4)\nSET p = TRANS(GETC(4), GETC(4), GETC(4))", [66, 13, 67]),
        (["A", "B"], "a = GETC(4)\nb = GETC(4)\nc = GETC(4)\nSET p = TRANS(a, b, c)", [65, 13, 66]),
        (["A", "BC"], "FOR i = 1 TO 3\nn[i] = GETC(4)\nEND\nSET p = TRANS(n[1], n[2], n[3])", [65, 13, 66]),
        (
            ["A", "B"],
            "SET p = NULL\nIF 100*GETC(4)+GETC(4)+GETC(4) == 6579 THEN\nSET p = TRANS(1,2,3)\nEND",
            [1, 2, 3],
        ),
    ],
)
def test_a_step_that_takes_characters_and_waits_takes_each_once(
    session: Session, lines: list[str], step: str, values: list[float]
) -> None:
    coming = iter(lines)
    asked: list[object] = []

    def answer(question: object) -> str:
        asked.append(question)
        assert len(asked) < 10, "it asks for ever"
        for line in coming:
            return line
        raise EndOfInput("the input has ended")

    session.terminal.ask = answer  # type: ignore[method-assign]
    load(session, *step.split("\n"), "DECOMPOSE v[1] = p", "v1 = v[1]", "v2 = v[2]", "v3 = v[3]")
    assert session.execute("main").fault is None
    assert [session.environment.reference(f"v{k}").value() for k in (1, 2, 3)] == pytest.approx(values)


def test_status_of_programs_and_tasks(session: Session) -> None:
    load(session, "PAUSE", name="paused")
    session.load_text(".PROGRAM broken()\nIF TRUE THEN\n.END\n")
    session.execute("paused")
    session.perform('x = STATUS("broken")')
    session.perform('y = STATUS("Paused")')
    session.perform("z = TASK(1, 0)")
    session.perform("t = TASK()")
    values = [session.environment.reference(name).value() for name in "xyzt"]
    assert values == [-2.0, 2.0, 5.0, -1.0]


def test_numbers_of_the_system(session: Session) -> None:
    session.perform("x = ID(1)")
    assert session.environment.reference("x").value() == 560.0
    with pytest.raises(IllegalValue):
        session.perform("x = ID(9)")


def test_a_full_disk_does_not_stop_a_program(session: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from vrs_cli.files import atomic

    def full(_stream: object) -> None:
        raise OSError(28, "No space left on device")

    load(session, "ATTACH (5)", 'FOPENW (5) "a.txt"', "WRITE (5) 1", "FCLOSE (5)", "x = IOSTAT(5)")
    monkeypatch.setattr(atomic, "sync", full)
    assert session.execute("main").fault is None
    assert session.environment.reference("x").value() == -502.0
    assert list(tmp_path.iterdir()) == []
