"""A wait that nothing can end stops at once in virtual time, and the clock stays where it is."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.engine.wall import ManualWall
from tests.interfaces.programs import load, value
from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.__main__ import main
from vrs_cli.errors import EndlessWait
from vrs_cli.files.timed_lines import parse_signals
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.tasks.limits import Limits
from vrs_cli.language.run.memory import TICK
from vrs_cli.values.results import RunOutcome, RunResult


def message(result: RunResult) -> str:
    assert result.fault is not None
    return result.fault.message


@pytest.mark.parametrize(
    ("condition", "told"),
    [
        ("SIG(1001)", "SIG(1001), which nothing here turns on (SIGNAL 1001, then RETRY)"),
        ("SIG(-1001)", "SIG(-1001), which nothing here turns off (SIGNAL -1001, then RETRY)"),
        ("3", "3, which nothing here turns on (SIGNAL 1003, then RETRY)"),
        ("SIG(2001, 2002)", "SIG(2001, 2002), which nothing here makes true (change that, then RETRY)"),
        ("x > 5 AND STATE(2) == 2", "x > 5 AND STATE(2) == 2, which nothing here makes true (change that, then RETRY)"),
    ],
)
def test_it_says_what_it_waits_for(session: Session, condition: str, told: str) -> None:
    session.perform("x = 1")
    session.perform("SIGNAL 1001" if "-1001" in condition else "SIGNAL -1001")
    load(session, "DRIVE 1, 20", f"WAIT {condition}")
    result = session.execute("main")
    assert message(result) == f"*Endless wait* waits for {told}"
    assert 0.0 <= session.engine.now - session.engine.end <= TICK


def test_after_signal_retry_goes_on(session: Session) -> None:
    load(session, "WAIT SIG(1001)", "x = 1")
    assert session.execute("main").outcome is RunOutcome.FAILED
    session.perform("SIGNAL 1001")
    session.perform("RETRY")
    assert value(session, "x") == 1.0


def test_a_line_of_the_prompt_stops_too(session: Session) -> None:
    with pytest.raises(EndlessWait, match=r"SIG\(1001\), which nothing here turns on \(SIGNAL 1001 first\)"):
        session.perform("WAIT SIG(1001)")
    assert session.engine.now == 0.0


@pytest.mark.parametrize(
    "wait", ["WAIT TIMER(1) > 100", "WAIT TIME > 100", "WAIT SIG(1001) OR TIMER(1) > 100", "WAIT.EVENT , 100"]
)
def test_what_time_ends_is_waited_for(session: Session, wait: str) -> None:
    load(session, "TIMER 1 = 0", wait, "x = 1")
    assert session.execute("main").fault is None
    assert session.engine.now == pytest.approx(100.0, abs=0.06)


def test_an_input_that_comes_and_a_task_that_may_turn_it_on_are_waited_for(session: Session) -> None:
    load(session, "WAIT SIG(1001)", "WAIT SIG(2001)", "t = TIME()")
    load(session, "WAIT.EVENT , 300", "SIGNAL 2001", name="other")
    session.driver.inputs = parse_signals("200, 1001, ON")
    session.perform("PCEXECUTE other")
    assert session.execute("main").fault is None
    assert value(session, "t") == pytest.approx(300.0)


def test_an_arm_that_moves_may_end_it(session: Session) -> None:
    load(session, "DRIVE 1, 90, 10", "WAIT STATE(2) == 2", "x = 1")
    assert session.execute("main").fault is None


def test_tasks_that_wait_for_each_other_wait_in_vain(session: Session) -> None:
    load(session, "WAIT SIG(2001)", "SIGNAL 2002")
    load(session, "WAIT SIG(2002)", "SIGNAL 2001", name="other")
    session.perform("PCEXECUTE other")
    assert "waits for SIG(2001), which nothing here turns on" in message(session.execute("main"))


@pytest.mark.parametrize(
    ("steps", "told"), [(("WAIT.EVENT",), "its event, which no task here sets"), (("DETACH", "ATTACH"), "the robot")]
)
def test_an_event_and_the_robot(session: Session, steps: tuple[str, ...], told: str) -> None:
    load(session, "ATTACH", "WAIT SIG(2001)", name="other")
    load(session, "EXECUTE 1 other", *steps[:1], "WAIT.EVENT , 1", *steps[1:])
    result = session.execute("main")
    assert f"*Endless wait* waits for {told}" in message(result)
    assert session.engine.now <= 1.0


def test_reacte_does_not_mend_it(session: Session) -> None:
    load(session, "REACTE again", "WAIT SIG(1001)")
    load(session, "n = 1", name="again")
    assert "*Endless wait*" in message(session.execute("main"))


def test_in_real_time_somebody_may_come(terminal: RecordingTerminal) -> None:
    wall = ManualWall()
    session = Session(terminal, clock=wall.clock())
    load(session, "WAIT SIG(1001)")
    assert "60 s" in message(session.execute("main", limits=Limits(max_time=60.0)))
    assert wall.seconds >= 60.0


def test_vrs_run_names_the_option_that_helps(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "cell.v2").write_text(".PROGRAM p\nWAIT SIG(1001)\n.END\n")
    assert main(["run", str(tmp_path / "cell.v2")]) == 1
    told = capsys.readouterr().err
    assert "waits for SIG(1001), which nothing here turns on (--signals FILE says when inputs change)" in told
