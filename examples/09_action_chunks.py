"""Chunks of actions, as policies of robot learning send them (to an SO-100 of LeRobot): the joints for the next 1.6 s at
30 Hz, which arrive 0.2 to 0.6 s after the observation. A queue that plays each chunk from its first action on jumps."""

from random import Random

import numpy as np

import vrs_cli as vrs

RATE, STEPS = 30, 48  # actions a second, and in a chunk
delays, robot = Random(1), vrs.Robot("so100", units="SI")
ready = robot.where().joints
middle = np.add(ready, [0.0, 0.2, -0.1, 0.0, 0.0])


def policy(seen, joints):
    """The actions from an observation on: they lead from the joints that were seen to what the task wants."""
    times = seen + np.arange(STEPS) / RATE
    task = middle + np.array([0.8, 0.15, 0.3, 0.4, 0.8]) * np.sin(np.outer(times, [2.1, 1.7, 1.3, 1.1, 2.7]))
    share = np.minimum((times - seen) / 0.4, 1.0)[:, None]
    return times, (1 - share) * joints + share * task


played, queue, seen, errors = [ready], [], 0.0, []
while seen < 20.0:
    arrival = seen + delays.uniform(0.2, 0.6)
    times, actions = policy(seen, robot.where(seen).joints)
    coming = times >= arrival  # vrs replaces what it has from there on, out of whatever motion is under way
    errors.append(robot.follow(times[coming], actions[coming]).mean)
    _, naive = policy(seen, played[-1])
    steps = round((arrival - seen) * RATE)
    played += [queue.pop(0) if queue else played[-1] for _ in range(steps)]
    queue, seen = list(naive), arrival

path = robot.sample(1000.0)
for name, velocity in (("naive queue", np.diff(played, axis=0) * RATE), ("vrs", path.velocity)):
    print(f"{name:12} fastest joint: {np.abs(velocity).max() / np.pi:.2f} of its limit")
print(f"mean error: {np.degrees(np.mean(errors)):.2f} deg")

# It prints:
#
#   naive queue  fastest joint: 11.76 of its limit
#   vrs          fastest joint: 1.00 of its limit
#   mean error: 0.96 deg
