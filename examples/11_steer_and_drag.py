"""Targets that arrive one by one: joints to which the robot steers, and a tool that a hand drags."""

from math import cos, sin

import numpy as np

import vrs_cli as vrs

r = vrs.Robot("puma560").move(0, -45, 180, 0, 45, 0).wait()

# a leader arm sends joints 50 times a second; this also works with a robot of `vrs.connect(...)`
home = r.joints
for k in range(150):
    wave = [20 * sin(k / 25), 10 - 10 * cos(k / 25), 0, 0, 0, 0]
    r.steer(home + wave, rate=50)
r.wait()  # until it rests at the last target
print(r)
print("behind the last target", np.abs(r.joints - home - wave).max().round(6), "deg")

# a hand pulls the tool, which follows as far and as fast as the arm can move
begin = r.where().location
for k in range(120):
    held = r.drag(vrs.trans(8 * k, 0, 0) @ begin)
    if k % 40 == 39:
        print(f"{r.now:.2f} s, x {r.where().xyz[0]:.1f} mm", held)
r.wait()
r.undo()  # the whole drag is one command
print([command.text for command in r.commands])

# It prints:
#
#   <Robot puma560: 4 motions to 4.514 s, now 4.514 s, xyz (638.166, 78.9729, -48.4335) mm, oat (-96.3518, 89.4823, 180) deg>
#   behind the last target 0.0 deg
#   5.31 s, x 858.5 mm <Dragged: 102.54 mm and 3.09 deg away: out of reach: too far>
#   6.11 s, x 921.0 mm <Dragged: 350.12 mm and 52.78 deg away: out of reach: too far>
#   6.91 s, x 928.4 mm <Dragged: 662.67 mm and 67.00 deg away: out of reach: too far>
#   ['MOVE #PPOINT(0, -45, 180, 0, 45, 0)', 'STEER', 'STEER', 'STEER']
