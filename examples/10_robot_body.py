"""A LeRobot arm as body of a served SO-100. `FakeBus` replaces the bus of its motors (LeRobot's FeetechMotorsBus)."""

import asyncio
import subprocess
import sys

import numpy as np

import vrs_cli as vrs
from vrs_cli.net.body_client import BodyClient


class FakeBus:  # each reading moves each motor a third of the way to its goal
    present = goal = np.zeros(5)

    def sync_write(self, _name, goal):
        self.goal = goal

    def sync_read(self, _name):
        self.present = self.present + (self.goal - self.present) / 3
        return self.present


async def be_the_body(address, seconds, bus):
    async with BodyClient(address, rate=50.0, name="so100") as body:
        low, high = np.array(body.model.lower), np.array(body.model.upper)
        middle, half = (low + high) / 2, (high - low) / 200  # LeRobot's values are percentages of half the range
        begin = body.now()
        async for t in body.ticks():
            bus.sync_write("Goal_Position", (np.array(body.setpoint(t).joints) - middle) / half)
            body.report(t, tuple(middle + half * bus.sync_read("Present_Position")))
            if t > begin + seconds:
                return


command = [sys.executable, "-m", "vrs_cli", "serve", "--port", "0", "--realtime", "--robot", "arm=so100"]
server = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
address = server.stdout.readline().split()[2].rstrip(",")
with vrs.connect(address, name="ada") as robot:
    robot.do("DRIVE 1, 30, 50 IN 0.5")
    asyncio.run(be_the_body(address, 2.0, FakeBus()))
    print(f"joint 1 went to {robot.measured.joints[-1, 0]:.0f} deg, as the body measured")
server.terminate()

# It prints:
#
#   joint 1 went to 30 deg, as the body measured
