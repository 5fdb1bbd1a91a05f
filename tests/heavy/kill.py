"""kill -9 at random instants, and recovery: loss, wholeness by Python's mcap, re-simulation to the bit."""

import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from check import BINARY, expect, recorded, service, wait_for

FLUSH_S = 0.2
STEP_S = 1e-3
SEED = 6


def ask(*words):
    return subprocess.run([BINARY, *map(str, words)], capture_output=True, text=True)


def trial(folder, number, kill_s, verifies):
    """Runs, kills, recovers; returns the simulated time lost against what a subscriber saw."""
    path, whole = folder / f"{number}.mcap", folder / f"{number}-whole.mcap"
    with service(["run", "--record", str(path), "--publish-hz", "all", "--flush", f"{FLUSH_S}s"], "victim") as (process, client):
        client.learn()
        wait_for(lambda: client.newest("angles"), "telemetry arrives")
        time.sleep(kill_s)
        process.send_signal(signal.SIGKILL)
        process.wait()
        seen_s = client.newest("angles").stamp.sim_time_s
    recovery = ask("recover", path, "-o", whole)
    expect(f"{number}: recovered, and said to be lossy", recovery.returncode == 3, recovery.stderr.strip())
    angles = [decoded.stamp for _, decoded in recorded(whole)["angles"]]
    expect(f"{number}: no step is missing before the end", [stamp.step for stamp in angles] == list(range(len(angles))))
    if verifies:
        verdict = ask("verify", whole)
        expect(f"{number}: re-simulation is equal to the bit", verdict.returncode in (0, 3), verdict.stderr.strip()[-200:])
    path.unlink()
    whole.unlink()
    return seen_s - angles[-1].sim_time_s


def main():
    count = int(sys.argv[2])
    dice = random.Random(SEED)
    verifies = ask("verify", "--help").returncode == 0
    losses = []
    with tempfile.TemporaryDirectory() as folder:
        for number in range(count):
            losses.append(trial(Path(folder), number, dice.uniform(0.3, 2.0), verifies))
    losses.sort()
    figures = f"median {losses[count // 2]:.3f} s, largest {losses[-1]:.3f} s of {count}"
    expect("at most the flush period and one step is lost", losses[-1] <= FLUSH_S + STEP_S + 1e-9, figures)


if __name__ == "__main__":
    main()
