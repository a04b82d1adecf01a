"""Runs a command in a terminal of its own and does what a person would do there.

terminal.py COLUMNS LINES STEPS -- COMMAND...

STEPS is a JSON list, one after another: {"wait": TEXT} until the command has written the text, {"keys": TEXT},
{"signal": NAME}, {"hang_up": true} takes the terminal away. Prints one JSON object: `exit` (negative: the signal), `output`, `restored` (the terminal's settings
are what they were), `missing` (a text that never came).
"""

import fcntl
import json
import os
import pty
import select
import signal
import struct
import subprocess
import sys
import termios
import time

PATIENCE_S = 60

columns, lines, steps = int(sys.argv[1]), int(sys.argv[2]), json.loads(sys.argv[3])
command = sys.argv[5:]
master, slave = pty.openpty()
fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", lines, columns, 0, 0))
before = termios.tcgetattr(slave)


def own_terminal():
    fcntl.ioctl(0, termios.TIOCSCTTY, 0)


child = subprocess.Popen(
    command, stdin=slave, stdout=slave, stderr=slave, start_new_session=True, preexec_fn=own_terminal
)
output, missing, seen = b"", None, 0
deadline = time.monotonic() + PATIENCE_S


def read(seconds):
    global output
    if select.select([master], [], [], seconds)[0]:
        output += os.read(master, 65536)
        return True
    return False


for step in steps:
    if "wait" in step:
        wanted = step["wait"].encode()
        while output.find(wanted, seen) < 0 and child.poll() is None and time.monotonic() < deadline:
            read(0.1)
        found = output.find(wanted, seen)
        if found < 0:
            missing = step["wait"]
            break
        seen = found + len(wanted)
    elif "hang_up" in step:
        os.close(slave)
        os.close(master)
        slave = None
    elif "keys" in step:
        os.write(master, step["keys"].encode())
    else:
        os.kill(child.pid, getattr(signal, step["signal"]))
while child.poll() is None and time.monotonic() < deadline:
    time.sleep(0.1) if slave is None else read(0.1)
if child.poll() is None:
    child.kill()
child.wait()
while slave is not None and read(0.1):
    pass
print(
    json.dumps(
        {
            "exit": child.returncode,
            "output": output.decode(errors="replace"),
            "restored": slave is None or termios.tcgetattr(slave) == before,
            "missing": missing,
        }
    )
)
