"""Contacts of an arm, of what it holds, and of what stands around it."""

from __future__ import annotations

from msgspec import Struct

from vrs_cli.kinematics.transform import Vector


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

    def said(self) -> str:
        """Return the sentence that reports say."""
        where = ", ".join(f"{1000.0 * x:z.1f}" for x in self.place)
        needed = f"{1000.0 * self.needed:.1f} mm more are needed"
        if self.depth <= 0.0:
            return f"{self.first} comes too near to {self.second} at {self.t:.3f} s, at {where}: {needed}"
        deep = f"{1000.0 * self.depth:.1f} mm deep"
        return f"{self.first} touches {self.second} at {self.t:.3f} s, at {where}, {deep}: {needed}"
