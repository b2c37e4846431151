"""A V+ program that listens on TCP, and its client: a driver like those of ROS, but with a virtual robot."""

import re
import socket
import subprocess
import sys
from pathlib import Path

import vrs_cli

program = (Path(vrs_cli.__file__).parents[1] / "programs" / "driver.v2").read_text()
program = program.replace("11000", "0").replace("11001", "0")  # any two free ports
command = [sys.executable, "-m", "vrs_cli", "run", "-", "--allow-net", "--realtime", "4"]
driver = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
driver.stdin.write(program)
driver.stdin.close()
commands, positions = (int(re.search(r"port (\d+)", driver.stdout.readline())[1]) for _ in range(2))

with socket.create_connection(("127.0.0.1", commands)) as arm:
    answers = arm.makefile("r")
    for line in ("S 50", "J 30 -60 120 0 30 0", "J 200 0 0 0 0 0", "J 0 -90 90 0 0 0", "W"):
        arm.sendall(f"{line}\n".encode())
        print(f"{line:20} -> {answers.readline().strip()}")
    with socket.create_connection(("127.0.0.1", positions)) as eyes:  # sent ten times a second
        _, *joints = map(float, eyes.makefile("r").readline().split())
    arm.sendall(b"Q\n")
print("it stands at", *map(round, joints))
print(driver.stdout.read().strip())

# It prints:
#
#   S 50                 -> OK
#   J 30 -60 120 0 30 0  -> OK
#   J 200 0 0 0 0 0      -> ? out of range
#   J 0 -90 90 0 0 0     -> OK
#   W                    -> OK
#   it stands at 0 -90 90 0 0 0
#   client 1 is here
#   the end at 0 -90 90 0 0 0
#   Program completed
