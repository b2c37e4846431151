"""Which part of a pose counts for a robot: all of it for six joints, less for an arm that cannot do all.

An arm that says nothing has the task that fits it (`fitting`). One of four or five joints may have the whole pose count
too: it takes the poses that it can, and refuses the others.
"""

from __future__ import annotations

from enum import Enum

ALL_PARTS = 6
FEWEST = 4  # joints of an arm that may have the whole pose count, though it cannot take every one


class ArmTask(Enum):
    """`value` is the word in a robot file; `counts`: X, Y, Z of the robot's frame and the turns about X, Y, Z of the
    flange. What does not count is not asked for: it may be what the arm makes of it. `counts` of POINT and PLANE is
    for an arm that moves in the plane X Y; `RobotModel.counts` knows the plane of each.
    """

    POSE = "pose"
    POINTING = "pointing"  # the place and where the flange points, not its turn about itself
    UPRIGHT = "upright"  # the place and the turn about the flange's axis, which keeps its direction (a SCARA)
    STEADY = "steady"  # the place, and the tool turned as nearly as the arm can
    POSITION = "position"  # the place alone
    PLANE = "plane"  # the place in the plane of the arm and the turn in it
    POINT = "point"  # the place in the plane of the arm alone

    @property
    def counts(self) -> tuple[bool, ...]:
        return _COUNTS[self]

    @property
    def turns(self) -> bool:
        """Whether any turn counts."""
        return any(self.counts[3:])

    @property
    def size(self) -> int:
        """How many joints it takes to do it everywhere."""
        return FEWEST if self is ArmTask.STEADY else sum(self.counts)

    def suits(self, joints: int) -> bool:
        """Whether an arm of so many joints may have it."""
        if self is ArmTask.STEADY and joints >= ALL_PARTS:
            return False
        return self.size <= joints or (self is ArmTask.POSE and joints >= FEWEST)


_PARTS = {
    ArmTask.POSE: "111111",
    ArmTask.POINTING: "111110",
    ArmTask.STEADY: "111111",  # the turns as far as they can be had
    ArmTask.UPRIGHT: "111001",
    ArmTask.POSITION: "111000",
    ArmTask.PLANE: "110001",
    ArmTask.POINT: "110000",
}
_COUNTS = {task: tuple(letter == "1" for letter in letters) for task, letters in _PARTS.items()}
