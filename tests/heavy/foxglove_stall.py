"""A viewer that is stopped (SIGSTOP): nothing changes for the service or for another viewer, and memory stays flat."""

import signal
import subprocess
import sys
import time

import pairs
from check import Client, Machine, expect, service, wait_for
from foxglove import free_port
from stall import GROWTH_MIB, SETTLES_S, resident_mib
from viewer import Viewer


class StatusOnly(Client):
    """Keeps only the status that the bus carries."""

    def take(self, sample):
        if str(sample.key_expr).endswith("/status"):
            super().take(sample)


class Healthy(Viewer):
    """Receives everything; keeps the angles alone."""

    def take_binary(self, message):
        self.keep = message[0] == 1 and self.channels[int.from_bytes(message[1:5], "little")]["topic"].endswith("/angles")
        super().take_binary(message)


def watch(port):
    viewer = Viewer(port, keep=False)
    wait_for(lambda: sum(viewer.counts.values()) > 100, "the other viewer receives")
    print("ready", flush=True)
    time.sleep(1e6)


def run(seconds, stops):
    """A service with two viewers, of which one is stopped or not; the stretch meanwhile."""
    port = free_port()
    options = ["run", "--no-record", "--publish-hz", "all", *pairs.OPTIONS, "--set", "solver.step_s=1e-3"]
    with service([*options, f"--foxglove=127.0.0.1:{port}"], "stall", client=StatusOnly) as (process, client):
        client.learn()
        wait_for(lambda: client.newest("status"), "the service runs")
        viewer = Healthy(port)
        other = subprocess.Popen([sys.executable, __file__, sys.argv[1], "client", str(port)], stdout=subprocess.PIPE, text=True)
        other.stdout.readline()
        time.sleep(SETTLES_S)
        if stops:
            other.send_signal(signal.SIGSTOP)
            # Its queue in the service fills once.
            time.sleep(SETTLES_S)
        memory, seen = resident_mib(process), len(client.payloads["status"])
        wait_for(lambda: len(client.payloads["status"]) > seen, "a status of the stretch")
        before = client.newest("status")
        peak, ends = memory, time.monotonic() + seconds
        while time.monotonic() < ends:
            time.sleep(0.5)
            peak = max(peak, resident_mib(process))
        status = client.newest("status")
        angles = client.type("Angles")
        steps = [angles.FromString(payload).stamp.step for _, payload in viewer.of("flexcrank/stall/angles")]
        viewer.close()
        other.kill()
        other.wait()
    how = "one viewer is stopped" if stops else "no viewer is stopped"
    missing = steps[-1] - steps[0] + 1 - len(steps)
    expect(f"{how}: the other misses nothing", missing == 0, f"{len(steps)} steps, {sum(viewer.counts.values())} messages")
    expect(f"{how}: memory stays flat", peak - memory < GROWTH_MIB, f"{memory:.1f} -> at most {peak:.1f} MiB")
    expect(f"{how}: no queue of the service is full", status.dropped_samples == before.dropped_samples, f"{status.dropped_samples} dropped")
    stretch = pairs.stretch(before, status)
    print(f"     {pairs.told(stretch)}, {stretch.overruns} overruns in {stretch.steps} steps", flush=True)
    return stretch


def main(seconds, count):
    machine, without, disturbed = Machine(), [], []
    for _ in range(count):
        without.append(run(seconds, False))
        disturbed.append(run(seconds, True))
    pairs.expect_alike(machine.is_quiet(), without, disturbed)
    print("a stopped viewer: all holds")


if __name__ == "__main__":
    if sys.argv[2] == "client":
        watch(int(sys.argv[3]))
    else:
        main(float(sys.argv[2]), int(sys.argv[3]))
