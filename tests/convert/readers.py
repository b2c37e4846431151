"""Read what `vrs convert` writes, with a reader for each language: text to operations. They share no code with the
writers.

A reader knows the written subset, and refuses every other line. Joints are in degrees (mm if one slides), poses are 4x4
matrices in metres in the present frame.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

Matrix = np.ndarray
NUMBER = r"-?\d+(?:\.\d+)?"


@dataclass
class Joints:
    """A joint motion; `speed` as the language writes it."""

    joints: list[float]
    speed: list[float]
    blend: float = 0.0  # [m]


@dataclass
class Line:
    pose: Matrix
    speed: list[float]
    blend: float = 0.0
    more: list[float] = field(default_factory=list)  # a seventh joint
    confdata: list[int] = field(default_factory=list)


@dataclass
class Frames:
    tool: Matrix
    base: Matrix


@dataclass
class Output:
    """A change of an output, or (None) of the hand; `delay`: after the begin of the next motion [s]."""

    number: int | None
    on: bool
    delay: float = 0.0


@dataclass
class Input:
    number: int
    on: bool


@dataclass
class Wait:
    seconds: float


Operation = Joints | Line | Frames | Output | Input | Wait


class NotRead(Exception):
    """A line that no reader knows."""


def matrix(rotation: Matrix, xyz: list[float]) -> Matrix:
    result = np.eye(4)
    result[:3, :3], result[:3, 3] = rotation, xyz
    return result


def about(axis: int, degrees: float) -> Matrix:
    """Return a rotation about the axis 0, 1 or 2."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    result = np.eye(3)
    result[i, i] = result[j, j] = c
    result[i, j], result[j, i] = -s, s
    return result


def of_quaternion(w: float, x: float, y: float, z: float) -> Matrix:
    assert abs(w * w + x * x + y * y + z * z - 1.0) < 1e-6
    v = np.array([x, y, z])
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) * (w * w - v @ v) + 2.0 * np.outer(v, v) + 2.0 * w * K


def of_rotation_vector(x: float, y: float, z: float) -> Matrix:
    angle = math.sqrt(x * x + y * y + z * z)
    if angle == 0.0:
        return np.eye(3)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]) / angle
    return np.eye(3) + math.sin(angle) * K + (1.0 - math.cos(angle)) * K @ K


# --- URScript ---------------------------------------------------------------------------------------------------------


def read_urscript(text: str) -> list[Operation]:
    lines = [line.strip() for line in text.splitlines() if line.strip() and not line.strip().startswith("#")]
    assert re.fullmatch(r"def [A-Za-z]\w*\(\):", lines[0])
    assert lines[1:4] == ["def hand(opens):", "set_tool_digital_out(0, opens)", "end"]
    assert lines[-1] == "end"
    tool, base, found = np.eye(4), np.eye(4), list[Operation]()
    body = iter(lines[4:-1])
    for line in body:
        if (m := re.fullmatch(r"set_tcp\((p\[.*\])\)", line)) or (n := re.fullmatch(r"base = (p\[.*\])", line)):
            tool, base = (_ur_pose(m[1]), base) if m else (tool, _ur_pose(n[1]))
            found.append(Frames(tool, base))
        elif m := re.fullmatch(r"movej\(\[(.*)\], a=(.*), v=(.*?)(?:, r=(.*))?\)", line):
            q = [math.degrees(float(x)) for x in m[1].split(",")]
            assert len(q) == 6
            found.append(Joints(q, [float(m[2]), float(m[3])], float(m[4] or 0.0)))
        elif m := re.fullmatch(r"movel\(pose_trans\(base, (p\[.*?\])\), a=(.*), v=(.*?)(?:, r=(.*))?\)", line):
            found.append(Line(_ur_pose(m[1]), [float(m[2]), float(m[3])], float(m[4] or 0.0)))
        elif m := re.fullmatch(r"set_(standard|configurable)_digital_out\(([0-7]), (True|False)\)", line):
            found.append(Output(int(m[2]) + (1 if m[1] == "standard" else 9), m[3] == "True"))
        elif m := re.fullmatch(r"hand\((True|False)\)", line):
            found.append(Output(None, m[1] == "True"))
        elif m := re.fullmatch(r"while get_(standard|configurable)_digital_in\(([0-7])\) != (True|False):", line):
            assert [next(body), next(body)] == ["sync()", "end"]
            found.append(Input(int(m[2]) + (1001 if m[1] == "standard" else 1009), m[3] == "True"))
        elif m := re.fullmatch(rf"sleep\(({NUMBER})\)", line):
            found.append(Wait(float(m[1])))
        else:
            raise NotRead(line)
    return found


def _ur_pose(text: str) -> Matrix:
    x, y, z, *turn = (float(number) for number in text.removeprefix("p[").removesuffix("]").split(","))
    return matrix(of_rotation_vector(*turn), [x, y, z])


# --- KRL --------------------------------------------------------------------------------------------------------------


def read_krl(text: str) -> list[Operation]:
    lines = [line.strip() for line in text.splitlines() if line.strip() and not line.strip().startswith(";")]
    assert re.fullmatch(r"DEF [A-Za-z]\w{0,23}\(\)", lines[0])
    assert (lines[1], lines[-1]) == ("SIGNAL HAND $OUT[1000]", "END")
    known, percent = {"$TOOL": "", "$BASE": "", "$VEL.CP": "", "$VEL.ORI1": "", "$APO.CDIS": "0"}, 0.0
    found, tool, base = list[Operation](), np.eye(4), np.eye(4)
    for line in lines[2:-1]:
        if line == "BAS(#INITMOV, 0)":
            continue
        if m := re.fullmatch(r"BAS\(#VEL_PTP, (\d+)\)", line):
            percent = float(m[1])
            assert 1.0 <= percent <= 100.0
        elif (m := re.fullmatch(r"(\$[\w.]+) = (.*)", line)) and m[1] in known:
            known[m[1]] = m[2]
            if m[1] in ("$TOOL", "$BASE"):
                frame, _ = _krl_frame(m[2])
                tool, base = (frame, base) if m[1] == "$TOOL" else (tool, frame)
                found.append(Frames(tool, base))
        elif m := re.fullmatch(r"PTP (\{A1 .*\})( C_DIS)?", line):
            found.append(Joints(list(_krl_pairs(m[1]).values()), [percent], _krl_blend(m[2], known)))
        elif m := re.fullmatch(r"LIN (\{X .*\})( C_DIS)?", line):
            pose, more = _krl_frame(m[1])
            speed = [float(known["$VEL.CP"]), float(known["$VEL.ORI1"])]
            found.append(Line(pose, speed, _krl_blend(m[2], known), more))
        elif m := re.fullmatch(
            r"(?:TRIGGER WHEN DISTANCE=0 DELAY=(\d+) DO )?(HAND|\$OUT\[(\d+)\]) = (TRUE|FALSE)", line
        ):
            number = None if m[2] == "HAND" else int(m[3])
            found.append(Output(number, m[4] == "TRUE", float(m[1] or 0) / 1000.0))
        elif m := re.fullmatch(r"WAIT FOR (NOT )?\$IN\[(\d+)\]", line):
            found.append(Input(1000 + int(m[2]), m[1] is None))
        elif m := re.fullmatch(rf"WAIT SEC ({NUMBER})", line):
            found.append(Wait(float(m[1])))
        else:
            raise NotRead(line)
    return found


def _krl_blend(c_dis: str | None, known: dict[str, str]) -> float:
    return float(known["$APO.CDIS"]) / 1000.0 if c_dis else 0.0


def _krl_pairs(text: str) -> dict[str, float]:
    pairs = (pair.split() for pair in text.strip("{}").split(","))
    return {name: float(value) for name, value in pairs}


def _krl_frame(text: str) -> tuple[Matrix, list[float]]:
    it = _krl_pairs(text)
    turn = about(2, it["A"]) @ about(1, it["B"]) @ about(0, it["C"])
    return matrix(turn, [it[name] / 1000.0 for name in "XYZ"]), [it["E1"]] if "E1" in it else []


# --- RAPID ------------------------------------------------------------------------------------------------------------


def read_rapid(text: str) -> list[Operation]:
    lines = [line.strip() for line in text.splitlines() if line.strip() and not line.strip().startswith("!")]
    assert re.fullmatch(r"MODULE [A-Za-z]\w{0,31}", lines[0])
    assert lines[-2:] == ["ENDPROC", "ENDMODULE"]
    begin = lines.index("PROC main()")
    data = dict(_rapid_data(lines[1:begin]))
    found, frames = list[Operation](), None
    for line in lines[begin + 1 : -2]:
        if line == "ConfL \\Off;":
            continue
        if m := re.fullmatch(r"(MoveAbsJ|MoveL) (\w+), (\w+), (\w+), (\w+)\\WObj:=(\w+);", line):
            target, speed = data[m[2]], data[m[3]]
            zone = [True, 0.0] if m[4] == "fine" else data[m[4]]
            blend = 0.0 if zone[0] else zone[1] / 1000.0
            assert speed[0] > 0.0
            now = Frames(_rapid_pose(data[m[5]][1]), _rapid_pose(data[m[6]][3]))
            assert np.allclose(_rapid_pose(data[m[6]][4]), np.eye(4))
            if frames is None or not (np.allclose(frames.tool, now.tool) and np.allclose(frames.base, now.base)):
                found.append(now)
                frames = now
            more = [value for value in target[-1] if value != 9e9]
            if m[1] == "MoveAbsJ":
                found.append(Joints([*target[0], *more], speed, blend))
            else:
                found.append(Line(_rapid_pose(target[:2]), speed, blend, more, target[2]))
        elif m := re.fullmatch(r"SetDO do(Hand|\d+), ([01]);", line):
            found.append(Output(None if m[1] == "Hand" else int(m[1]), m[2] == "1"))
        elif m := re.fullmatch(r"WaitDI di(\d+), ([01]);", line):
            found.append(Input(1000 + int(m[1]), m[2] == "1"))
        elif m := re.fullmatch(rf"WaitTime ({NUMBER});", line):
            found.append(Wait(float(m[1])))
        else:
            raise NotRead(line)
    return found


def _rapid_data(lines: list[str]) -> Iterator[tuple[str, Any]]:
    """Return names and values of declarations. Aggregates are JSON apart from TRUE, FALSE and 9E9."""
    for line in lines:
        m = re.fullmatch(r"(PERS|CONST) (\w+) (\w+) := (.*);", line)
        if m is None or (m[1] == "PERS") is not (m[2] in ("tooldata", "wobjdata")):
            raise NotRead(line)
        yield m[3], json.loads(m[4].replace("TRUE", "true").replace("FALSE", "false"))


def _rapid_pose(pose: list[list[float]]) -> Matrix:
    xyz, rotation = pose
    return matrix(of_quaternion(*rotation), [x / 1000.0 for x in xyz])


# --- Python -----------------------------------------------------------------------------------------------------------


def read_python(text: str) -> list[Operation]:
    """Read a Python program, without the times of motions; outputs are in the order of the text."""
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    assert lines[0] == "from vrs_cli import Robot, trans"
    assert re.fullmatch(r'robot = Robot\(".*", start=\[.*\].*\)', lines[1])
    found, tool, base = list[Operation](), np.eye(4), np.eye(4)
    for line in lines[2:]:
        if m := re.fullmatch(r"robot\.moves\(trans\((.*?)\).*\)", line):
            found.append(Line(_trans(m[1]), []))
        elif m := re.fullmatch(r"robot\.move\((.*?)(?:, (?:speed|at)=.*)?\)", line):
            found.append(Joints([float(x) for x in m[1].split(",")], []))
        elif m := re.fullmatch(r"robot\.do\('TOOL TRANS\((.*)\)'\)", line):
            tool = _trans(m[1])
            found.append(Frames(tool, base))
        elif m := re.fullmatch(r"robot\.do\('BASE (.*)'\)", line):
            x, y, z, turn = (float(number) for number in m[1].split(","))
            base = matrix(about(2, turn), [x / 1000.0, y / 1000.0, z / 1000.0])
            found.append(Frames(tool, base))
        elif m := re.fullmatch(r"robot\.do\('(OPEN|CLOSE).*'\)", line):
            found.append(Output(None, m[1] == "OPEN"))
        elif m := re.fullmatch(r"robot\.do\('SIGNAL (-?)(\d+)(?: AT .*)?'\)", line):
            found.append(Output(int(m[2]), not m[1]))
        elif m := re.fullmatch(r"robot\.do\('WAIT SIG\((-?)(\d+)\)'\)", line):
            found.append(Input(int(m[2]), not m[1]))
        elif m := re.fullmatch(rf"robot\.do\('DELAY ({NUMBER})'\)", line):
            found.append(Wait(float(m[1])))
        elif not re.fullmatch(r"robot\.wait\(\)|robot\.do\('(DO SPEED|PARAMETER|ACCEL|DURATION) .*'\)", line):
            raise NotRead(line)
    return found


def _trans(numbers: str) -> Matrix:
    """Return the pose of O, A and T of VAL-II: Rz(O) and an axis change, Ry(A), Rz(T)."""
    x, y, z, o, a, t = (float(number) for number in numbers.split(","))
    oat_zero = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]])
    return matrix(about(2, o) @ oat_zero @ about(1, a) @ about(2, t), [x / 1000.0, y / 1000.0, z / 1000.0])


READERS = {"urscript": read_urscript, "krl": read_krl, "rapid": read_rapid, "python": read_python}


def corners(operations: list[Operation]) -> list[float]:
    """Return the blends of the motions that go on without a stop."""
    return [a.blend for a, _ in pairwise([*operations, None]) if isinstance(a, Joints | Line)]
