"""A replay steered by the keys of a real terminal, seen from the bus; every figure that is checked is printed."""

import contextlib
import fcntl
import os
import pty
import subprocess
import sys
import tempfile
import termios
import threading
from pathlib import Path

from check import BINARY, PATIENCE_S, Client, expect, free_endpoint, wait_for

SECONDS = 20.0
UP, DOWN, RIGHT, LEFT, HOME = (b"\x1b[" + letter for letter in (b"A", b"B", b"C", b"D", b"H"))
CTRL_C = b"\x03"


def modes(terminal):
    """Whether the terminal waits for Enter, and whether it echoes."""
    local = termios.tcgetattr(terminal)[3]
    return bool(local & termios.ICANON), bool(local & termios.ECHO)


@contextlib.contextmanager
def at_terminal(arguments):
    """Runs the program with a terminal of its own; yields the process, the end that keys go into, and the terminal."""
    keys, terminal = pty.openpty()
    own = lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0)
    process = subprocess.Popen(
        [BINARY, *arguments], stdin=terminal, stdout=terminal, stderr=terminal, start_new_session=True, preexec_fn=own
    )
    shown = []

    def look():
        with contextlib.suppress(OSError):
            while text := os.read(keys, 4096):
                shown.append(text)

    screen = threading.Thread(target=look, daemon=True)
    screen.start()
    try:
        yield process, keys, terminal, shown
    finally:
        if process.poll() is None:
            process.kill()
        process.wait()
        os.close(terminal)
        screen.join(PATIENCE_S)
        os.close(keys)


def steered(path):
    endpoint = free_endpoint()
    arguments = ["replay", str(path), "--name", "ghost", "--start-paused", "--topics", "angles", "--listen", endpoint]
    with at_terminal(arguments) as (process, keys, terminal, shown):
        client = Client(endpoint, "ghost")
        client.learn()
        wait_for(lambda: client.newest("status"), "the replayer has a status")
        expect("keys are taken at once, and not shown", modes(terminal) == (False, False))
        now = lambda: client.newest("status").replay
        at = lambda: client.newest("status").stamp.sim_time_s

        def press(key, what, holds):
            os.write(keys, key)
            wait_for(holds, what)
            expect(what, True, f"at {at():.3f} s, rate {now().rate:.3f}")

        press(RIGHT, "right: 5 s on", lambda: abs(at() - 5.0) < 1e-9)
        press(LEFT, "left: back", lambda: at() == 0.0)
        press(RIGHT * 9, "right, never beyond the end", lambda: abs(at() - SECONDS) < 1e-9)
        press(HOME, "Home: to the start", lambda: at() == 0.0)
        press(UP, "up: faster", lambda: abs(now().rate - 1.1) < 1e-9)
        press(DOWN * 2, "down: slower", lambda: abs(now().rate - 1 / 1.1) < 1e-9)
        expect("nothing was played so far", not client.payloads["angles"])
        press(b"n", "n: a message", lambda: len(client.payloads["angles"]) == 1)
        press(b"x?\r", "other keys: nothing", lambda: now().paused and len(client.payloads["angles"]) == 1)
        press(b" ", "space: go on", lambda: not now().paused and len(client.payloads["angles"]) > 10)
        press(b" ", "space: pause", lambda: now().paused)
        os.write(keys, b"q")
        expect("q: ends with 0", process.wait(PATIENCE_S) == 0)
        expect("the terminal is as it was", modes(terminal) == (True, True))
        client.session.close()
    said = b"".join(shown).decode(errors="replace")
    expect("keys were told of, and the report came", "space: pause" in said and "replayed" in said, said.splitlines()[-1])


def interrupted(path):
    with at_terminal(["replay", str(path), "--loop", "--name", "ghost", "--listen", free_endpoint()]) as (process, keys, terminal, _):
        wait_for(lambda: modes(terminal) == (False, False), "keys are taken")
        os.write(keys, CTRL_C)
        expect("Ctrl-C ends with 0", process.wait(PATIENCE_S) == 0)
        expect("the terminal is as it was", modes(terminal) == (True, True))


def main():
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "take.mcap"
        run = ["run", "--pace", "max", "--until", str(SECONDS), "--record", str(path), "--listen", free_endpoint(), "--name", "keys"]
        subprocess.run([BINARY, *run], check=True, stderr=subprocess.DEVNULL)
        steered(path)
        interrupted(path)
    print("keyboard: all holds")


if __name__ == "__main__":
    main()
