"""Programs run without an engine: a robot that stands still, and a driver that only writes down what it is asked."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from vrs_cli.errors import VrsError
from vrs_cli.kinematics.joints import Arm, Configuration, Elbow, Joints, Wrist
from vrs_cli.kinematics.transform import IDENTITY, Transform, translation
from vrs_cli.language.analysis.analyzer import analyze
from vrs_cli.language.run.effects import CycleBegins, Event, Failed, Halt, Pause, ProgramCompleted, Prompt, Type, Wait
from vrs_cli.language.run.environment import Environment
from vrs_cli.language.run.runtime import Task
from vrs_cli.language.text.ast import Program
from vrs_cli.language.text.parser import parse_file

TICK = 0.028
POSE = translation(0.5, 0.1, -0.2)


@dataclass
class StillRobot:
    """Answers what it was told; the clock moves in `WAIT` only."""

    now: float = 0.0
    pose: Transform = POSE
    end: Transform = IDENTITY
    angles: Joints = (0.0, -1.0, 1.0, 0.0, 0.5, 0.0)
    opening: float = 0.0
    settings: dict[str, float | str] = field(default_factory=lambda: {"HAND.TIME": 0.05, "PROFILE": "LSPB"})
    off: set[str] = field(default_factory=set)
    dof: int = 6

    def here(self) -> Transform:
        return self.pose

    def destination(self) -> Transform:
        return self.end

    def joints(self) -> Joints:
        return self.angles

    destination_joints = joints

    def tool(self) -> Transform:
        return translation(0, 0, 0.1)

    def base(self) -> Transform:
        return IDENTITY

    def hand(self) -> float:
        return self.opening

    def time(self) -> float:
        return self.now

    def speed(self, number: int) -> float:
        return 10.0 * number

    def acceleration(self) -> float:
        return 100.0

    def configuration(self, joints: Joints) -> Configuration:
        return Configuration(Arm.RIGHTY, Elbow.ABOVE, Wrist.FLIP if joints[4] < 0.0 else Wrist.NOFLIP)

    def place(self, joints: Joints) -> Transform:
        return translation(joints[0], 0, 0)

    def solve(self, T_world_tool: Transform, near: Joints, asked: Configuration | None) -> tuple[Joints, int]:
        return near, int(asked is not None and T_world_tool is not self.pose)

    def state(self, number: int) -> float:
        return float(number)

    def moving(self) -> bool:
        return False

    def switch(self, name: str) -> bool:
        return name not in self.off

    def parameter(self, name: str) -> float | str:
        return self.settings[name]

    def in_range(self, place: Transform | Joints) -> int:
        return 0 if isinstance(place, Transform) else 4


def environment_with(text: str, seed: int = 0) -> Environment:
    """An environment with the programs of a text, every one of them free of errors."""
    environment = Environment(seed)
    file, faults = parse_file(text)
    assert not faults, faults
    programs = {part.key: part for part in file.parts if isinstance(part, Program)}
    for program in programs.values():
        analysis = analyze(program, {}, programs)
        assert analysis.executable, analysis.diagnostics
        environment.store(analysis, tuple(text.split("\n")))
    return environment


def program(*lines: str, name: str = "main", parameters: str = "") -> str:
    """The text of a program."""
    return "\n".join([f".PROGRAM {name}({parameters})", *lines, ".END", ""])


@dataclass
class Run:
    """What became of a task: every event, and the environment after it."""

    events: list[Event]
    environment: Environment
    task: Task

    @property
    def last(self) -> Event:
        return self.events[-1]

    @property
    def error(self) -> VrsError:
        assert isinstance(self.last, Failed), self.last
        return self.last.error

    @property
    def typed(self) -> str:
        """All that TYPE printed."""
        return "".join(e.text + "\n" * e.newline for e in self.events if isinstance(e, Type))

    @property
    def requests(self) -> Sequence[Event]:
        """What was asked of the robot and the terminal, without the frame of the cycle."""
        return [e for e in self.events[:-1] if not isinstance(e, CycleBegins)][:-1]

    def value(self, name: str) -> object:
        return self.environment.reference(name).value()


def wait(event: Wait, robot: StillRobot) -> None:
    """Let the clock go on until the condition is true."""
    robot.now += event.ticks * TICK
    while not event.condition():
        robot.now += TICK


def drive(task: Task, robot: StillRobot, answers: Iterable[str] = (), most: int = 10_000) -> list[Event]:
    """Events until the task stops; waits are waited for, prompts answered in turn."""
    waiting, answer = list(answers), None
    events: list[Event] = []
    while len(events) < most:
        event = task.resume(answer)
        events.append(event)
        answer = waiting.pop(0) if isinstance(event, Prompt) else None
        if isinstance(event, Wait):
            try:
                wait(event, robot)
            except VrsError as error:
                events.append(task.throw(error))
                break
        elif isinstance(event, ProgramCompleted | Failed | Halt | Pause):
            break
    return events


def run(
    text: str,
    answers: Sequence[str] = (),
    robot: StillRobot | None = None,
    main: str = "main",
    cycles: int = 1,
    step: int = 1,
) -> Run:
    """Run a program of a text."""
    robot = robot or StillRobot()
    environment = environment_with(text)
    task = Task(environment, robot, main, (), cycles, step)
    return Run(drive(task, robot, answers), environment, task)


def run_lines(*lines: str, answers: Sequence[str] = (), robot: StillRobot | None = None) -> Run:
    """Run a program of these lines."""
    return run(program(*lines), answers, robot)
