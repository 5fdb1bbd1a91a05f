"""`flexcrank watch` in a real pseudo-terminal of 80 by 24, as over ssh: what is seen, what keys do, how it is left."""

import fcntl
import os
import pty
import select
import signal
import struct
import subprocess
import termios
import time

import pyte

from check import BINARY, expect, service, wait_for

SAMPLE = "recordings/sample-three-pulses.mcap"


class Watcher:
    """A watcher in a terminal of its own, and what is on its screen."""

    def __init__(self, name, endpoint, *options, hears_hangup=True):
        self.controller, self.terminal = pty.openpty()
        self.size(80, 24)
        self.before = termios.tcgetattr(self.terminal)
        environment = {**os.environ, "TERM": "xterm-256color"}
        command = [BINARY, "watch", name, "--connect", endpoint, *options]
        def adopt():
            fcntl.ioctl(0, termios.TIOCSCTTY, 0)
            if not hears_hangup:
                signal.signal(signal.SIGHUP, signal.SIG_IGN)

        self.process = subprocess.Popen(
            command, stdin=self.terminal, stdout=self.terminal, stderr=self.terminal, env=environment, start_new_session=True,
            preexec_fn=adopt,
        )
        self.screen = pyte.Screen(80, 24)
        self.stream = pyte.ByteStream(self.screen)
        self.raw = b""

    def size(self, columns, lines):
        fcntl.ioctl(self.terminal, termios.TIOCSWINSZ, struct.pack("HHHH", lines, columns, 0, 0))

    def read(self):
        while select.select([self.controller], [], [], 0.02)[0]:
            data = os.read(self.controller, 65536)
            self.raw += data
            self.stream.feed(data)

    def text(self):
        self.read()
        return "\n".join(self.screen.display)

    def shows(self, *words):
        wait_for(lambda: all(word in self.text() for word in words) or self.process.poll() is not None, f"screen shows {words}")
        shown = self.text()
        whole = all(word in shown for word in words)
        expect(f"the screen shows {', '.join(words)}", whole, "" if whole else "\n" + shown)

    def press(self, keys):
        os.write(self.controller, keys)

    def ends(self, how, code=0):
        wait_for(lambda: (self.read(), self.process.poll() is not None)[1], f"{how} ends it")
        self.read()
        left = self.raw.rstrip().endswith(b"\x1b[?25h") or b"\x1b[?1049l" in self.raw.rsplit(b"\x1b[?1049h", 1)[-1]
        same = termios.tcgetattr(self.terminal)[:4] == self.before[:4]
        expect(f"{how} ends it and puts the terminal back", self.process.returncode == code and left and same, f"exit code {self.process.returncode}")
        os.close(self.controller)
        os.close(self.terminal)

    def ends_with_its_terminal(self):
        os.close(self.controller)
        os.close(self.terminal)
        wait_for(lambda: self.process.poll() is not None, "the end of its terminal ends it")
        expect("the end of its terminal ends it, SIGHUP or not", self.process.returncode == 0, f"exit code {self.process.returncode}")


def dots(text):
    return sum(bin(ord(symbol) - 0x2800).count("1") for symbol in text if "\u2800" <= symbol <= "\u28ff")


def live():
    with service(["run", "--no-record"], "seen") as (_, client):
        client.learn()
        endpoint = client.endpoint
        watcher = Watcher("seen", endpoint, "--signals", "driving_torque_nm,slider.x_m", "--torque", "7.5", "--duration", "0.25")
        watcher.shows("flexcrank/seen", "RUNNING", "driving_torque_nm", "slider.x_m", "bending drawn", "q quit")
        expect("mechanism and charts are drawn", dots(watcher.text()) > 100, f"{dots(watcher.text())} dots")
        wait_for(lambda: client.newest("status"), "its status arrives")
        accepted = client.newest("status").commands_accepted
        watcher.press(b"p")
        watcher.shows("pulse accepted: takes effect in step")
        wait_for(lambda: client.newest("status").commands_accepted > accepted, "the pulse is counted")
        felt = lambda: any(abs(client.type("Loads").FromString(load).driving_torque_nm - 7.5) < 1e-9 for load in list(client.payloads["loads"]))
        wait_for(felt, "7.5 N·m arrive at the pivot")
        watcher.press(b" ")
        watcher.shows("PAUSED", "pause accepted")
        watcher.press(b" ")
        watcher.shows("RUNNING", "resume accepted")
        watcher.press(b"\t\x1b[A")
        wait_for(lambda: "slider.x_m" not in watcher.text(), "an arrow chooses another signal")
        watcher.press(b"+")
        wait_for(lambda: "(automatic)" not in watcher.text(), "+ takes over the magnification")
        for columns, lines in ((1, 1), (200, 60), (80, 24)):
            watcher.size(columns, lines)
            watcher.screen.resize(lines, columns)
            time.sleep(0.3)
            watcher.read()
        watcher.shows("RUNNING", "driving_torque_nm")
        watcher.press(b"r")
        watcher.shows("reset accepted")
        watcher.press(b"q")
        watcher.ends("q")
        for how, end in (("Ctrl-C", lambda it: it.press(b"\x03")), ("SIGTERM", lambda it: it.process.terminate()),
                         ("SIGINT", lambda it: it.process.send_signal(signal.SIGINT))):
            watcher = Watcher("seen", endpoint)
            watcher.shows("RUNNING")
            end(watcher)
            watcher.ends(how)
        for _ in range(5):
            watcher = Watcher("seen", endpoint, hears_hangup=False)
            watcher.shows("RUNNING")
            watcher.ends_with_its_terminal()
        plain = subprocess.Popen([BINARY, "watch", "seen", "--connect", endpoint], stdout=subprocess.PIPE, text=True)
        line = plain.stdout.readline()
        plain.terminate()
        plain.wait()
        expect("into a pipe it prints lines", line.startswith("RUNNING"), line.strip())


def replayed():
    with service(["replay", SAMPLE, "--loop"], "seen-again") as (_, client):
        client.learn()
        watcher = Watcher("seen-again", client.endpoint)
        watcher.shows("flexcrank/seen-again", "REPLAYING", "crank.rate_rad_per_s")
        watcher.press(b" ")
        watcher.shows("REPLAYING, PAUSED")
        watcher.press(b"p")
        watcher.shows("pulse `seen-again` is a replay")
        watcher.press(b" ")
        watcher.shows("resume accepted")
        watcher.press(b"q")
        watcher.ends("q")


def main():
    live()
    replayed()
    print("watch: all holds")


if __name__ == "__main__":
    main()
