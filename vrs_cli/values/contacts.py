"""Contacts of an arm, of what it holds, and of what stands around it."""

from __future__ import annotations

from typing import NamedTuple

from msgspec import Struct

from vrs_cli.kinematics.transform import Vector


class ContactSpan(NamedTuple):
    """Two things touch from `begin` to `end` [s]; None: for ever. Links are called base, link 1 and so on, the last one
    hand where it has fingers; what the robot stands on is the floor.
    """

    begin: float
    end: float | None
    first: str
    second: str


class Contact(Struct, frozen=True):
    """The first contact of a motion: at `t` [s] two things touch, at a place in the world [m].

    `depth` [m]: how far they overlap at most in the course of this contact; 0 where they only come nearer than
    PARAMETER CLEARANCE. `needed` [m]: how much farther apart they would have to be.
    """

    t: float
    first: str
    second: str
    place: Vector
    depth: float
    needed: float

    def said(self, when: str = "at") -> str:
        """Return the sentence that reports say; `when`: the word before the time."""
        x, y, z = (1000.0 * one for one in self.place)
        where = f"{when} {self.t:.3f} s near X {x:z.1f} Y {y:z.1f} Z {z:z.1f} mm"
        needed = f"{1000.0 * self.needed:.1f} mm more are needed"
        if self.depth <= 0.0:
            return f"{self.first} comes too near to {self.second} {where}: {needed}"
        return f"{self.first} touches {self.second} {where}, {1000.0 * self.depth:.1f} mm deep: {needed}"
