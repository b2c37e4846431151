"""A robot on a server: one client moves it, another watches. `vrs serve` may also run on another machine."""

import subprocess
import sys

import vrs_cli as vrs

command = [sys.executable, "-m", "vrs_cli", "serve", "--port", "0"]
server = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
address = server.stdout.readline().split()[2].rstrip(",")  # vrs serve: ws://127.0.0.1:8765, robot puma560

with vrs.connect(address, name="ada") as mover, vrs.connect(address, name="bob") as viewer:
    mover.move(0, -45, 180, 0, 45, 0).moves(vrs.trans(300, 450, -200, 90, 90, 0), at=1.0)
    print(viewer)
    for t in (0.5, 1.5, viewer.end):
        print(viewer.where(t))
server.terminate()

# It prints:
#
#   <Robot puma560: 2 motions to 2.168 s, now 1.133 s, xyz (605.452, 162.996, -64.0456) mm, oat (-90, 87.8211, 180) deg>
#   Posture at 0.500 s: joints (0, -71.1, 127.8, 0, 18.9, 0) deg, xyz (545.157, 149.09, 677.257) mm, oat (90, -14.4, 0) deg
#   Posture at 1.500 s: joints (14.572, -44.3075, 195.399, 1.03138, 30.9535, 13.6781) deg, xyz (479.308, 279.184, -123.88) mm, oat (-90, 87.8912, -180) deg
#   Posture at 2.168 s: joints (40.3081, -36.1299, 195.569, 0, 20.5608, 40.3081) deg, xyz (300, 450, -200) mm, oat (90, 90, 0) deg
