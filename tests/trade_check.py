"""Whether the errors that `trade` states are true: computed anew from recordings of the same configurations, against
references that were computed elsewhere (tests/data/README.md).

- Angle, slider and deflections: against the reference's file, at each of its instants.
- Forces: no reference has them. A recording of 16 finite elements a link at 0.1 ms takes its place; its angle, slider and deflections
  lie nearer to the file than a fifth of every error that is judged.
- Energy: kinetic and strain energy of the recording against the work in it, over the largest energy in the reference's file.
"""

import csv
import math
import subprocess
import sys
import tempfile
from pathlib import Path

BINARY = sys.argv[1]
DATA = Path(__file__).parent / "data"
SCENES = {"ref-r2s": "R2s.csv", "crank-slider": "crank-slider.csv"}
UNTIL_S, PER_S = 2, 100
WITHIN = 0.2
# 2 scenes, 2 integrators, 2 models of 2 sizes at 2 steps; 7 channels with 2 kinds of error, and energy.
LEAST = 2 * 16 * (7 * 2 + 1)
ASKED = ["--models", "modal,finite-element", "--integrators", "generalized-alpha,esdirk", "--modes", "1,3", "--elements", "2,4",
         "--steps", "2e-3,1e-3", "--until", str(UNTIL_S), "--budget", "120"]
FINE = {"model": "finite-element", "integrator": "esdirk", "step_s": "1e-4", "discretization": "16 elements"}
# Channel of trade, column of the reference, topic and column of an export (MIDDLE is the number of the middle node).
CHANNELS = [
    ("crank_angle_rad", "crank_chord_angle_rad", "angles", "links.crank.chord_rad"),
    ("end_position_m", "xC_m", "displacements", "nodes.rod.LAST.x_m"),
    ("first_link_deflection_m", "crank_mid_defl_m", "displacements", "nodes.crank.MIDDLE.deflection_m"),
    ("second_link_deflection_m", "rod_mid_defl_m", "displacements", "nodes.rod.MIDDLE.deflection_m"),
]
FORCES = [("pivot_force_n", "pivot"), ("crank_pin_force_n", "crank-pin"), ("slider_pin_force_n", "slider-pin")]


def flexcrank(*arguments):
    done = subprocess.run([BINARY, *arguments], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"flexcrank {' '.join(arguments)}: exit code {done.returncode}\n{done.stderr}")


def table(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def elements_of(row):
    return int(row["discretization"].split()[0]) if row["model"] == "finite-element" else 2


def record(scene, row, folder):
    """Runs a configuration of trade's table; returns the exported rows of its topics, by instant."""
    keys = [f"solver.{key}={row[key]}" for key in ("model", "integrator", "step_s")]
    keys += [f"{link}.elements={elements_of(row)}" for link in ("crank", "rod")]
    if row["model"] == "modal":
        # The number is the rod's; the crank, a third as long, has those up to the same frequency.
        modes = int(row["discretization"].split()[0])
        keys += [f"rod.modes={modes}", f"crank.modes={max(1, modes // 3)}"]
        # Both links stretch, or none does.
        stretches = str("axial" in row["discretization"]).lower()
        keys += [f"{link}.axial={stretches}" for link in ("crank", "rod")]
    path = folder / "run.mcap"
    flexcrank("run", scene, "--name", "trade-check", "--listen", "tcp/127.0.0.1:0", "--pace", "max", "--until", str(UNTIL_S),
              "--publish-hz", str(PER_S), "--record", str(path), *(word for key in keys for word in ("--set", key)))
    flexcrank("export", str(path), "--csv", str(folder / "tables"))
    path.unlink()
    instant = lambda line: round(float(line["stamp.sim_time_s"]) * PER_S)
    return {topic: {instant(line): line for line in table(next((folder / "tables").glob(f"*.{topic}.csv")))}
            for topic in ("angles", "displacements", "loads", "energies")}


def largest_and_rms(off):
    return {"max": max(off), "rms": math.sqrt(sum(x * x for x in off) / len(off))}


def of_positions(row, reference, exported):
    """Errors in the channels that the reference has."""
    last = elements_of(row)
    for name, column, topic, wanted in CHANNELS:
        wanted = wanted.replace("LAST", str(last)).replace("MIDDLE", str(last // 2))
        yield name, largest_and_rms([abs(float(exported[topic][k][wanted]) - float(line[column])) for k, line in enumerate(reference)])


def of_forces(fine, exported):
    for name, joint in FORCES:
        force = lambda rows, k: [float(rows["loads"][k][f"joints.{joint}.f{axis}_n"]) for axis in "xy"]
        yield name, largest_and_rms([math.dist(force(exported, k), force(fine, k)) for k in range(UNTIL_S * PER_S + 1)])


def of_energy(reference, exported):
    """What the works do not account for, over the most energy there is."""
    energy_j = lambda line: float(line["kinetic_j"]) + float(line["strain_j"])
    off_j = [energy_j(line) + float(line["dissipated_j"]) - float(line["work_in_j"]) for line in exported["energies"].values()]
    return max(map(abs, off_j)) / max(float(line["total_energy_J"]) for line in reference)


class Judge:
    def __init__(self):
        self.worst, self.compared = 0.0, 0

    def compare(self, what, stated, true):
        off = abs(stated / true - 1)
        self.worst, self.compared = max(self.worst, off), self.compared + 1
        print(f"{'ok  ' if off <= WITHIN else 'FAIL'} {what}: stated {stated:.4e}, from its recording {true:.4e}, off by {off:.2%}", flush=True)


def check(scene, reference, folder, judge):
    flexcrank("trade", scene, *ASKED, "--csv", str(folder / "trade.csv"))
    fine = record(scene, FINE, folder)
    own = dict(of_positions(FINE, reference, fine))
    for row in table(folder / "trade.csv"):
        named = f"{scene}, {row['model']}, {row['integrator']}, {row['discretization']}, {float(row['step_s']):g} s"
        if row["failure"]:
            sys.exit(f"{named}: {row['failure']}")
        exported = record(scene, row, folder)
        for channel, true in [*of_positions(row, reference, exported), *of_forces(fine, exported)]:
            for kind in ("max", "rms"):
                judge.compare(f"{named}: {kind} error of {channel}", float(row[f"{kind}_error_{channel}"]), true[kind])
            if channel in own and own[channel]["max"] > true["max"] / 5:
                sys.exit(f"{named}: {channel}: 16 elements err by {own[channel]['max']:.1e}, too near to {true['max']:.1e}")
        judge.compare(f"{named}: error of energy", float(row["relative_error_energy"]), of_energy(reference, exported))


def main():
    judge = Judge()
    for scene, file in SCENES.items():
        with tempfile.TemporaryDirectory() as folder:
            check(scene, table(DATA / file), Path(folder), judge)
    if judge.compared < LEAST:
        sys.exit(f"trade-check: only {judge.compared} of {LEAST} errors were stated: did trade run out of its time?")
    if judge.worst > WITHIN:
        sys.exit(f"trade-check: off by up to {judge.worst:.1%}; {WITHIN:.0%} is allowed")
    print(f"trade-check: {judge.compared} stated errors agree with recordings, the worst within {judge.worst:.2%}")


if __name__ == "__main__":
    main()
