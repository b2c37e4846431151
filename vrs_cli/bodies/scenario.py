"""Disturbances of a simulated body, and the scenario files that name them.

A scenario is a TOML file of [[push]], [[payload]], [[block]], [[slip]], [[stop]] and [[drift]] tables. The same words
are typed while a body runs: `push force = [0, 40, 0] for = 0.2`.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar, NamedTuple

from msgspec import Struct

from vrs_cli.errors import FileDamaged, FileError, NonexistentFile, did_you_mean
from vrs_cli.kinematics.data_reader import LENGTH, PLAIN, POSITIVE, DataReader
from vrs_cli.kinematics.joints import JointKind
from vrs_cli.kinematics.transform import Vector

MAX_DISTURBANCES = 10_000  # of a scenario


class Disturbance(Struct, frozen=True, tag_field="kind"):
    """What happens to a body: from `at` [s] of the robot's clock (None: at once) for `lasting` seconds (None: on)."""

    word: ClassVar[str]
    at: float | None = None
    lasting: float | None = None


class Push(Disturbance, frozen=True, tag="push"):
    """A force on the flange [N], in the robot's frame; or a torque at a joint, counted from 1 [N m, N]."""

    word: ClassVar[str] = "push"
    force: Vector = (0.0, 0.0, 0.0)
    joint: int = 0
    torque: float = 0.0


class Payload(Disturbance, frozen=True, tag="payload"):
    """A load that the flange carries, of which the controller knows nothing: mass [kg] and its centre [m], in the
    frame of the flange.
    """

    word: ClassVar[str] = "payload"
    mass: float = 0.0
    centre: Vector = (0.0, 0.0, 0.0)


class BlockedJoint(Disturbance, frozen=True, tag="block"):
    """A joint, counted from 1, that does not move from where it is."""

    word: ClassVar[str] = "block"
    joint: int = 1


class SlippingBrake(Disturbance, frozen=True, tag="slip"):
    """A brake of a joint, counted from 1, that holds this torque and no more [N m, N]."""

    word: ClassVar[str] = "slip"
    joint: int = 1
    torque: float = 0.0


class EmergencyStop(Disturbance, frozen=True, tag="stop"):
    """The body stops by itself: its motors are off, its brakes on."""

    word: ClassVar[str] = "stop"


class ClockDrift(Disturbance, frozen=True, tag="drift"):
    """The body's clock gains `rate` [s/s], and jumps by `jump` [s] when it begins."""

    word: ClassVar[str] = "drift"
    rate: float = 0.0
    jump: float = 0.0


class Release(Struct, frozen=True):
    """An end of all disturbances of a kind now; of all where there is none."""

    kind: type[Disturbance] | None = None


KINDS: dict[str, type[Disturbance]] = {
    kind.word: kind for kind in (Push, Payload, BlockedJoint, SlippingBrake, EmergencyStop, ClockDrift)
}
RELEASE = "release"
PAIR = re.compile(r"(\w+)\s*=\s*(\[[^\]]*\]|\S+)")


class Scenario(NamedTuple):
    """What happens to a body, and the seed of its noise."""

    disturbances: tuple[Disturbance, ...] = ()
    seed: int = 0


def load_scenario(path: Path, kinds: tuple[JointKind, ...]) -> Scenario:
    """Read a scenario for a robot with joints of these kinds. Raises NonexistentFile, FileError, FileDamaged."""
    reader = ScenarioReader(str(path), human=True)
    table = reader.table(load_toml(path, "a scenario"), "the file", (), ("seed", *KINDS))
    seed = table.get("seed", 0)
    if isinstance(seed, bool) or not isinstance(seed, int) or not 0 <= seed < 2**32:
        raise reader.wrong("seed", f"{seed!r} is none", "give a whole number from 0 to 4294967295")
    found = list[Disturbance]()
    for word in KINDS:
        rows = table.get(word, [])
        if not isinstance(rows, list) or len(rows) > MAX_DISTURBANCES:
            raise reader.wrong(word, "is not a list of tables", f"write [[{word}]], at most {MAX_DISTURBANCES}")
        found += [reader.disturbance(word, row, f"{word} {i}", kinds) for i, row in enumerate(rows, 1)]
    if timeless := next((one for one in found if one.at is None), None):
        raise reader.wrong(timeless.word, "has no at", "give the second of the robot's clock when it begins")
    return Scenario(tuple(found), seed)


def load_toml(path: Path, what: str) -> Mapping[str, object]:
    """Return the tables of a TOML file. Raises NonexistentFile, FileError, FileDamaged."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise NonexistentFile(str(path)) from None
    except OSError as error:
        raise FileError(f"{path}: {error.strerror}") from error
    except (ValueError, RecursionError) as error:
        raise FileDamaged(f"{path}: {error}", f"{what} is a TOML file") from None


def read_command(line: str, kinds: tuple[JointKind, ...]) -> Disturbance | Release:
    """Read what somebody types: `payload mass = 2 centre = [0, 0, 100]`, `release payload`. Raises FileDamaged."""
    word, _, rest = line.strip().partition(" ")
    reader = ScenarioReader("body", human=True)
    if word == RELEASE:
        if rest.strip() not in ("", *KINDS):
            raise reader.wrong(RELEASE, f"{rest.strip()!r} is none", f"give one of {', '.join(KINDS)}, or nothing")
        return Release(KINDS.get(rest.strip()))
    if word not in KINDS:
        raise reader.wrong(word or "a line", "is no word", did_you_mean(word, KINDS, _known()))
    left = PAIR.sub("", rest).strip(" ,")
    try:
        table = tomllib.loads("\n".join(f"{key} = {value.rstrip(',')}" for key, value in PAIR.findall(rest)))
    except ValueError:
        left = rest.strip()
        table = {}
    if left:
        raise reader.wrong(word, f"{left!r} is not read", f"write it as {word} {_example(word)}".rstrip())
    return reader.disturbance(word, table, word, kinds)


def _known() -> str:
    return f"known here: {', '.join(KINDS)}, {RELEASE}"


def _example(word: str) -> str:
    return {
        "push": "force = [0, 40, 0] for = 0.2",
        "payload": "mass = 2",
        "block": "joint = 3",
        "slip": "joint = 2 torque = 20",
        "stop": "for = 5",
        "drift": "rate = 1e-4",
    }[word]


class ScenarioReader(DataReader):
    """Makes disturbances of tables: millimetres, newtons, kilograms, seconds."""

    def disturbance(self, word: str, data: object, key: str, kinds: tuple[JointKind, ...]) -> Disturbance:
        keys = [name for name in KINDS[word].__struct_fields__ if name not in ("at", "lasting")]
        table = self.table(data, key, (), ("at", "for", *keys))
        times = {
            field: self.number(table[name], f"{key}: {name}", POSITIVE if name == "for" else PLAIN)
            for name, field in (("at", "at"), ("for", "lasting"))
            if name in table
        }
        match KINDS[word]:
            case kind if kind is Push:
                force = self.three(table, "force", key)
                joint = self.joint(table, key, kinds) if "joint" in table else 0
                torque = self.figure(table, "torque", key)
                if not (any(force) or (joint and torque)):
                    raise self.wrong(key, "pushes nothing", "give force = [x, y, z] in N, or joint and torque")
                return Push(**times, force=force, joint=joint, torque=torque)
            case kind if kind is Payload:
                mass = self.figure(table, "mass", key)
                if not mass > 0.0:
                    raise self.wrong(key, "has no mass", "give mass in kg, above 0")
                return Payload(**times, mass=mass, centre=self.three(table, "centre", key))
            case kind if kind is BlockedJoint:
                return BlockedJoint(**times, joint=self.joint(table, key, kinds))
            case kind if kind is SlippingBrake:
                torque = self.figure(table, "torque", key)
                if torque < 0.0:
                    raise self.wrong(f"{key}: torque", f"{torque:g} is below zero", "give it without a sign")
                return SlippingBrake(**times, joint=self.joint(table, key, kinds), torque=torque)
            case kind if kind is EmergencyStop:
                return EmergencyStop(**times)
            case _:
                rate, jump = self.figure(table, "rate", key), self.figure(table, "jump", key)
                if abs(rate) >= 1.0:
                    raise self.wrong(f"{key}: rate", f"{rate:g} is no clock", "give seconds a second, as 1e-4")
                return ClockDrift(**times, rate=rate, jump=jump)

    def figure(self, table: Mapping[str, object], name: str, key: str) -> float:
        return self.number(table.get(name, 0.0), f"{key}: {name}", PLAIN)

    def three(self, table: Mapping[str, object], name: str, key: str) -> Vector:
        quantity = LENGTH if name == "centre" else PLAIN
        right = f"give [x, y, z]{self.in_unit(quantity)}"
        x, y, z = self.listed(table.get(name, [0.0, 0.0, 0.0]), f"{key}: {name}", [quantity] * 3, right)
        return x, y, z

    def joint(self, table: Mapping[str, object], key: str, kinds: tuple[JointKind, ...]) -> int:
        joint = table.get("joint")
        if isinstance(joint, bool) or not isinstance(joint, int) or not 1 <= joint <= len(kinds):
            raise self.wrong(f"{key}: joint", f"{joint!r} is none of this robot", f"give 1 to {len(kinds)}")
        return joint
