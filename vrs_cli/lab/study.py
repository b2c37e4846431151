"""Plan and evaluate a user study: determine the order of trials and the end of each trial, and write the results.

Participants drive a robot over a delayed connection. Each participant drives under all conditions (delays), in an order
that differs between participants. This module has no connections and does not wait: its callers report the position of
the tool to `Judge`. `DryRun` is a scripted participant in virtual time.
"""

from __future__ import annotations

import csv
import io
import tomllib
from binascii import crc32
from collections import deque
from collections.abc import Iterator, Mapping
from itertools import pairwise
from math import dist
from pathlib import Path
from random import Random
from typing import NamedTuple

from msgspec import Struct

from vrs_cli.api.robot import Robot
from vrs_cli.errors import FileDamaged, FileError, NonexistentFile, VrsError, did_you_mean
from vrs_cli.files.atomic import sync
from vrs_cli.kinematics.data_reader import PLAIN, POSITIVE, DataReader
from vrs_cli.kinematics.joints import Joints, put_inside
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import Vector
from vrs_cli.lab.delays import random_place
from vrs_cli.net.delay_line import DelayError, DelayWays, parse_delays

TASKS = ("target", "pick")
HOLD = 0.5  # [s] a place counts as reached when the tool has stayed there this long
FARTHER = 4.0  # minimum distance between two successive places, in multiples of the tolerance
MAX_TRIALS = 1000  # maximum number of trials per condition, of conditions, and of participants
TRIES = 1000  # give up after this many random places of which none is far enough from the last one
CONDITION_KEYS = ("name", "forward", "backward")


class Condition(Struct, frozen=True):
    """A condition of the study: a name and the network delays in both directions. The delays are written as in the
    study's file: `gamma 200ms 80ms`."""

    name: str
    forward: str = "0"
    backward: str = "0"

    def ways(self, seed: int) -> DelayWays:
        """Return the network delays of this condition in both directions. `seed`: the seed of random delays."""
        return DelayWays(parse_delays(self.forward), parse_delays(self.backward), seed)


class Study(Struct, frozen=True):
    """A user study, read from its file. `task`: what participants do (see TASKS); `trials`: the number of trials per
    condition; `tolerance`: the distance [m] within which a place counts as reached; `timeout`: the maximum duration of
    a trial [s]; `mark`: a checksum of the study's file, to recognize its results."""

    robot: str
    task: str
    trials: int
    tolerance: float
    timeout: float
    seed: int
    conditions: tuple[Condition, ...]
    mark: str


class Stage(NamedTuple):
    """A step of a trial: bring the tool to a place. `place`: its position in the world [m]; `joints`: joint positions
    that reach it [rad, m].

    `hand`: the state of the hand that is required there, "open" or "closed"; None if it does not matter.
    """

    place: Vector
    joints: Joints
    hand: str | None = None


class StudyTrial(NamedTuple):
    """One trial of a participant. `number`: its number among all trials of the participant, from 1; `stages`: its steps
    in order."""

    number: int
    condition: Condition
    stages: tuple[Stage, ...]


class StudyResult(NamedTuple):
    """The result of a trial: a row in the file of results, which has mm instead of m.

    `reached`: whether the last place was reached in time. `time` [s]: the time from the start of the trial until the
    tool came to the last place, or until the end of the trial if the tool did not come there. `error` [m]: the final
    distance from the last place. `path` [m]: the length of the tool's path. `direct` [m]: the length of straight lines
    from the start through all places. `entries`: how often the tool came within the tolerance of a place; more than
    once per stage means that it overshot.
    """

    reached: bool
    time: float
    error: float
    path: float
    direct: float
    entries: int


def load_study(path: Path) -> Study:
    """Read the TOML file of a study. Raises NonexistentFile, FileError, or FileDamaged for mistakes in the file."""
    try:
        text = path.read_text(encoding="utf-8")
        data = tomllib.loads(text)
    except FileNotFoundError:
        raise NonexistentFile(str(path)) from None
    except OSError as error:
        raise FileError(f"{path}: {error.strerror}") from error
    except (ValueError, RecursionError) as error:
        raise FileDamaged(f"{path}: {error}", "a study is a TOML file") from None
    reader = DataReader(str(path), human=True)
    table = reader.table(data, "the file", ("condition",), ("robot", "task", "trials", "tolerance", "timeout", "seed"))
    task = reader.word(table.get("task", TASKS[0]), "task")
    if task not in TASKS:
        raise reader.wrong("task", f"{task!r} is none", did_you_mean(task, TASKS, f"one of {', '.join(TASKS)}"))
    robot = reader.word(table.get("robot", "puma560"), "robot")
    try:
        load_robot(robot)
    except VrsError as error:
        raise reader.wrong("robot", str(error), "a robot's name (vrs robots), or its TOML or URDF file") from None
    rows = table["condition"]
    if not isinstance(rows, list) or not 1 <= len(rows) <= MAX_TRIALS:
        raise reader.wrong("condition", "is not a list of tables", "write [[condition]] with name, forward, backward")
    conditions = tuple(_condition(reader, row, f"condition {k}") for k, row in enumerate(rows, 1))
    names = [one.name for one in conditions]
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise reader.wrong("condition", f"there are two of the name {twice!r}", "give each a name of its own")
    return Study(
        robot,
        task,
        _whole(reader, table, "trials", 5, 1),
        reader.number(table.get("tolerance", 10.0), "tolerance", POSITIVE) / 1e3,
        reader.number(table.get("timeout", 60.0), "timeout", POSITIVE),
        _whole(reader, table, "seed", 1, 0),
        conditions,
        f"{crc32(text.encode()):08x}",
    )


def _condition(reader: DataReader, row: object, key: str) -> Condition:
    table = reader.table(row, key, ("name",), CONDITION_KEYS[1:])
    texts = {name: reader.word(table.get(name, "0"), f"{key}: {name}") for name in CONDITION_KEYS}
    for way in CONDITION_KEYS[1:]:
        try:
            parse_delays(texts[way])
        except (DelayError, NonexistentFile) as error:
            raise reader.wrong(f"{key}: {way}", error.detail, error.hint) from None
    return Condition(**texts)


def _whole(reader: DataReader, table: Mapping[str, object], name: str, usual: int, least: int) -> int:
    value = reader.number(table.get(name, usual), name, PLAIN)
    if value != int(value) or not least <= value <= MAX_TRIALS:
        raise reader.wrong(name, f"{value:g} is none", f"give a whole number from {least} to {MAX_TRIALS}")
    return int(value)


# --- order of conditions and trials ----------------------------------------------------------------------------------


def latin_order(count: int, participant: int) -> tuple[int, ...]:
    """Return the order of the conditions for a participant (from 1), as indexes from 0. `count`: the number of
    conditions.

    The orders are the rows of a Latin square that is balanced for carry-over effects (E. J. Williams, 1949). For an odd
    count, balance requires twice as many rows; the second half has the same orders backwards.
    """
    row, half = (participant - 1) % count, (participant - 1) // count
    zigzag = [(k + 1) // 2 if k % 2 else -(k // 2) for k in range(count)]  # the steps 0, 1, -1, 2, -2, ...
    order = tuple((row + step) % count for step in zigzag)
    return order[::-1] if count % 2 and half % 2 else order


def pseudonym(participant: int) -> str:
    """Return the name under which a participant appears in the results: P001, P002, ..."""
    return f"P{participant:03d}"


def study_trials(study: Study, participant: int) -> tuple[StudyTrial, ...]:
    """Return all trials of a participant in order. Repeated calls return equal trials. Raises FileDamaged if the
    tolerance is too large for the robot."""
    robot, found = Robot(load_robot(study.robot), units="SI"), list[StudyTrial]()
    for index in latin_order(len(study.conditions), participant):
        random = Random(f"{study.seed} {participant} {index}")
        last: Vector | None = None
        for _ in range(study.trials):
            stages = []
            for hand in (None,) if study.task == "target" else ("closed", "open"):
                last, joints = _far_place(robot, random, last, FARTHER * study.tolerance)
                stages.append(Stage(last, joints, hand))
            found.append(StudyTrial(len(found) + 1, study.conditions[index], tuple(stages)))
    return tuple(found)


def _far_place(robot: Robot, random: Random, last: Vector | None, farther: float) -> tuple[Vector, Joints]:
    """Return a random position of the tool [m] that is at least `farther` [m] from the last one, and the joint
    positions that reach it. Raises FileDamaged if none is found."""
    for _ in range(TRIES):
        joints = random_place(robot.held.arm.model, random)
        x, y, z = robot.fk(joints).xyz.tolist()
        if last is None or dist(last, (x, y, z)) >= farther:
            return (x, y, z), joints
    raise FileDamaged(f"no two places are {1e3 * farther:g} mm apart", "give a smaller tolerance")


# --- when a trial is over --------------------------------------------------------------------------------------------


class Judge:
    """A referee that observes a trial, decides when it is over, and measures its result. `begin`: the start of the
    trial; all times are those of the robot's clock [s]."""

    def __init__(self, study: Study, trial: StudyTrial, begin: float) -> None:
        self._tolerance, self._until = study.tolerance, begin + study.timeout
        self._stages, self._begin, self._stage = trial.stages, begin, 0
        self._last: Vector | None = None
        self._since: float | None = None  # time since which the tool has been at the place of the stage [s], or None
        self._inside = False
        self._path = self._direct = self._error = 0.0
        self._entries, self._now = 0, begin
        self.over = False

    @property
    def stage(self) -> Stage:
        return self._stages[min(self._stage, len(self._stages) - 1)]

    def take(self, t: float, tool: Vector, hand: float) -> None:
        """Record the position of the tool [m] and the opening of the hand (1 open, 0 closed) at the time t [s]."""
        if self._last is None:
            places = [tool, *(stage.place for stage in self._stages)]
            self._direct = sum(dist(a, b) for a, b in pairwise(places))
        else:
            self._path += dist(self._last, tool)
        self._last, self._now = tool, t
        self._error = dist(tool, self.stage.place)
        inside = self._error <= self._tolerance
        self._entries += inside and not self._inside
        self._inside = inside
        done = inside and (self.stage.hand is None or (self.stage.hand == "open") is (hand > 0.5))
        self._since = (t if self._since is None else self._since) if done else None
        if self._since is not None and t - self._since >= HOLD:
            self._stage += 1
            if self._stage == len(self._stages):
                self.over = True
                return
            self._since, self._inside = None, False
        if t >= self._until:
            self.over = True

    def result(self) -> StudyResult:
        """Return the result of the trial, as measured so far."""
        reached = self._stage == len(self._stages)
        time = (self._since if reached and self._since is not None else self._now) - self._begin
        return StudyResult(reached, time, self._error, self._path, self._direct, self._entries)


# --- the file of results ---------------------------------------------------------------------------------------------

COLUMNS = (
    *("study", "participant", "trial", "condition", "task", "x_mm", "y_mm", "z_mm"),
    *("reached", "time_s", "error_mm", "path_mm", "direct_mm", "entries"),
)


class Results:
    """The CSV file with the results of a study: one row per trial, written to disk before the next trial begins.

    If a process was killed while it wrote a row, this row is removed, and its trial is repeated. Raises FileError, or
    FileDamaged if the file is not one of results or has results of another study.
    """

    def __init__(self, path: Path, study: Study) -> None:
        self.path, self._study = path, study
        try:
            data = path.read_bytes() if path.exists() else b""
            whole = data[: data.rfind(b"\n") + 1]
            if whole != data:
                with path.open("r+b") as stream:
                    stream.truncate(len(whole))
        except OSError as error:
            raise FileError(f"{path}: {error.strerror}") from None
        rows = list(csv.reader(io.StringIO(whole.decode("utf-8", "replace"))))
        if rows and tuple(rows[0]) != COLUMNS:
            raise FileDamaged(f"{path} holds no results of a study", "give another file with --out")
        if any(len(row) != len(COLUMNS) or not row[2].isdecimal() for row in rows[1:]):
            raise FileDamaged(f"{path} has a row that is none of a study", "give another file with --out")
        if other := next((row[0] for row in rows[1:] if row[0] != study.mark), None):
            hint = "the file of the study was changed: give another file with --out"
            raise FileDamaged(f"{path} has results of another study ({other}, not {study.mark})", hint)
        self._rows = [(row[1], int(row[2])) for row in rows[1:]]
        if not rows:
            self._append(COLUMNS)

    def finished_trials(self, participant: int) -> frozenset[int]:
        """Return the numbers of the trials that a participant has finished."""
        return frozenset(number for name, number in self._rows if name == pseudonym(participant))

    def next_participant(self, trials: int) -> int:
        """Return the lowest number of a participant who has not finished all trials. `trials`: the number of trials of
        each participant."""
        return next(number for number in range(1, MAX_TRIALS + 1) if len(self.finished_trials(number)) < trials)

    def add(self, participant: int, trial: StudyTrial, it: StudyResult) -> None:
        """Append the row for the result `it` of a trial, and wait until it is on disk. Raises FileError."""
        name, target = pseudonym(participant), trial.stages[-1].place
        lengths = (f"{1e3 * x:.1f}" for x in (it.error, it.path, it.direct))
        self._append(
            (
                *(self._study.mark, name, str(trial.number), trial.condition.name, self._study.task),
                *(f"{1e3 * x:.1f}" for x in target),
                *(str(int(it.reached)), f"{it.time:.3f}", *lengths, str(it.entries)),
            )
        )
        self._rows.append((name, trial.number))

    def _append(self, row: tuple[str, ...]) -> None:
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerow(row)
        try:
            with self.path.open("ab") as stream:
                stream.write(text.getvalue().encode())
                sync(stream)
        except OSError as error:
            raise FileError(f"{self.path}: {error.strerror}") from None


# --- a scripted participant ------------------------------------------------------------------------------------------

TICK = 0.05  # [s] time step of the simulation
REACTION = (0.6, 1.4)  # [s] range of the participant's random reaction time
# standard deviation of the participant's aim: a fraction of each joint's travel, plus a constant [rad, m]
MISSES, TREMBLES = 0.04, 0.001
STILL = 1e-9  # [rad, m] the robot counts as at rest if no joint has changed by more than this from frame to frame


class DryRun:
    """A scripted participant in virtual time. The participant sees the robot with the backward delay D_b, waits until
    it is at rest, and commands the next stage of the trial; the command arrives after the forward delay D_f."""

    def __init__(self, study: Study, participant: int) -> None:
        self._study, self._random = study, Random(f"{study.seed} {participant} hands")
        self._robot = Robot(load_robot(study.robot), units="SI")
        self._t = 0.0

    def do(self, trial: StudyTrial) -> StudyResult:
        begin = self._t
        judge = Judge(self._study, trial, begin)
        forward, backward = trial.condition.ways(self._study.seed).lines(trial.number)
        frames, commands = (
            deque[tuple[float, Joints]](),
            deque[tuple[float, Joints, str | None]](),
        )  # frames and commands on their way, each with its arrival time [s]
        before: Joints | None = None
        seen: Joints | None = None
        ready = begin
        while not judge.over:
            while commands and commands[0][0] <= self._t:
                self._command(*commands.popleft())
            here = self._robot.where(self._t)
            x, y, z = here.xyz.tolist()
            judge.take(self._t, (x, y, z), float(here.hand))
            arrived = backward.arrival(self._t)
            frames.append((arrived, tuple(here.joints.tolist())))
            while frames and frames[0][0] <= self._t:
                before, seen = seen, frames.popleft()[1]
            at_rest = (
                before is not None
                and seen is not None
                and max(abs(a - b) for a, b in zip(before, seen, strict=True)) < STILL
            )
            if at_rest and self._t >= ready and seen is not None:
                arrival, model = forward.arrival(self._t), self._robot.held.arm.model
                ways = zip(seen, judge.stage.joints, strict=True)
                aim = tuple(b + self._random.gauss(0.0, MISSES * abs(b - a) + TREMBLES) for a, b in ways)
                commands.append((arrival, put_inside(aim, model.lower, model.upper), judge.stage.hand))
                ready = arrival + (arrived - self._t) + self._random.uniform(*REACTION)
            self._t += TICK
        return judge.result()

    def _command(self, t: float, aim: Joints, hand: str | None) -> None:
        """Execute a command that arrives at the time t [s]: move to the joint positions `aim`, then operate the
        hand."""
        robot = self._robot
        if t > robot.now:
            robot.do(f"DELAY {t - robot.now:.6f}")
        robot.move(aim)
        if hand is not None:
            robot.do("OPENI" if hand == "open" else "CLOSEI")


def results_summary(path: Path) -> Iterator[tuple[str, int, float, float | None, float]]:
    """Yield, for each condition in a file of results: its name, the number of trials, the fraction of trials that
    reached the last place, their mean time [s] (None if there are none), and the mean error of all trials [mm].

    Raises FileError.
    """
    try:
        rows = list(csv.DictReader(path.read_text(encoding="utf-8").splitlines()))
    except OSError as error:
        raise FileError(f"{path}: {error.strerror}") from None
    for name in dict.fromkeys(row["condition"] for row in rows):
        some = [row for row in rows if row["condition"] == name]
        times = [float(row["time_s"]) for row in some if row["reached"] == "1"]
        mean = sum(times) / len(times) if times else None
        yield name, len(some), len(times) / len(some), mean, sum(float(row["error_mm"]) for row in some) / len(some)
