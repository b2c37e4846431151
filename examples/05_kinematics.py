"""A study of the workspace: how well can the arm move at each place of a grid?"""

import numpy as np

import vrs_cli as vrs

r = vrs.Robot()
x, y = np.meshgrid(np.linspace(-900, 900, 37), np.linspace(-900, 900, 37))
places = vrs.trans(x.ravel(), y.ravel(), -200, 0, 90, 0)  # 1369 locations with the tool pointing down

ways = r.ik(places)  # joints (1369, 8, 6), nan where there is no solution
print(ways)
reached = ways.usable.any(axis=1)
print(f"{reached.mean():.0%} of the places are in reach, in {ways.usable[reached].sum(axis=1).mean():.1f} ways")

q = ways.best[reached]
assert np.allclose(r.fk(q).xyz, places.xyz[reached])

J = r.in_units("SI").jacobian(np.radians(q))  # (N, 6, 6) [m/rad, 1]
manipulability = np.abs(np.linalg.det(J))  # Yoshikawa (1985)
best = manipulability.argmax()
print("best at", places.xyz[reached][best].round(), f"{manipulability[best]:.3f}")

print(r.why(vrs.trans(1200, 0, -200, 0, 90, 0)))

# It prints:
#
#   Ways to 1369 locations, 825 of them usable: joints (1369, 8, 6)
#   60% of the places are in reach, in 2.0 ways
#   best at [-750. -150. -200.] 0.094
#   Configuration        Reach
#   RIGHTY ABOVE NOFLIP  334.0 mm too far
#   RIGHTY ABOVE FLIP    334.0 mm too far
#   RIGHTY BELOW NOFLIP  334.0 mm too far
#   RIGHTY BELOW FLIP    334.0 mm too far
#   LEFTY ABOVE NOFLIP   334.0 mm too far
#   LEFTY ABOVE FLIP     334.0 mm too far
#   LEFTY BELOW NOFLIP   334.0 mm too far
#   LEFTY BELOW FLIP     334.0 mm too far
#   MOVE, MOVES: *Location too far* the wrist would be 1199.3 mm from the shoulder, the arm reaches 865.3 mm (move the location 334.0 mm nearer)
