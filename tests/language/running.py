"""Programs run without an engine: a robot that stands still, and a driver that only writes down what it is asked."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

from vrs_cli.engine.settings import Setting
from vrs_cli.errors import VrsError
from vrs_cli.kinematics.joints import Arm, Configuration, Elbow, Joints, Wrist
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import IDENTITY, Transform, translation
from vrs_cli.language.analysis.analyzer import analyze
from vrs_cli.language.run.effects import CycleBegins, Event, Failed, Halt, Pause, ProgramCompleted, Prompt, Type, Wait
from vrs_cli.language.run.environment import Environment
from vrs_cli.language.run.runtime import Task
from vrs_cli.language.text.ast import Program
from vrs_cli.language.text.parser import parse_file
from vrs_cli.values.commands import Frames, SetSpeed
from vrs_cli.values.results import Position

TICK = 0.028
POSE = translation(0.5, 0.1, -0.2)
STILL = (0.0,) * 6
SPEEDS = Setting(SetSpeed(20.0), SetSpeed(30.0))
MODEL = load_robot("puma560")
FRAMES = Frames(IDENTITY, translation(0, 0, 0.1))


@dataclass
class StillSettings:
    """Settings of a robot that stands still: all switches are on but those that are `off`."""

    parameters: dict[str, float | str] = field(default_factory=lambda: {"HAND.TIME": 0.05, "PROFILE": "LSPB"})
    off: set[str] = field(default_factory=set)
    acceleration: float = 1.0
    monitor_speed: float = 10.0
    speed: Setting[SetSpeed] = SPEEDS

    def switch(self, name: str) -> bool:
        return name not in self.off

    def parameter(self, name: str) -> float | str:
        return self.parameters[name]


@dataclass
class StillRobot:
    """Stands for the engine of a PUMA 560, and answers what it was told; the clock moves in `WAIT` only."""

    now: float = 0.0
    pose: Transform = POSE
    goal: Transform = IDENTITY
    angles: Joints = (0.0, -1.0, 1.0, 0.0, 0.5, 0.0)
    settings: Any = field(default_factory=StillSettings)
    end: float = 0.0
    model: RobotModel = MODEL
    frames: Frames = FRAMES

    @property
    def arm(self) -> StillRobot:
        return self

    def position(self) -> Position:
        return Position(self.now, self.angles, STILL, STILL, self.pose, 0.0, False, "")

    def destination(self, t: float) -> Position:
        return Position(t, self.angles, STILL, STILL, self.goal, 0.0, False, "")

    def configuration(self, joints: Joints) -> Configuration:
        return Configuration.of(Arm.RIGHTY, Elbow.ABOVE, Wrist.FLIP if joints[4] < 0.0 else Wrist.NOFLIP)

    def world_pose(self, joints: Joints) -> Transform:
        return translation(joints[0], 0, 0)

    def joints_for(self, _place: Transform, near: Joints = (), _way: Configuration | None = None) -> Joints:
        return near or self.angles


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
