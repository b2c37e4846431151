"""A task from its first step to its end: cycles, stops, errors, single steps, and the line at the prompt."""

from __future__ import annotations

import sys

import pytest

from tests.language.running import StillRobot, drive, environment_with, program, run, run_lines
from vrs_cli.errors import (
    ArgumentMismatch,
    ArithmeticOverflow,
    IllegalValue,
    LocationOutOfRange,
    StackOverflow,
    UndefinedName,
)
from vrs_cli.language.run.effects import (
    CYCLE_SETTINGS,
    Budget,
    CycleBegins,
    Failed,
    Halt,
    Pause,
    ProgramCompleted,
    TaskState,
    Type,
)
from vrs_cli.language.run.environment import Environment
from vrs_cli.language.run.runtime import MAX_CALL_DEPTH, Task
from vrs_cli.values.commands import Break, Move, SetSpeed

MOST_OF_CALL, MOST_OF_ARGUMENT = 30, 1  # calls of functions, those written in C too


def task_of(*lines: str, cycles: int = 1, step: int = 1) -> Task:
    return Task(environment_with(program(*lines)), StillRobot(), "main", (), cycles, step)


def state(task: Task) -> TaskState:
    """The state now."""
    return task.state


# --- cycles ---


def test_a_cycle_begins_with_the_standard_settings_and_ends_at_rest() -> None:
    events = run_lines("x = 1").events
    assert events == [CycleBegins(1, CYCLE_SETTINGS), Break(), ProgramCompleted(1)]
    assert CYCLE_SETTINGS[0] == SetSpeed(100.0, 100.0, always=True)


def test_cycles_are_counted_and_variables_stay() -> None:
    result = run(program("IF NOT DEFINED(n) THEN", "  n = 0", "END", "n = n+1", "TYPE n"), cycles=3)
    assert result.typed == " 1\n 2\n 3\n"
    assert result.last == ProgramCompleted(3)
    assert [event.cycle for event in result.events if isinstance(event, CycleBegins)] == [1, 2, 3]


def test_only_the_first_cycle_begins_at_the_step_asked_for() -> None:
    assert run(program('TYPE "a"', 'TYPE "b"'), cycles=2, step=2).typed == "b\na\nb\n"


@pytest.mark.parametrize("word", ["STOP", "RETURN"])
def test_stop_and_return_end_the_cycle(word: str) -> None:
    result = run(program('TYPE "a"', word, 'TYPE "b"'), cycles=2)
    assert (result.typed, result.last) == ("a\na\n", ProgramCompleted(2))


def test_stop_in_a_called_program_ends_the_cycle_too() -> None:
    text = program("CALL sub", 'TYPE "not here"') + program("STOP", name="sub")
    result = run(text)
    assert (result.typed, result.last, result.task.stack) == ("", ProgramCompleted(1), ())


def test_a_negative_number_of_cycles_is_for_ever() -> None:
    task = task_of("x = 1", cycles=-1)
    events = drive(task, StillRobot(), most=100)
    assert len(events) == 100
    assert task.cycles_done >= 30


@pytest.mark.parametrize("cycles", [0, 32768])
def test_numbers_of_cycles_that_do_not_exist(cycles: int) -> None:
    with pytest.raises(IllegalValue, match=str(cycles)):
        task_of("x = 1", cycles=cycles)


@pytest.mark.parametrize("step", [0, 3, -1])
def test_steps_that_do_not_exist(step: int) -> None:
    with pytest.raises(IllegalValue, match="steps 1 to 2"):
        task_of("x = 1", "x = 2", step=step)


def test_an_empty_program_completes() -> None:
    assert run(program()).last == ProgramCompleted(1)
    assert run(program("", "; nothing")).last == ProgramCompleted(1)


# --- calls ---


def test_ten_thousand_programs_may_call_one_another() -> None:
    text = program("n = 0", f"CALL down({MAX_CALL_DEPTH - 1})", "TYPE n")
    text += program("n = n+1", "IF k > 0 THEN", "  CALL down(k-1)", "END", name="down", parameters="k")
    assert run(text).typed == f" {MAX_CALL_DEPTH}\n"


def test_recursion_without_end_is_stopped() -> None:
    error = run(program("CALL main")).error
    assert isinstance(error, StackOverflow)
    assert "main" in str(error)


def test_a_missing_program_has_a_near_name() -> None:
    error = run(program("CALL pikc") + program(name="pick")).error
    assert str(error) == "*Undefined program or variable name* program pikc (did you mean pick?)"


def test_the_stack_is_named_from_the_main_program() -> None:
    text = program("", "CALL sub") + program("x = 1", "PAUSE", name="sub")
    result = run(text)
    assert (result.last, result.task.program, result.task.step) == (Pause(), "sub", 2)
    assert result.task.stack == (("main", 2), ("sub", 2))
    assert (result.task.program, result.task.step) == ("sub", 2)
    assert result.task.uses("MAIN")
    assert not result.task.uses("other")


def test_arguments_of_the_main_program() -> None:
    text = program("TYPE a+b", "b = 9", parameters="a, b")
    environment = environment_with(text)
    b = environment.reference("kept")
    b.assign(2.0)
    task = Task(environment, StillRobot(), "main", (1.0, b))
    drive(task, StillRobot())
    assert b.value() == 9.0
    with pytest.raises(ArgumentMismatch, match="3 arguments"):
        Task(environment, StillRobot(), "main", (1.0, 2.0, 3.0))


def test_a_task_of_a_program_that_is_not_there() -> None:
    with pytest.raises(UndefinedName, match="nothing"):
        Task(Environment(), StillRobot(), "nothing")


# --- stops ---


def test_pause_goes_on_at_the_next_step() -> None:
    task = task_of('TYPE "a"', "PAUSE", 'TYPE "b"')
    first = drive(task, StillRobot())
    assert isinstance(first[-1], Pause)
    assert isinstance(first[-2], Break)
    assert state(task) is TaskState.PAUSED
    second = drive(task, StillRobot())
    assert second == [Type("b"), Break(), ProgramCompleted(1)]
    assert state(task) is TaskState.COMPLETED


def test_halt_is_the_end() -> None:
    task = task_of("HALT", 'TYPE "b"', cycles=5)
    events = drive(task, StillRobot())
    assert events[-2:] == [Break(), Halt()]
    assert (task.program, task.step) == ("main", 1)
    assert task.is_over
    assert task.resume() == Halt()


def test_the_last_event_is_given_again() -> None:
    task = task_of("x = 1")
    drive(task, StillRobot())
    assert task.resume() == task.resume() == ProgramCompleted(1)


def test_an_abort_can_be_gone_on_from() -> None:
    task = task_of("10 x = 1", "GOTO 10")
    task.resume()
    assert isinstance(task.resume(budget=5), Budget)
    task.abort()
    assert state(task) is TaskState.ABORTED
    assert isinstance(task.resume(budget=5), Budget)
    assert state(task) is TaskState.RUNNING


# --- errors ---


def test_an_error_is_placed() -> None:
    text = "; a comment\n" + program("CALL sub") + program("y = 0", "  x = 5/y ; here", name="sub")
    result = run(text)
    assert isinstance(result.last, Failed)
    fault = result.last.fault
    assert (fault.program, fault.step, fault.line, fault.source) == ("sub", 2, 7, "x = 5/y ; here")
    assert (fault.code, fault.text) == (ArithmeticOverflow.code, "Arithmetic overflow")
    assert fault.message == "*Arithmetic overflow* division by zero"
    assert result.task.fault == fault


def test_after_an_error_the_next_step_can_be_gone_on_with() -> None:
    task = task_of("x = nothing", 'TYPE "on"')
    assert isinstance(drive(task, StillRobot())[-1], Failed)
    assert drive(task, StillRobot())[0] == Type("on")


def test_after_an_error_the_step_can_be_repeated() -> None:
    environment = environment_with(program("FOR i = 1 TO 2", "  TYPE i", "  x = n+i", "END"))
    task = Task(environment, StillRobot(), "main")
    assert isinstance(drive(task, StillRobot())[-1], Failed)
    environment.reference("n").assign(10.0)
    task.retry()
    events = drive(task, StillRobot())
    assert events == [Type(" 2"), Break(), ProgramCompleted(1)]
    assert environment.reference("x").value() == 12.0


def test_a_motion_that_cannot_be_done_is_an_error_of_its_step() -> None:
    task = task_of("x = 1", "MOVE #PPOINT(0)", 'TYPE "on"')
    task.resume()
    assert isinstance(task.resume(), Move)
    failed = task.throw(LocationOutOfRange("too far"))
    assert isinstance(failed, Failed)
    assert (failed.fault.code, failed.fault.step, failed.fault.source) == (-610, 2, "MOVE #PPOINT(0)")
    task.retry()
    assert isinstance(task.resume(), Move)
    assert isinstance(task.throw(LocationOutOfRange()), Failed)
    assert task.resume() == Type("on")


def test_the_settings_of_a_cycle_may_fail_too() -> None:
    task = task_of("x = 1")
    task.resume()
    failed = task.throw(IllegalValue("speed"))
    assert isinstance(failed, Failed)
    assert failed.fault.step == 1


def test_an_error_in_the_arguments_belongs_to_the_call() -> None:
    text = program("", "CALL sub(1, 2)") + program(name="sub", parameters="a, b")
    environment = environment_with(text)
    environment.store(environment_with(program(name="sub", parameters="a")).program("sub").analysis)
    failed = drive(Task(environment, StillRobot(), "main"), StillRobot())[-1]
    assert isinstance(failed, Failed)
    assert isinstance(failed.error, ArgumentMismatch)
    assert (failed.fault.program, failed.fault.step) == ("main", 2)


# --- steps ---


def test_a_program_can_be_stepped() -> None:
    task = task_of("x = 1", "", "IF x == 1 THEN", '  TYPE "yes"', "END", "x = 2")
    task.resume()
    places = []
    while not isinstance(event := task.resume(budget=1), ProgramCompleted):
        if isinstance(event, Budget):
            places.append(task.step)
    assert places == [1, 3, 4, 6]
    assert task.steps_done == 4


def test_a_loop_without_end_gives_way() -> None:
    task = task_of("10 GOTO 10")
    task.resume()
    assert [type(task.resume(budget=100)) for _ in range(3)] == [Budget] * 3
    assert task.steps_done == 300


def test_a_loop_of_calls_gives_way() -> None:
    text = program("10 CALL sub", "GOTO 10") + program("x = 1", name="sub")
    task = Task(environment_with(text), StillRobot(), "main")
    task.resume()
    assert isinstance(task.resume(budget=100), Budget)
    assert task.steps_done == 100


def calls_of(passes: int, line: str, called: str) -> int:
    """The functions that Python calls for a line in a loop."""
    loop = program(f"FOR i = 1 TO {passes}", line, "END")
    task, calls = Task(environment_with(loop + called), StillRobot(), "main"), 0

    def count(_frame: object, event: str, _argument: object) -> None:
        nonlocal calls
        calls += event in ("call", "c_call")

    task.resume(budget=3)
    before = sys.getprofile()
    sys.setprofile(count)
    try:
        drive(task, StillRobot())
    finally:
        sys.setprofile(before)
    return calls


def test_a_call_costs_few_calls_of_python() -> None:
    def cost(line: str, called: str) -> float:
        return (calls_of(200, line, called) - calls_of(100, line, called)) / 100

    assert cost("CALL sub", program(name="sub")) <= MOST_OF_CALL
    six = cost("CALL sub(i, i, i, i, x, y)", program("t = p+q", name="sub", parameters="p, q, r, s, t, u"))
    assert six <= MOST_OF_CALL + 6 * MOST_OF_ARGUMENT


def test_a_real_passed_by_value_is_no_transformation() -> None:
    error = run(program("CALL sub(3)") + program("HERE place", name="sub", parameters="place")).error
    assert isinstance(error, ArgumentMismatch)
    assert str(error).endswith("place of sub: the argument is not a transformation (a transformation is wanted)")


COUNTED = (
    "n = 0",
    "FOR i = 1 TO 4",
    "  n = n+i",
    "  IF n > 3 THEN",
    "    CALL half(n)",
    "  ELSE",
    "    a[7] = n",
    "    a[7] = a[7]+1",
    "  END",
    "END",
    "TYPE n, a[7]",
    "n = 3",
    "WHILE n > 0 DO",
    "  n = n-1",
    "  m = 1/n",
    "  k = n",
    "END",
)


@pytest.mark.parametrize("budget", [1, 2, 3, 7, 50])
def test_the_budget_changes_neither_steps_nor_what_they_do(budget: int) -> None:
    """Steps are counted in the compiled program: where it is suspended, where an error occurs, and in calls."""
    found = []
    for size in (10_000, budget):
        text = program(*COUNTED) + "\n.PROGRAM half(x)\n  x = x/2\n.END\n"
        task = Task(environment_with(text), StillRobot(), "main")
        events = []
        while not isinstance(event := task.resume(budget=size), Failed | ProgramCompleted):
            if not isinstance(event, Budget):
                events.append(event)
        found.append((events, task.steps_done, task.stack, task.step, task.fault))
    assert found[0] == found[1]
    *_, fault = found[0]
    assert fault is not None
    assert (fault.step, fault.code) == (15, ArithmeticOverflow.code)
