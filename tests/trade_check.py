"""Whether the errors that `trade` states are true: computed anew from recordings of the same configurations, against a
reference that was computed elsewhere (tests/data/README.md)."""

import csv
import math
import subprocess
import sys
import tempfile
from pathlib import Path

BINARY = sys.argv[1]
SCENE = "ref-r2s"
REFERENCE = Path(__file__).parent / "data" / "R2s.csv"
UNTIL_S, PER_S = 2, 100
WITHIN = 0.2
LEAST = 128  # 2 integrators, 2 models of 2 sizes at 2 steps, 4 channels, 2 kinds of error
ASKED = ["--models", "modal,finite-element", "--integrators", "generalized-alpha,esdirk", "--modes", "1,2", "--elements", "2,4",
         "--steps", "2e-3,1e-3", "--until", str(UNTIL_S), "--budget", "120"]
# Channel of trade, column of the reference, topic and column of an export (MIDDLE is the number of the middle node).
CHANNELS = [
    ("crank_angle_rad", "crank_chord_angle_rad", "angles", "links.crank.chord_rad"),
    ("end_position_m", "xC_m", "displacements", "nodes.rod.LAST.x_m"),
    ("first_link_deflection_m", "crank_mid_defl_m", "displacements", "nodes.crank.MIDDLE.deflection_m"),
    ("second_link_deflection_m", "rod_mid_defl_m", "displacements", "nodes.rod.MIDDLE.deflection_m"),
]


def flexcrank(*arguments):
    done = subprocess.run([BINARY, *arguments], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"flexcrank {' '.join(arguments)}: exit code {done.returncode}\n{done.stderr}")


def table(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def elements_of(row):
    return int(row["discretization"].split()[0]) if row["model"] == "finite-element" else 2


def record(row, folder):
    """Runs a configuration of trade's table; returns the exported rows of its topics."""
    links = "modes" if row["model"] == "modal" else "elements"
    keys = [f"solver.{key}={row[column]}" for key, column in
            (("model", "model"), ("integrator", "integrator"), ("step_s", "step_s"))]
    for link in ("crank", "rod"):
        keys += [f"{link}.elements={elements_of(row)}", f"{link}.{links}={row['discretization'].split()[0]}"]
    path = folder / "run.mcap"
    flexcrank("run", SCENE, "--name", "trade-check", "--listen", "tcp/127.0.0.1:0", "--pace", "max", "--until", str(UNTIL_S),
              "--publish-hz", str(PER_S), "--record", str(path), *(word for key in keys for word in ("--set", key)))
    flexcrank("export", str(path), "--csv", str(folder / "tables"))
    path.unlink()
    return {topic: table(next((folder / "tables").glob(f"*.{topic}.csv"))) for topic in ("angles", "displacements")}


def errors(row, reference, exported):
    """Largest and root-mean-square difference in each channel."""
    last = elements_of(row)
    for name, column, topic, wanted in CHANNELS:
        wanted = wanted.replace("LAST", str(last)).replace("MIDDLE", str(last // 2))
        seen = {round(float(line["stamp.sim_time_s"]) * PER_S): float(line[wanted]) for line in exported[topic]}
        off = [seen[k] - float(line[column]) for k, line in enumerate(reference)]
        yield name, max(map(abs, off)), math.sqrt(sum(x * x for x in off) / len(off))


def main():
    reference = table(REFERENCE)
    worst, compared = 0.0, 0
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        flexcrank("trade", SCENE, *ASKED, "--csv", str(folder / "trade.csv"))
        for row in table(folder / "trade.csv"):
            named = f"{row['model']}, {row['discretization']}, {float(row['step_s']):g} s"
            if row["failure"]:
                sys.exit(f"{named}: {row['failure']}")
            for channel, *true in errors(row, reference, record(row, folder)):
                for kind, true in zip(("max", "rms"), true):
                    stated = float(row[f"{kind}_error_{channel}"])
                    off = abs(stated / true - 1)
                    worst, compared = max(worst, off), compared + 1
                    print(f"{'ok  ' if off <= WITHIN else 'FAIL'} {named}: {kind} error of {channel}: "
                          f"stated {stated:.4e}, from its recording {true:.4e}, off by {off:.2%}", flush=True)
    if compared < LEAST:
        sys.exit(f"trade-check: only {compared} of {LEAST} errors were stated: did trade run out of its time?")
    if worst > WITHIN:
        sys.exit(f"trade-check: off by up to {worst:.1%}; {WITHIN:.0%} is allowed")
    print(f"trade-check: {compared} stated errors agree with recordings, the worst within {worst:.2%}")


if __name__ == "__main__":
    main()
