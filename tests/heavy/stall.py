"""A subscriber that is stopped (SIGSTOP): nothing changes for the service or for another subscriber, and memory stays flat."""

import signal
import struct
import subprocess
import sys
import time
from pathlib import Path

import pairs
from check import Client, Machine, expect, expect_real_time, service, wait_for

GROWTH_MIB = 8.0
SETTLES_S = 5.0


class Counting(Client):
    """Keeps the numbers that messages carry, not the messages. `gaps` says after which message of which topic how many are missing.

    Counts once the service has answered a query: by then the subscription stands. zenoh sends everything to a session that has just
    connected, until that session has listed its subscriptions. One that is declared at that instant sees some samples, then a gap.
    """

    def __init__(self, *arguments):
        self.last, self.missing, self.count, self.gaps = {}, {}, 0, []
        super().__init__(*arguments)
        self.learn()
        with self.lock:
            self.last, self.missing, self.count, self.gaps = {}, {}, 0, []

    def take(self, sample):
        topic = str(sample.key_expr).rsplit("/", 1)[1]
        if sample.attachment is None:
            return
        (number,) = struct.unpack("<Q", sample.attachment.to_bytes())
        with self.lock:
            if topic in self.last:
                lost = number - self.last[topic] - 1
                self.missing[topic] = self.missing.get(topic, 0) + lost
                if lost:
                    self.gaps.append(f"{lost} {topic} behind message {self.count}")
            self.last[topic] = number
            self.count += 1
            if topic == "status":
                self.payloads[topic] = [sample.payload.to_bytes()]

    def count_of(self, topic):
        """The number of the topic's last message."""
        with self.lock:
            return self.last.get(topic, 0)


def watch(endpoint):
    client = Counting(endpoint, "stall")
    print("ready", flush=True)
    time.sleep(1e6)


def resident_mib(process):
    pages = int(Path(f"/proc/{process.pid}/statm").read_text().split()[1])
    return pages * 4096 / 2**20


def run(seconds, stops, options=pairs.OPTIONS):
    """A service with two subscribers, of which one is stopped or not; the stretch meanwhile, and the status at its end."""
    with service(["run", "--no-record", "--publish-hz", "all", *options, "--set", "solver.step_s=1e-3"], "stall", client=Counting) as (process, client):
        wait_for(lambda: client.newest("status"), "the service runs")
        other = subprocess.Popen([sys.executable, __file__, sys.argv[1], "client", process.args[-1]], stdout=subprocess.PIPE, text=True)
        other.stdout.readline()
        time.sleep(SETTLES_S)
        memory, quiet, seen = resident_mib(process), dict(client.missing), client.count_of("status")
        if stops:
            other.send_signal(signal.SIGSTOP)
        wait_for(lambda: client.count_of("status") > seen, "a status of the stretch")
        before = client.newest("status")
        peak, ends = memory, time.monotonic() + seconds
        while time.monotonic() < ends:
            time.sleep(0.5)
            peak = max(peak, resident_mib(process))
        status = client.newest("status")
        with client.lock:
            missing = {topic: lost - quiet.get(topic, 0) for topic, lost in client.missing.items()}
        other.kill()
        other.wait()
    how = "one is stopped" if stops else "none is stopped"
    expect(f"{how}: the other subscriber misses nothing", not any(missing.values()), f"{missing}, {client.count} messages")
    expect(f"{how}: memory stays flat", peak - memory < GROWTH_MIB, f"{memory:.1f} -> at most {peak:.1f} MiB")
    expect(f"{how}: no queue of the service is full", status.dropped_samples == before.dropped_samples, f"{status.dropped_samples} dropped")
    stretch = pairs.stretch(before, status)
    print(f"     {pairs.told(stretch)}, {stretch.overruns} overruns in {stretch.steps} steps", flush=True)
    return stretch, status


def main(seconds, count):
    machine, without, disturbed = Machine(), [], []
    for _ in range(count):
        without.append(run(seconds, False)[0])
        disturbed.append(run(seconds, True)[0])
    _, caught_up = run(seconds, True, ())
    quiet = machine.is_quiet()
    expect_real_time(quiet, caught_up.real_time_factor, 1e-3)
    pairs.expect_alike(quiet, without, disturbed)


if __name__ == "__main__":
    if sys.argv[2] == "client":
        watch(sys.argv[3])
    else:
        main(float(sys.argv[2]), int(sys.argv[3]))
