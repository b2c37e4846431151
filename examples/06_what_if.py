"""What if? Try alternatives on branches of the timeline, compare them, and keep the best."""

import vrs_cli as vrs

r = vrs.Robot()
r.move(0, -45, 180, 0, 45, 0)
away = vrs.trans(300, 450, -200, 90, 90, 0)

with r.what_if("straight"):
    r.moves(away)
    r.moves(away @ vrs.trans(0, 0, -100))

with r.what_if("joints"):
    r.move(away)
    r.move(away @ vrs.trans(0, 0, -100))

print(r.branches, "now on", r.branch, f"{r.end:.3f} s")
found = {}
for name in ("straight", "joints"):
    with r.what_if(name):
        found[name] = r.end
        print(f"{name}: {r.end:.3f} s")

print(r.compare("straight", "joints"))
best = min(found, key=found.__getitem__)
r.merge(best)
print(f"{best} is what the robot does now: {len(r.commands)} motions to {r.end:.3f} s")

# It prints:
#
#   ('main', 'straight', 'joints') now on main 1.133 s
#   straight: 2.920 s
#   joints: 2.445 s
#                       straight      joints      Change
#   Cycle time             2.920       2.445      -0.475  s
#   Tool path           1982.354    1996.533     +14.179  mm
#   Joint travel         341.564     333.765      -7.799  deg
#   Commands                   3           3
#   Segments                   8           8
#
#   Command                                 straight        to    joints        to    Change
#   MOVE #PPOINT(0, -45, 180, 0, 45, 0)        0.000     1.133     0.000     1.133
#   MOVES TRANS(300, 450, -200, 90, 90, 0)     1.133     2.375         -         -
#   MOVES TRANS(300, 450, -100, 90, 90, 0)     2.375     2.920         -         -
#   MOVE TRANS(300, 450, -200, 90, 90, 0)          -         -     1.133     1.925
#   MOVE TRANS(300, 450, -100, 90, 90, 0)          -         -     1.925     2.445
#   The same until 1.133 s. At most 194.116 mm apart, at 1.749 s; joint 6 19.097 deg, at 1.763 s
#   joints is what the robot does now: 3 motions to 2.445 s
