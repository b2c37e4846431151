"""A trajectory as numpy arrays: velocities, the path of the tool, and a picture of it if matplotlib is installed."""

from importlib.util import find_spec

import numpy as np

import vrs_cli as vrs

r = vrs.Robot().move(0, -45, 180, 0, 45, 0).moves(vrs.trans(300, 450, -200, 90, 90, 0))
path = r.sample(rate=200)  # 200 times a second, and at the exact end

print(path.joints.shape, path.velocity.shape, path.xyz.shape)
fastest = np.abs(path.velocity).max(axis=0)
print("fastest joint rates [deg/s]:", fastest.round(1))
length = np.linalg.norm(np.diff(path.xyz, axis=0), axis=1).sum()
print(f"the tool went {length:.0f} mm, at most {path.speed.max():.0f} mm/s")

if find_spec("matplotlib"):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    plt.plot(path.t, path.joints, label=[f"JT{i}" for i in range(1, 7)])
    plt.xlabel("t [s]")
    plt.ylabel("joints [deg]")
    plt.legend()
    plt.savefig("trajectory.png")

# It prints:
#
#   (476, 6) (476, 6) (476, 3)
#   fastest joint rates [deg/s]: [ 50.9  54.  108.    0.   54.   50.9]
#   the tool went 1882 mm, at most 1830 mm/s
