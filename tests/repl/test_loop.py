"""The shell on a pipe: `echo WHERE | vrs`."""

import signal
from collections.abc import Iterator
from io import StringIO
from pathlib import Path

import pytest

from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.tasks.limits import Limits
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.repl import shell
from vrs_cli.repl.interrupt import Ended, ending
from vrs_cli.repl.loop import PlainTerminal
from vrs_cli.repl.shell import Local
from vrs_cli.repl.shell import on_pipe as run
from vrs_cli.values.results import RunOutcome


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def pipe(*lines: str, file: str | None = None) -> tuple[int, list[str]]:
    """The exit status, and what was written."""
    sink = StringIO()
    status = run(Local(load_robot("puma560"), file), [f"{line}\n" for line in lines], sink)
    return status, sink.getvalue().splitlines()


def test_nothing_but_the_answers() -> None:
    status, written = pipe("", "; a note", "a = 2", "LISTR a*3")
    assert (status, written) == (0, ["a*3              6"])


def test_a_wrong_line_gives_the_status_and_does_not_stop() -> None:
    status, written = pipe("MOVF a", "LISTR 5")
    assert status == 1
    assert written[0].startswith("*Illegal monitor command* MOVF")
    assert written[-1].split() == ["5", "5"]


@pytest.mark.parametrize(
    "line", ["MOVE nowhere", "LOAD nowhere", "EXECUTE nowhere", "ZERO", "MOVE 5", "EXECUTE bad", "READY AT -1"]
)
def test_every_kind_of_failure_gives_the_status(line: str) -> None:
    assert pipe(".PROGRAM bad", "a = nothing", ".END", line)[0] == 1


def test_a_warning_is_no_failure() -> None:
    status, written = pipe(".PROGRAM p", "a = nothing", ".END")
    assert status == 0
    assert written[0].startswith("warning:")


@pytest.mark.parametrize("word", ["EXIT", "QUIT", "exit"])
def test_exit_ends_the_input(word: str) -> None:
    assert pipe(word, "MOVF a") == (0, [])


def test_types_messages_and_errors_in_their_order() -> None:
    _, written = pipe(".PROGRAM p", 'TYPE "one"', "PAUSE", 'TYPE "two"', "a = b", ".END", "EXECUTE p", "PROCEED")
    told = [line for line in written if not line.startswith((" ", "warning"))]
    assert told == [
        "Program p: 4 steps",
        "one",
        "(PAUSED)",
        "Program stopped at p, step 2",
        "two",
        "*Undefined value* b (b = ... gives it a value)",
        "Program stopped at p, step 4",
    ]


def test_prompt_reads_the_lines_that_follow() -> None:
    status, written = pipe(".PROGRAM p", 'PROMPT "n? ", n', ".END", "EXECUTE p", "5", "LISTR n")
    assert (status, written[-1].split()) == (0, ["n", "5"])


def test_a_line_that_is_no_answer_to_prompt_is_a_command() -> None:
    """The program stops, and eats none of what follows."""
    status, written = pipe(
        ".PROGRAM p", 'PROMPT "n? ", n', ".END", "EXECUTE p", "a = 1", "LISTR a", "RETRY", "5", "LISTR n"
    )
    assert status == 1
    assert written[1:] == [
        "n? ",
        "*Invalid number format* a = 1 (a number is wanted, such as -12.5)",
        "Program stopped at p, step 1",
        '    PROMPT "n? ", n',
        "a                1",
        "n? ",
        "Program completed",
        "n                5",
    ]


def test_a_line_that_is_no_answer_to_a_question_is_a_command() -> None:
    status, written = pipe("a = 1", "DELETER a", "LISTR a", "DELETER a", "Y", "LISTR a")
    assert status == 1
    asked = "a will be deleted. Are you sure (Y/N)?"
    refused = "*Not confirmed* nothing is deleted (DISABLE INTERACTIVE deletes without a question)"
    assert written[:4] == [asked, refused, "a                1", asked]
    assert written[4].startswith("*Undefined value* a")


def test_prompt_at_the_end_of_the_input_fails_the_program() -> None:
    status, written = pipe(".PROGRAM p", 'PROMPT "How many?", n', ".END", "EXECUTE p")
    assert status == 1
    assert "How many?*Unexpected end of file* PROMPT 'How many?' has nothing more to read" in written[1]
    assert "error" not in " ".join(written).lower().replace("unexpected", "")


def test_a_byte_order_mark_is_no_part_of_the_first_line() -> None:
    assert pipe("\ufeffLISTR 5") == (0, ["5                5"])


class Interrupting(StringIO):
    """Ctrl-C is pressed when a program types BUSY."""

    def write(self, text: str) -> int:
        if "BUSY" in text:
            signal.raise_signal(signal.SIGINT)
        return super().write(text)


@pytest.mark.parametrize("line", ["EXECUTE p", "CALL p", "COMMANDS all.pc"])
def test_ctrl_c_ends_the_input_and_gives_the_status(folder: Path, line: str) -> None:
    (folder / "all.pc").write_text("EXECUTE p\nLISTR 6\n")
    sink = Interrupting()
    lines = [".PROGRAM p", 'TYPE "BUSY"', "WAIT SIG(1001)", ".END", line, "LISTR 7"]
    assert run(Local(load_robot("puma560"), None), [f"{line}\n" for line in lines], sink) == 1
    last = sink.getvalue().splitlines()[2:]
    assert last == (["interrupted"] if line == "CALL p" else ["(ABORTED)", "Program stopped at p, step 1"])


def test_a_second_ctrl_c_breaks_off_what_does_not_stop() -> None:
    """It comes as an exception in the middle of a step; nothing of the program may run on."""
    session = Session(PlainTerminal(StringIO(), iter([])))
    session.load_text(".PROGRAM p\nTYPE 1\n.END\n")

    def broken(_text: str, _newline: bool) -> None:
        raise KeyboardInterrupt

    typed, session.terminal.type = session.terminal.type, broken  # type: ignore[method-assign]
    with pytest.raises(KeyboardInterrupt):
        session.execute("p")
    session.terminal.type = typed  # type: ignore[method-assign]
    assert session.execute("p").outcome is RunOutcome.COMPLETED
    session.perform("READY")


def test_a_refused_program_swallows_its_lines() -> None:
    status, written = pipe(".PROGRAM p", "a = 1", ".END", ".PROGRAM p", "a = 2", ".END", "EXECUTE p", "LISTR a")
    assert status == 1
    assert written[1] == "Program p exists. Replace it (Y/N)?"
    assert written[2].startswith("*Program already exists* p")
    dropped = "*Request refused* 1 line of p dropped: that program was refused (.END ends it)"
    assert written[3:] == [dropped, dropped, "Program completed", "a                1"]


def test_the_input_ends_inside_a_program() -> None:
    status, written = pipe(".PROGRAM p", "a = 1")
    assert (status, written) == (1, ["the input ended: p is not stored (.END would have ended it)"])


def test_a_file_is_loaded_first(folder: Path) -> None:
    (folder / "my cell.v2").write_text(".PROGRAM p\nTYPE 1\n.END\n")
    assert pipe("EXECUTE p", file="my cell") == (0, ["my cell.v2 loaded: p", " 1", "Program completed"])
    assert pipe("WHERE", file="nowhere")[0] == 1


def test_whatever_is_piped_in_no_exception_leaves(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_arguments: object) -> None:
        raise RecursionError("too deep")

    monkeypatch.setattr(Session, "answers", broken)
    status, (line,) = pipe("WHERE")
    assert status == 1
    assert line.startswith("internal error: RecursionError: too deep; please report it with ")
    Path(line.rsplit(" ", 1)[1]).unlink()


def test_main_takes_the_pipe_where_there_is_no_terminal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.stdin", StringIO("LISTR 7\n"))
    assert shell.run(Local()) == 0
    assert capsys.readouterr().out.split() == ["7", "7"]


def test_another_robot(folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    source = (Path(shell.__file__).parents[1] / "kinematics" / "robots" / "puma560.toml").read_text()
    (folder / "mine.toml").write_text(source.replace('name = "puma560"', 'name = "mine"'))
    monkeypatch.setattr("sys.stdin", StringIO("ID\n"))
    assert shell.run(Local(load_robot("mine.toml"))) == 0
    assert "(mine)" in capsys.readouterr().out


def test_a_signal_that_ends_the_process_stops_the_program_and_the_lines_after_it() -> None:
    def lines() -> Iterator[str]:
        yield "DRIVE 1, 10, 100\n"
        signal.raise_signal(signal.SIGTERM)
        yield "DRIVE 1, 10, 100\n"

    sink = StringIO()
    with pytest.raises(Ended) as ended, ending():
        run(Local(load_robot("puma560"), None), lines(), sink)
    assert ended.value.status == 143


def test_a_signal_in_a_line_is_obeyed_after_it() -> None:
    class Sink(StringIO):
        def write(self, text: str) -> int:
            if "begins" in text:
                signal.raise_signal(signal.SIGTERM)
            return super().write(text)

    sink = Sink()
    source = ['DO TYPE "begins"\n', "EXECUTE main\n", "WHERE\n"]
    with pytest.raises(Ended), ending():
        run(Local(load_robot("puma560"), None), source, sink)
    assert "JT1" not in sink.getvalue()


def test_a_task_that_ends_with_the_shell_is_told() -> None:
    program = (".PROGRAM ever", "10 WAIT.EVENT 0, 1", "GOTO 10", ".END", "EXECUTE 5 ever()")
    told = "task 5, ever, ends with the shell at step 1"
    assert pipe(*program)[1][1:] == [told]
    assert pipe(*program, "EXIT")[1][1:] == [told]
    assert told not in pipe(*program, "ABORT 5")[1]


def test_an_endless_program_on_a_pipe_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vrs_cli.repl.local_robot.OWN", Limits(max_steps=1000))
    status, written = pipe(".PROGRAM ever", "10 GOTO 10", ".END", "EXECUTE ever")
    assert status == 1
    assert "still running after 1000 steps" in written[1]
