"""A subscriber that is stopped (SIGSTOP): nothing changes for the service or for another subscriber, and memory stays flat."""

import signal
import struct
import subprocess
import sys
import time
from pathlib import Path

from check import Client, expect, service, wait_for

GROWTH_MIB = 8.0


class Counting(Client):
    """Keeps the numbers that messages carry, not the messages."""

    def __init__(self, *arguments):
        self.last, self.missing, self.count = {}, {}, 0
        super().__init__(*arguments)

    def take(self, sample):
        topic = str(sample.key_expr).rsplit("/", 1)[1]
        if sample.attachment is None:
            return
        (number,) = struct.unpack("<Q", sample.attachment.to_bytes())
        with self.lock:
            if topic in self.last:
                self.missing[topic] = self.missing.get(topic, 0) + number - self.last[topic] - 1
            self.last[topic] = number
            self.count += 1
            if topic == "status":
                self.payloads[topic] = [sample.payload.to_bytes()]


def watch(endpoint):
    client = Counting(endpoint, "stall")
    print("ready", flush=True)
    time.sleep(1e6)


def resident_mib(process):
    pages = int(Path(f"/proc/{process.pid}/statm").read_text().split()[1])
    return pages * 4096 / 2**20


def main(seconds):
    with service(["run", "--no-record", "--publish-hz", "all", "--set", "solver.step_s=1e-3"], "stall", client=Counting) as (process, client):
        client.learn()
        wait_for(lambda: client.newest("status"), "the service runs")
        stalled = subprocess.Popen([sys.executable, __file__, sys.argv[1], "client", process.args[-1]], stdout=subprocess.PIPE, text=True)
        stalled.stdout.readline()
        time.sleep(5)
        before, memory = client.newest("status"), resident_mib(process)
        quiet = dict(client.missing)
        stalled.send_signal(signal.SIGSTOP)
        peak, ends = memory, time.monotonic() + seconds
        while time.monotonic() < ends:
            time.sleep(0.5)
            peak = max(peak, resident_mib(process))
        during = client.newest("status")
        with client.lock:
            missing = {topic: lost - quiet.get(topic, 0) for topic, lost in client.missing.items()}
        stalled.send_signal(signal.SIGCONT)
        stalled.kill()
        stalled.wait()
    steps = during.stamp.step - before.stamp.step
    expect("the other subscriber misses nothing", not any(missing.values()), f"{missing}, {client.count} messages")
    expect("memory stays flat", peak - memory < GROWTH_MIB, f"{memory:.1f} -> at most {peak:.1f} MiB")
    expect("no queue of the service is full", during.dropped_samples == before.dropped_samples, f"{during.dropped_samples} dropped")
    expect("the service holds real time", abs(during.real_time_factor - 1) < 1e-3, f"{during.real_time_factor:.6f}, {steps} steps")
    figures = lambda status: f"p50 {status.lateness_p50_s * 1e6:.1f} p99 {status.lateness_p99_s * 1e6:.1f} us, overruns {status.overruns}"
    print(f"     lateness before: {figures(before)}; with the stall: {figures(during)}")


if __name__ == "__main__":
    if sys.argv[2] == "client":
        watch(sys.argv[3])
    else:
        main(float(sys.argv[2]))
