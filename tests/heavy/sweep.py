"""Sixteen workers on one campaign, killed at random instants and started again; every figure that is checked is printed.

Usage: tests/heavy/sweep.py BINARY [KILLS]
"""

import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

BINARY, KILLS = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 100
WORKERS = 16
SEED = 18
# A run takes half a millisecond or so, and the workers outlast all kills.
RUNS_PER_KILL = 400

SPEC = """
scene = "thesis-crank-slider"
set = ["solver.model=rigid", "solver.integrator=runge-kutta"]
until_s = 22.8
method = "sobol"
samples = {samples}
seed = 1

[[vary]]
key = "rod.length_m"
min = 1.2
max = 1.8

[[vary]]
key = "pulse.1.torque_nm"
min = -0.5
max = 0.5

[[pulse]]
start_s = 5.0
torque_nm = 0.0
duration_s = 0.5
"""


def expect(what, holds, figure=""):
    print(f"{'ok  ' if holds else 'FAIL'} {what} {figure}", flush=True)
    if not holds:
        sys.exit(1)


def sha256(output):
    return output.split("SHA-256 ")[1].split()[0]


def undisturbed(spec, folder):
    """One process from beginning to end, and a merge: the table's SHA-256, the worker's memory over time, KiB, and its time, s."""
    begin = time.monotonic()
    command = [BINARY, "sweep", str(spec), "-o", str(folder)]
    process = subprocess.Popen([*command, "--shard", "1/1"], stdout=subprocess.PIPE, text=True)
    memory = []
    while process.poll() is None:
        try:
            status = Path(f"/proc/{process.pid}/status").read_text()
            memory += [int(line.split()[1]) for line in status.splitlines() if line.startswith("VmRSS:")]
        except (FileNotFoundError, ProcessLookupError):
            break
        time.sleep(0.05)
    output = process.stdout.read()
    expect("an undisturbed process ends with 0", process.wait() == 0, output.strip())
    duration_s = time.monotonic() - begin
    merged = subprocess.run([*command, "--merge"], capture_output=True, text=True)
    expect("its rows are merged", merged.returncode == 0, merged.stdout.splitlines()[0])
    return sha256(merged.stdout), memory, duration_s


def worker(spec, folder):
    return subprocess.Popen(
        [BINARY, "sweep", str(spec), "-o", str(folder), "--jobs", "1"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )


def killed(spec, folder, duration_s):
    """Workers, of which one is killed at a time; returns how many were, while they had work, and the number of rows then."""
    chance = random.Random(SEED)
    workers = [worker(spec, folder) for _ in range(WORKERS)]
    count, amid = 0, 0
    for _ in range(KILLS):
        time.sleep(chance.uniform(0.2, 1.0) * duration_s / KILLS)
        place = chance.randrange(WORKERS)
        if workers[place].poll() is None:
            amid += 1
        os.kill(workers[place].pid, signal.SIGKILL) if workers[place].poll() is None else None
        workers[place].wait()
        count += 1
        workers[place] = worker(spec, folder)
    codes = [process.wait() for process in workers]
    expect("workers that were not killed end with 0", set(codes) == {0}, codes)
    return count, amid


with tempfile.TemporaryDirectory() as scratch:
    scratch = Path(scratch)
    spec = scratch / "campaign.toml"
    samples = max(KILLS * RUNS_PER_KILL // 4, 256)
    spec.write_text(SPEC.format(samples=samples))
    whole, memory, duration_s = undisturbed(spec, scratch / "whole")
    print(f"     {4 * samples} runs in {duration_s:.1f} s")
    early, late = max(memory[: len(memory) // 4]), max(memory[len(memory) // 4 :])
    expect("memory is flat: at most 8 MiB more after the first quarter", late < early + 8192, f"{early} {late} KiB")
    count, amid = killed(spec, scratch / "shared", duration_s)
    expect("most kills met a worker at work", amid >= 0.8 * count, f"{amid} of {count}")
    # A worker killed at the end leaves rows to whoever comes next.
    last = subprocess.run([BINARY, "sweep", str(spec), "-o", str(scratch / "shared")], capture_output=True, text=True)
    expect("what is left is computed, and merged", last.returncode == 0, last.stdout.splitlines()[0])
    expect(f"after {count} kills the table is that of one undisturbed process", sha256(last.stdout) == whole, whole)
    lines = [line for path in (scratch / "shared").glob("chunks-of-*/*.tsv") for line in path.read_text().splitlines()]
    expect("no row was written twice", len(lines) == 4 * samples, len(lines))
