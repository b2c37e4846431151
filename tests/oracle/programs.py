"""Random VAL-II programs by seed, and what each of their motions is to be.

A program is a list of statements without jumps. Each says its text and what it does to the settings; a motion asks for
a place in numbers, from which the oracle finds out by itself where the arm has to end. A motion that is refused is left
out by the program's error routine, so all that can be executed is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from random import Random

import numpy as np

from tests.oracle.robot import MM, WORDS, Array, Robot, numbers, rotation, shift, trans

HEAD, TAIL = ".PROGRAM trial()\n    REACTE passed.over", ".END\n.PROGRAM passed.over()\n    RETURNE\n.END\n"
FULL = 1.0


@dataclass(frozen=True)
class Speed:
    """As fractions of the nominal speeds, of joints, tool and turn; and whether it stays."""

    fraction: float = FULL
    rotation: float = FULL
    always: bool = True


@dataclass
class Settings:
    """What is in force when a motion is taken."""

    always: Speed = Speed()
    once: Speed | None = None
    acceleration: float = FULL
    rounding: float | None = None  # [m]
    words: dict[int, str] = field(default_factory=dict)
    base: Array = field(default_factory=lambda: np.eye(4))
    tool: Array = field(default_factory=lambda: np.eye(4))

    @property
    def speed(self) -> Speed:
        return self.once or self.always

    def put(self, speed: Speed) -> None:
        self.always, self.once = (speed, None) if speed.always else (self.always, speed)


@dataclass(frozen=True)
class Statement:
    """A line of a program. `change` is what it does to the settings."""

    text: str
    change: Callable[[Settings], None] = lambda _settings: None


@dataclass(frozen=True)
class Motion(Statement):
    """A motion to a pose in the world, to joints, back along the tool, or of one joint; one of the four is there.

    `at`: its time stamp; `relative`: from now. `speed`: that of DRIVE. `sure`: joints inside their ranges lead there,
    and nothing else is asked: it cannot be refused.
    """

    straight: bool = False
    pose: Array | None = None
    joints: Array | None = None
    back: float | None = None
    drive: tuple[int, float] | None = None
    at: float | None = None
    relative: bool = False
    speed: float | None = None
    sure: bool = False


@dataclass
class Writer:
    """Writes one program for a robot."""

    robot: Robot
    random: Random
    settings: Settings = field(default_factory=Settings)  # as it would be without refusals
    statements: list[Statement] = field(default_factory=list)
    moved: int = 0
    certain: bool = False  # whether the arm goes to q, whatever was refused before

    def __post_init__(self) -> None:
        self.q = self.robot.poses["ready"]
        self.timed = self.random.random() < 0.4  # TOOL and BASE stay then: what they are depends on the time
        self.worded = self.random.random() < 0.3
        self.near = self.random.random() < 0.6

    def program(self, motions: int) -> list[Statement]:
        self.frames()
        self.put(*self.profile())
        self.place(self.somewhere(0.15))
        while self.moved < motions:
            self.random.choice((self.set, self.move, self.move, self.move))()
        return self.statements

    def put(self, text: str, change: Callable[[Settings], None] = lambda _settings: None) -> None:
        self.statements.append(Statement(text, change))
        change(self.settings)

    # --- settings ---

    def set(self) -> None:
        """A line that is no motion."""
        r = self.random
        lines: list[Callable[[], None]] = [
            lambda: self.put(*self.profile()),
            lambda: self.put(*self.speed()),
            lambda: self.put(*self.speed()),
            lambda: self.put(*self.rounding()),
            lambda: self.put(*self.acceleration()),
            lambda: self.put(f"DELAY {r.choice((0, 0.1, round(r.uniform(0, 1), 3)))}"),
            lambda: self.put("BREAK"),
            lambda: self.put(r.choice(("OPENI", "CLOSEI", "OPEN", "CLOSE"))),
        ]
        if self.worded:
            lines += [self.word] * 2
        if not self.timed:
            lines.append(self.frames)
        r.choice(lines)()

    def profile(self) -> tuple[str, Callable[[Settings], None]]:
        return f"PARAMETER PROFILE = {self.random.choice(('LSPB', 'SCURVE', 'QUINTIC'))}", lambda _settings: None

    def rounding(self) -> tuple[str, Callable[[Settings], None]]:
        near = self.random.choice((None, 0.0, round(self.random.uniform(0.0, 50.0), 2)))
        text = "DECEL" if near is None else f"{near:g}"
        return f"PARAMETER ROUNDING = {text}", lambda s: setattr(s, "rounding", None if near is None else near * MM)

    def acceleration(self) -> tuple[str, Callable[[Settings], None]]:
        percent = self.random.randint(10, 100)
        return f"ACCEL {percent}", lambda s: setattr(s, "acceleration", percent / 100.0)

    def speed(self) -> tuple[str, Callable[[Settings], None]]:
        r = self.random
        always, turn = r.random() < 0.4, r.choice((None, r.randint(5, 100)))
        word, rotation_text = " ALWAYS" if always else "", "" if turn is None else f", {turn}"
        if r.random() < 0.3:
            mmps = r.randint(20, int(self.robot.tool["linear_speed"] / MM))
            value, text = mmps * MM / self.robot.tool["linear_speed"], f"SPEED {mmps}{rotation_text} MMPS{word}"
        else:
            percent = r.choice((100, r.randint(2, 100)))
            value, text = percent / 100.0, f"SPEED {percent}{rotation_text}{word}"
        return text, lambda s: s.put(Speed(value, value if turn is None else turn / 100.0, always))

    def word(self) -> None:
        place = self.random.randrange(1 if self.robot.n < 6 else 3)
        said = self.random.choice(WORDS[place])
        self.put(said, lambda s: s.words.__setitem__(place, said))

    def frames(self) -> None:
        """TOOL and BASE that every robot can have: along the flange's axis, unless all of a pose counts."""
        r = self.random
        if r.random() < 0.5:
            x, y, tilt = (r.uniform(-50, 50), r.uniform(-50, 50), r.uniform(0, 180)) if self.robot.n == 6 else (0, 0, 0)
            place = [round(v, 2) for v in (x, y, r.uniform(0, 120), 90.0, tilt - 90.0, r.uniform(-180, 180))]
            tool = trans(*place)
            self.put(f"TOOL TRANS({told(place)})", lambda s: setattr(s, "tool", tool))
        if r.random() < 0.5:
            x, y, z, turn = [round(r.uniform(-100, 100), 1) for _ in range(3)] + [r.choice((0, r.randint(-90, 90)))]
            base = (shift(x * MM, y * MM, z * MM) @ rotation("z", np.radians(turn)))[0]
            self.put(f"BASE {x:g}, {y:g}, {z:g}, {turn:g}", lambda s: setattr(s, "base", base))

    # --- motions ---

    def move(self) -> None:
        r = self.random
        straight, kind = r.random() < 0.5, r.random()
        if kind < 0.15:
            self.drive()
        elif kind < 0.3:
            self.depart(straight)
        elif kind < 0.4 and not straight:
            self.place(self.somewhere(0.0))
        elif kind < 0.45:
            self.named(r.choice(("READY", "NEST")))
        elif kind < 0.5:
            self.edge()
        else:
            self.go(straight)

    def drive(self) -> None:
        r = self.random
        joint = r.randrange(self.robot.n)
        unit = MM if self.robot.slides[joint] else np.pi / 180.0
        room = [self.robot.lower[joint] - self.q[joint], self.robot.upper[joint] - self.q[joint]]
        change = round(r.uniform(*room) * r.choice((0.1, 0.5, 0.95)) / unit, 3)
        percent = r.choice((None, r.randint(5, 100)))
        text = f"DRIVE {joint + 1}, {change:.3f}" + ("" if percent is None else f", {percent}")
        self.motion(text, drive=(joint, change * unit), speed=None if percent is None else percent / 100.0)
        self.q = self.q.copy()
        self.q[joint] += change * unit

    def depart(self, straight: bool) -> None:
        back = round(self.random.uniform(-80.0, 80.0), 3)
        self.motion(f"{'DEPARTS' if straight else 'DEPART'} {back:.3f}", straight=straight, back=back * MM)

    def place(self, q: Array) -> None:
        units = np.where(self.robot.slides, MM, np.pi / 180.0)
        values = np.round(q / units, 4)
        self.motion(f"MOVE #PPOINT({told(values)})", joints=values * units, sure=not self.timed)
        self.q = values * units

    def named(self, word: str) -> None:
        self.motion(word, joints=self.robot.poses[word.lower()], sure=not self.timed)
        self.q = self.robot.poses[word.lower()]

    def go(self, straight: bool) -> None:
        """MOVE, MOVES, APPRO or APPROS to a place that some joints reach."""
        r = self.random
        q = self.around(r.choice((0.02, 0.05, 0.1))) if straight or self.near else self.somewhere(0.0)
        flange = self.robot.tip(q[None], self.settings.tool)[0]
        place = [round(v, 6) for v in numbers(np.linalg.inv(self.settings.base) @ flange)]
        pose, word, rest = trans(*place), "MOVES" if straight else "MOVE", ""
        if r.random() < 0.3:
            back = round(r.uniform(-50.0, 50.0), 3)
            pose, word, rest = pose @ shift(0, 0, -back * MM)[0], "APPROS" if straight else "APPRO", f", {back:.3f}"
        inside = bool(((q > self.robot.lower + 1e-3) & (q < self.robot.upper - 1e-3)).all())
        here, there = (self.robot.words(joints)[:2] for joints in (self.q, q))
        same = bool(here) and all(a == b and min(x, y) > 1e-3 for (a, x), (b, y) in zip(here, there, strict=True))
        sure = inside and same and self.certain and not (straight or rest or self.worded or self.timed)
        self.motion(f"{word} TRANS({told(place)}){rest}", straight=straight, pose=pose, sure=sure)
        self.q = q

    def edge(self) -> None:
        """A straight line along an axis of the world, or askew by next to nothing, from a pose that is singular or
        nearly so: a named one, or one with a joint at a special angle."""
        r, robot = self.random, self.robot
        self.named(r.choice(("READY", "NEST")))
        if r.random() < 0.7:
            q = self.around(0.2)
            q[min(r.randrange(robot.n), 4)] = r.choice((0.0, r.choice((1e-3, 1e-6)) * r.uniform(-1, 1), np.pi / 2))
            self.place(np.clip(q, robot.lower, robot.upper))
        self.put("BREAK")
        flange = robot.tip(self.q[None], self.settings.tool)[0]
        way = np.array([r.choice((0.0, 1e-9, 1e-6)) * r.uniform(-1, 1) for _ in range(3)])
        way[r.randrange(3)] = r.uniform(-0.2, 0.2)
        flange[:3, 3] += way
        place = [round(v, 9) for v in numbers(np.linalg.inv(self.settings.base) @ flange)]
        self.put(
            f"SPEED {(speed := r.choice((1, 5, 20, 100)))}", lambda s: s.put(Speed(speed / 100.0, speed / 100.0, False))
        )
        self.motion(f"MOVES TRANS({told(place)})", straight=True, pose=trans(*place))

    def motion(self, text: str, **what: object) -> None:
        r, at, relative = self.random, None, False
        self.moved += 1
        if self.timed and self.moved > 1 and not ("back" in what or "drive" in what) and r.random() < 0.5:
            relative = r.random() < 0.3
            at = round(r.uniform(0.0, 1.0 if relative else 1.0 * self.moved), r.choice((1, 3)))
            text += f" {'IN' if relative else 'AT'} {at:g}"
        self.certain = bool(what.get("sure"))
        self.statements.append(Motion(text, at=at, relative=relative, **what))  # type: ignore[arg-type]

    # --- joints ---

    def somewhere(self, inside: float) -> Array:
        """Joints in their ranges, so far from both ends; now and then one at an end, or at a singular angle."""
        r, robot = self.random, self.robot
        parts = np.array([r.uniform(inside, 1.0 - inside) for _ in range(robot.n)])
        q = robot.lower + parts * (robot.upper - robot.lower)
        if not inside and r.random() < 0.2:
            joint = r.randrange(robot.n)
            q[joint] = r.choice((robot.lower[joint], robot.upper[joint], robot.poses["ready"][joint]))
        return q

    def around(self, part: float) -> Array:
        """Joints no farther than a part of their ranges from where the arm should be."""
        robot = self.robot
        steps = np.array([self.random.uniform(-part, part) for _ in range(robot.n)]) * (robot.upper - robot.lower)
        return np.clip(self.q + steps, robot.lower, robot.upper)


def told(values: object) -> str:
    return ", ".join(f"{v:.9f}".rstrip("0").rstrip(".") for v in values)  # type: ignore[attr-defined]


def text_of(statements: list[Statement]) -> str:
    return "\n".join([HEAD, *(f"    {one.text}" for one in statements), TAIL])
