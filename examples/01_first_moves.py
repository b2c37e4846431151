"""First moves: a motion, another motion in the middle of it, and the position of the robot at any time."""

import vrs_cli as vrs

r = vrs.Robot("puma560")
r.move(0, -45, 180, 0, 45, 0)  # joints [degrees]; this takes 1.1 s of the robot's time, but none of yours
r.moves(vrs.trans(300, 450, -200, 90, 90, 0), at=1.0)  # a straight line from 1.0 s on, before the first ends

print(r)
print(r.where(1.0))
print(r.where(r.end).xyz.round(3))

for command in r.commands:
    print(f"{command.executed:.3f} to {command.end:.3f} s: {command.text}")

r.undo()  # the first motion is whole again
print(f"{r.end:.3f}")

# It prints:
#
#   <Robot puma560: 2 motions to 2.168 s, now 1.133 s, xyz (605.452, 162.996, -64.0456) mm, oat (-90, 87.8211, 180) deg>
#   Posture at 1.000 s: joints (0, -46.6, 176.8, 0, 43.4, 0) deg, xyz (646.847, 149.09, -6.1725) mm, oat (90, 83.6, 0) deg
#   [ 300.  450. -200.]
#   0.000 to 1.000 s: MOVE #PPOINT(0, -45, 180, 0, 45, 0)
#   1.000 to 2.168 s: MOVES TRANS(300, 450, -200, 90, 90, 0) AT 1
#   1.133
