"""A `.vrst` file as docs/trajectory-file.md describes it: every version of the timeline, and the robot on it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from tests.oracle.robot import STEP, Array, about, rates

Json = dict[str, Any]


@dataclass(frozen=True, eq=False)
class Piece:
    """One segment; s is t - t_s."""

    start: float
    finish: float
    phase: str
    motion: Json
    joints: Array | None  # (n, k): ascending powers
    line: Json | None

    @property
    def duration(self) -> float:
        return self.finish - self.start

    @property
    def base(self) -> Array:
        """T_robot_world of its motion."""
        return square(self.motion.get("frames", {}).get("base"))

    @property
    def tool(self) -> Array:
        """T_flange_tool of its motion."""
        return square(self.motion.get("frames", {}).get("tool"))

    def joints_at(self, s: Array, derivative: int = 0) -> Array:
        """(N, n)."""
        assert self.joints is not None
        return np.stack([polynomial(row, s, derivative) for row in self.joints], axis=1)

    def tool_at(self, s: Array) -> Array:
        """(N, 4, 4) T_robot_tool on a straight line; s may be complex."""
        assert self.line is not None
        T = np.tile(np.eye(4, dtype=s.dtype), (len(s), 1, 1))
        T[:, :3, :3] = np.array(self.line["orientation"])[:, :3]
        for turn in self.line["turns"]:
            T[:, :3, :3] = T[:, :3, :3] @ about(np.array(turn["axis"]), polynomial(turn["angle"], s))
        for i, row in enumerate(self.line["position"]):
            T[:, i, 3] = polynomial(row, s)
        return T

    def acceleration_at(self, s: Array) -> Array:
        """(N, 3) of the tool on a straight line."""
        assert self.line is not None
        return np.stack([polynomial(row, s, 2) for row in self.line["position"]], axis=1)

    def twist_at(self, s: Array) -> Array:
        """(N, 6) on a straight line."""
        return rates(self.tool_at(s + 1j * STEP))


@dataclass(frozen=True)
class Edit:
    """One line of the file: the delta, the timeline before it and after it."""

    delta: Json
    motion: Json
    before: list[Piece]
    after: list[Piece]

    @property
    def new(self) -> range:
        """The pieces that it made, as indices of `after`."""
        kept = self.delta["keep"]
        return range(kept, kept + len(self.delta["segments"]))


def edits(path: Path) -> Iterator[Edit]:
    """All edits of a file, in order."""
    header, *lines = map(json.loads, path.read_text().splitlines())
    known: dict[int, Json] = {}
    timeline = [_piece(one, known, {}) for one in header["initial"]]
    for line in lines:
        motion = _motion(line["motion"], known)
        new = [_piece(one, known, motion) for one in line["segments"]]
        keep, cut, shift = line["keep"], line["cut"], line.get("shift", 0.0)
        kept = list(timeline[:keep])
        if kept and kept[-1].finish > cut:
            kept[-1] = replace(kept[-1], finish=cut)
        tail = [replace(p, start=p.start + shift, finish=p.finish + shift) for p in timeline[keep + line["drop"] :]]
        after = kept + new + tail
        yield Edit(line, motion, timeline, after)
        timeline = after


def _motion(told: Any, known: dict[int, Json]) -> Json:
    """A motion that is described, or named by its number."""
    if isinstance(told, int):
        return known[told]
    known[told["number"]] = told
    return dict(told)


def _piece(one: Json, known: dict[int, Json], motion: Json) -> Piece:
    served = _motion(one["motion"], known) if "motion" in one else motion
    joints = np.array(one["joints"]) if "joints" in one else None
    return Piece(one["start"], one["finish"], one["phase"], served, joints, one.get("line"))


def square(rows: Any) -> Array:
    """(4, 4) of the three rows of a file; None is the identity."""
    return np.eye(4) if rows is None else np.vstack((np.array(rows), (0.0, 0.0, 0.0, 1.0)))


def polynomial(row: Any, s: Array, derivative: int = 0) -> Array:
    """(N,): ascending powers, by Horner's rule."""
    for _ in range(derivative):
        row = [k * a for k, a in enumerate(row)][1:]
    found = np.zeros_like(s)
    for a in reversed(row):
        found = found * s + a
    return found
