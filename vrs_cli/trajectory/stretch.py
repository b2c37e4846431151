"""Stretches: what a motion does one thing after the other, before it is known when, or with which joints."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from vrs_cli.kinematics.transform import Transform, Vector
from vrs_cli.trajectory.motion import Motion
from vrs_cli.trajectory.polynomial import Polynomial
from vrs_cli.trajectory.segment import Path, Phase, Segment


class ToolStretch(NamedTuple):
    """A stretch of a straight-line motion before its joints are known."""

    duration: float
    phase: Phase
    position: tuple[Polynomial, Polynomial, Polynomial]
    orientation: Transform
    turns: tuple[tuple[Vector, Polynomial], ...]


def segments_of(start: float, motion: Motion, stretches: Iterator[tuple[float, Phase, Path]]) -> tuple[Segment, ...]:
    """Segments one after the other from `start`; those of no duration are left out."""
    segments = []
    for duration, phase, path in stretches:
        if duration > 0.0:
            segments.append(Segment(start, start + duration, path, phase, motion))
            start += duration
    return tuple(segments)
