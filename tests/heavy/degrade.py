"""Levels of detail under a load: steps take five times as long at random times (`run --slow-solver`)."""

import csv
import json
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

FACTOR = 5
POLICIES = {
    "catch-up": ["--overrun", "catch-up"],
    "degrade": ["--overrun", "degrade"],
    "spare": ["--overrun", "degrade", "--spare"],
}
JUDGED = os.environ.get("FLEXCRANK_JUDGE_TIMES") != "no"
LEVELS = """
[[level]]
name = "best"

[[level]]
name = "good"
error_rad = 1e-3
changes = ["crank.modes=1", "rod.modes=4", "solver.model=modal", "solver.integrator=esdirk"]

[[level]]
name = "fair"
error_rad = 1e-2
changes = ["crank.rigid=true", "rod.modes=1", "rod.axial=false", "solver.model=modal", "solver.integrator=esdirk"]

[[level]]
name = "rough"
error_rad = 1e-1
changes = ["solver.model=rigid", "solver.integrator=runge-kutta"]
"""


def loads(until_s):
    """Beginnings and ends of the loads: the same random numbers as the program's (src/runtime/slowdown.rs)."""
    random, loaded, at_ms, found = 17, True, 0, []
    while at_ms < 1000 * until_s:
        loaded = not loaded
        low, high = (200, 2000) if loaded else (1500, 5000)
        random = (random * 6364136223846793005 + 1442695040888963407) % 2**64
        length_ms = low + (random >> 33) % (high - low)
        if loaded:
            found.append((at_ms / 1000, (at_ms + length_ms) / 1000))
        at_ms += length_ms
    return found


def elements_for(binary, scene, folder):
    """As many elements as make a step of the best level take 0.3 to 0.5 ms here."""
    for elements in (4, 8, 12, 16, 24, 32, 48, 64, 96):
        run = [binary, "run", scene, "--no-bus", "--no-record", "--pace", "1", "--until", "2", "--log-format", "json"]
        settings = [f"{link}.elements={elements}" for link in ("crank", "rod")]
        path = folder / f"cost-{elements}.mcap"
        run = [word for word in run if word != "--no-record"] + ["--record", path]
        subprocess.run(run + [f"--set={key}" for key in settings], check=True, capture_output=True)
        cost_s = statuses(binary, path, folder / f"cost-{elements}")[-1]["step_cost_p50_s"]
        if float(cost_s) > 0.3e-3:
            return elements, float(cost_s)
    raise SystemExit("this machine is too fast for the trial")


def table(binary, recording, folder, topic):
    if not folder.exists():
        subprocess.run([binary, "export", recording, "--csv", folder], check=True, capture_output=True)
    path = next(folder.glob(f"*{topic}.csv"), None)
    return list(csv.DictReader(path.open())) if path else []


def by_solver(rows):
    """Missed deadlines whose cause is the solver; the machine's own stalls are counted apart."""
    count = lambda row, n: int(row[f"causes.{n}.count"]) if row.get(f"causes.{n}.cause") == "SOLVER" else 0
    return sum(count(row, n) for row in rows for n in range(4))


def in_times(rows, times, step_s=1e-3):
    """Missed deadlines by the solver in the given times, of those that are listed one by one."""
    listed = [
        step_s * int(row[f"misses.{n}.step"]) for row in rows for n in range(32) if row.get(f"misses.{n}.cause") == "SOLVER"
    ]
    return sum(any(start <= time <= end for start, end in times) for time in listed)


def statuses(binary, recording, folder):
    return table(binary, recording, folder, "status")


def main():
    binary, until_s = sys.argv[1], float(sys.argv[2])
    failures = []

    def expect(holds, what):
        print(f"  {'holds' if holds else 'FAILS'}: {what}", flush=True)
        if not holds:
            failures.append(what)

    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        scene = folder / "levels.toml"
        base = subprocess.run([binary, "scenes", "crank-slider"], check=True, capture_output=True, text=True).stdout
        base = base.replace('model = "modal"', 'model = "finite-element"').replace("step_s = 0.002", "step_s = 0.001")
        scene.write_text(base + LEVELS)
        elements, cost_s = elements_for(binary, scene, folder)
        print(f"best level: {elements} elements a link, {1e3 * cost_s:.2f} ms a step of 1 ms")
        settings = [f"--set={link}.elements={elements}" for link in ("crank", "rod")]
        begun = loads(until_s)
        misses = {}
        for policy, options in POLICIES.items():
            recording = folder / f"{policy}.mcap"
            run = [binary, "run", scene, *settings, "--no-bus", "--until", str(until_s), "--record", recording]
            subprocess.run([*run, *options, "--slow-solver", str(FACTOR)], capture_output=True, text=True)
            every = int(statuses(binary, recording, folder / policy)[-1]["overruns"])
            rows = table(binary, recording, folder / policy, "overruns")
            misses[policy] = by_solver(rows)
            loaded = in_times(rows, [(start, end + 0.01) for start, end in begun])
            at_onset = in_times(rows, [(start, start + 0.02) for start, _ in begun])
            print(f"{policy}: {every} missed deadlines under {len(begun)} loads,", end=" ")
            print(f"{misses[policy]} of them by the solver ({loaded} while a load was on, {at_onset} within 20 ms of its onset)", flush=True)
        judge(expect, binary, folder, begun, misses, until_s)
        for policy in ("degrade", "spare"):
            verify = [binary, "verify", folder / f"{policy}.mcap", "--json"]
            found = json.loads(subprocess.run(verify, capture_output=True, text=True).stdout)
            expect(found["verdict"] in ("equal", "lossy"), f"{policy}: verify: {found['verdict']}, {found['findings']}")
    sys.exit(1 if failures else 0)


def returns_of(binary, folder, policy, begun, until_s):
    """Times from the end of each load to the return to the best level, and the number of switches."""
    commands = table(binary, folder / f"{policy}.mcap", folder / policy, "commands")
    switches = [(float(row["stamp.sim_time_s"]), row.get("control.level.name") or name_in(row)) for row in commands]
    ends = [end for _, end in begun if end + 2.5 < until_s and not any(start < end + 2.5 < stop for start, stop in begun)]
    returns = []
    for end in ends:
        back = [time for time, name in switches if name == "best" and end - 0.01 <= time]
        level = [name for time, name in switches if time < end]
        if level and level[-1] != "best":
            returns.append((back[0] if back else until_s) - end)
    given_up = sum("more than" in row["reply.reason"] for row in commands)
    print(f"  {policy}: {len(switches)} switches, {given_up} of them within a step;", end=" ")
    print(f"back at the best level after {max(returns, default=0):.2f} s at most")
    return returns


def judge(expect, binary, folder, begun, misses, until_s):
    returns = {policy: returns_of(binary, folder, policy, begun, until_s) for policy in ("degrade", "spare")}
    if not JUDGED:
        print("  measured, not judged")
        return
    expect(misses["catch-up"] >= 100 * until_s / 600, f"catch-up: {misses['catch-up']} deadlines missed by the solver, at least 100 in ten minutes")
    expect(misses["degrade"] <= len(begun), f"degrade: {misses['degrade']} deadlines missed by the solver, one for each load at most")
    expect(misses["spare"] == 0, f"spare: {misses['spare']} deadlines missed by the solver, none is allowed")
    for policy, times in returns.items():
        expect(max(times, default=0) <= 2.0, f"{policy}: back at the best level two seconds after a load at most")


def name_in(row):
    return next((value for key, value in row.items() if re.search(r"level.*name|name", key) and value), "")


if __name__ == "__main__":
    main()
