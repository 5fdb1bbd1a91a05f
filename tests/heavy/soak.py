"""A long run: four subscribers, two commanding clients, a pulse a second from each of them in turn."""

import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

from check import Machine, expect, expect_if, expect_real_time, service, wait_for
from stall import Counting, resident_mib

SUBSCRIBERS = 4
STALL_S = 0.3  # the samples of a longer one fill half of zenoh's queue when the service catches up
FACTOR = 5e-4
MEMORY_MIB = 2.0
SETTLES_S = 60.0


class Timed(Counting):
    """Keeps the longest time without a message, too: a stall of the machine or of this program."""

    def __init__(self, *arguments):
        self.newest_s, self.longest_s = None, 0.0
        super().__init__(*arguments)

    def take(self, sample):
        now = time.monotonic()
        self.longest_s = max(self.longest_s, now - (self.newest_s or now))
        self.newest_s = now
        super().take(sample)

    def heard(self):
        """Messages that came, those that did not, and the longest time without one, s."""
        with self.lock:
            return self.count, sum(self.missing.values()), round(self.longest_s, 3)


def command(endpoint, who, seconds):
    """A pulse every two seconds, half a period off for the second client; prints how many were accepted."""
    client = Counting(endpoint, "soak")
    client.subscriber.undeclare()
    pulse, reply = client.type("TorquePulse"), client.type("CommandReply")
    accepted, begun = 0, time.monotonic()
    for number in range(int(seconds / 2)):
        time.sleep(max(0.0, begun + 2 * number + who - time.monotonic()))
        answer = client.ask("torque", pulse(id=f"{who}-{number}", torque_nm=0.1 * (-1) ** (number + who), duration_s=0.01).SerializeToString())
        accepted += answer is not None and reply.FromString(answer).accepted
    print(accepted)
    client.session.close()


def subscribe(endpoint):
    """Listens until it is told to end; prints what it heard."""
    client = Timed(endpoint, "soak")
    over = threading.Event()
    signal.signal(signal.SIGTERM, lambda *_: over.set())
    while not over.wait(0.2):
        pass
    print(*client.heard(), *client.gaps, sep="\t")
    client.session.close()


def main(seconds):
    machine = Machine()
    with tempfile.TemporaryDirectory() as folder:
        arguments = ["run", "--record", str(Path(folder) / "soak.mcap"), "--set", "solver.step_s=1e-3"]
        with service(arguments, "soak", client=Timed) as (process, client):
            wait_for(lambda: client.newest("status"), "the service runs")
            start = lambda *words: subprocess.Popen([sys.executable, __file__, sys.argv[1], *map(str, words)], stdout=subprocess.PIPE, text=True)
            endpoint = process.args[-1]
            listeners = [start("subscriber", endpoint) for _ in range(SUBSCRIBERS - 1)]  # this one is the fourth
            senders = [start("client", endpoint, who, seconds) for who in range(2)]
            begun, low, high = time.monotonic(), None, 0.0
            while time.monotonic() - begun < seconds:
                time.sleep(1)
                if time.monotonic() - begun > min(SETTLES_S, seconds / 2):
                    now = resident_mib(process)
                    low, high = min(low or now, now), max(high, now)
            status = client.newest("status")
            sent = [int(sender.communicate()[0] or 0) for sender in senders]
            for listener in listeners:
                listener.terminate()
            lines = [listener.communicate()[0].rstrip("\n").split("\t") for listener in listeners]
            heard = [tuple(map(float, line[:3])) for line in lines] + [client.heard()]
            gaps = [gap for line in lines for gap in line[3:]] + client.gaps
    expect("every pulse was accepted", sum(sent) == 2 * int(seconds / 2), f"{sent}")
    expect_real_time(machine.is_quiet(), status.real_time_factor, FACTOR)
    expect("resident memory is flat", high - low <= 2 * MEMORY_MIB, f"{low:.1f} to {high:.1f} MiB")
    expect("nothing was dropped by the service", status.dropped_samples == 0 and not status.drops, f"{status.dropped_samples}")
    stall_s = max(longest for *_, longest in heard)
    expect_if(stall_s < STALL_S, "no subscriber missed anything", not any(lost for _, lost, _ in heard), f"{heard} {gaps}")
    print(f"     lateness p50 {status.lateness_p50_s * 1e6:.1f} p99 {status.lateness_p99_s * 1e6:.1f} p99.9 {status.lateness_p999_s * 1e6:.1f} us, "
          f"overruns {status.overruns}, given up {status.given_up_s:.3f} s")


if __name__ == "__main__":
    if sys.argv[2] == "client":
        command(sys.argv[3], int(sys.argv[4]), float(sys.argv[5]))
    elif sys.argv[2] == "subscriber":
        subscribe(sys.argv[3])
    else:
        main(float(sys.argv[2]))
