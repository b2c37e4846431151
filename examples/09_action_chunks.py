"""Chunks of actions as robot learning policies send them: 50 actions at 30 Hz, late by 0.2 to 0.6 s. An SO-100 of vrs
follows them with the names and units of LeRobot. So does LeRobot's own queue, which averages overlapping chunks."""

from random import Random

import numpy as np

import vrs_cli as vrs

RATE, STEPS, UNTIL = 30, 50, 20.0
robot = vrs.Robot("so100", units="SI")
arm, model = vrs.LeRobotArm(robot), robot.held.arm.model
still = np.array(list(arm.observation().values()))  # five motors from -100 to 100, and the gripper


def policy(seen, values):  # actions from an observed state to a wave; the gripper opens and closes
    times = seen + np.arange(STEPS) / RATE
    task = still + 25 * np.minimum(times / 2, 1)[:, None] * np.sin(np.outer(times, [1.5, 1.3, 1.1, 1.7, 2.0, 0.0]))
    actions = task + np.maximum(1 - np.arange(STEPS) / 18, 0)[:, None] ** 2 * (values - task[0])
    return np.column_stack((actions[:, :5], np.where(np.sin(times) > 0.5, 100, 0)))


delays, played, queue, step, coming, seen, errors = Random(1), [still], {}, -1, None, 0.0, []
for t in np.arange(0.0, UNTIL, 1 / RATE):  # LeRobot asks for a chunk when half of one is left, and numbers its actions
    if coming is None and len(queue) <= STEPS / 2:
        coming = t + delays.uniform(0.2, 0.6), max(step, 0), policy(t, played[-1])
    elif coming and t >= coming[0]:  # drop actions whose time has passed; average with those in the queue
        new = {k: row for k, row in enumerate(coming[2], coming[1]) if k > step}
        queue, coming = {k: 0.3 * queue[k] + 0.7 * new[k] if k in queue else new[k] for k in new}, None
    step = min(queue, default=step)
    played.append(queue.pop(step, played[-1]))
theirs = np.diff(played, axis=0)[:, :5] * RATE * np.subtract(model.upper, model.lower) / 200
while seen < UNTIL:  # a new chunk replaces the old one, starting from the current motion
    arrival = seen + delays.uniform(0.2, 0.6)
    actions = policy(seen, np.array(list(arm.observation(seen).values())))
    errors.append(arm.follow(actions, seen, arrival=arrival).mean)
    seen = arrival
for name, velocity in (("LeRobot's queue", theirs), ("vrs", robot.sample(1000).velocity)):
    print(f"{name:15} fastest joint: {(np.abs(velocity) / model.max_velocity).max():.2f} of its limit")
print(f"mean error of vrs: {np.degrees(np.mean(errors)):.2f} deg")

# It prints:
#
#   LeRobot's queue fastest joint: 2.65 of its limit
#   vrs             fastest joint: 0.50 of its limit
#   mean error of vrs: 0.11 deg
