"""Work against precision: flexcrank and Exudyn on the same mechanisms, one thread each, taking turns in one run.

The error is the largest over two seconds in the crank's chord angle, against references computed with neither
(tests/data/README.md). For each level of error each program's least time that reaches it counts, whatever model, mesh, step or
setting it takes. Only stepping is timed, in the seconds of its thread.
"""

import argparse
import csv
import itertools
import subprocess
import sys
from pathlib import Path

import numpy as np

import exudyn_chain
from exudyn_chain import Settings

ROOT = Path(__file__).parent.parent.parent
LEVELS = {"ref-r2": (1e-1, 1e-2, 1e-3), "ref-r2s": (1e-1, 1e-2, 1e-3, 1e-4, 1e-5)}
GOAL = {1e-1: 10, 1e-2: 10, 1e-3: 10, 1e-4: 4, 1e-5: 4}
# No single run is to take longer, as far as the one before tells.
LONGEST_S = 30.0
# Runs near the best at a level are repeated, so that chance does not choose.
ROUNDS, NEAR = 5, 1.4
# A family whose error does not fall below this part of its least in so many steps has reached its mesh's.
GAIN, IDLE = 0.9, 3
# Instants are compared every 0.01 s; steps divide that.
DIVISORS = (1, 2, 3, 4, 5, 7, 10, 14, 20, 28, 40, 50, 70, 100, 140, 200, 280, 400, 700, 1000)
# Elements of crank and rod: as many for each, or of one length (the rod is three times as long). Likely ones first: what they reach
# tells which others cannot pay.
ELEMENTS = [(n, n) for n in (4, 8, 16, 2, 6, 12, 3, 24, 1, 32)] + [(-(-n // 3), n) for n in (2, 6, 3, 9, 12, 24)]
# Modes of crank and rod, and whether both may stretch: as many for each, or up to one frequency (the rod is three times as long).
MODES = [(n, n, False) for n in (2, 1, 3, 4, 5, 6)] + [(n // 3, n, True) for n in (6, 8, 9, 10, 11, 12)]


class Point:
    """A configuration of one program on one scene: its least time and its error."""

    def __init__(self, program, scene, names, run, angles):
        self.program, self.scene, self.names, self.run_it, self.angles = program, scene, names, run, angles
        self.seconds, self.error, self.runs = np.inf, np.inf, 0

    def run(self):
        answer = self.run_it()
        self.runs += 1
        if answer is not None:
            seconds, angles = answer
            self.seconds = min(self.seconds, seconds)
            self.error = float(np.max(np.abs(angles - self.angles)))

    def __str__(self):
        model, integrator, links, step_s = self.names
        return f"{model}, {integrator}, {links}, {step_s:g} s"


class Flexcrank:
    """The library behind a pipe, without bus or recording."""

    def __init__(self):
        command = ["cargo", "bench", "--quiet", "--bench", "solve"]
        self.process = subprocess.Popen(command, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def solve(self, scene, overrides):
        self.process.stdin.write(" ".join([scene, *overrides]) + "\n")
        self.process.stdin.flush()
        answer = self.process.stdout.readline()
        if answer.startswith("failed"):
            return None
        seconds, *angles = map(float, answer.split())
        return seconds, np.array(angles)


class Exudyn:
    """Exudyn in this process."""


def families(program, scene, angles, quick):
    """Points by family, from the longest step on."""
    steps_s = [exudyn_chain.INTERVAL_S / divisor for divisor in (DIVISORS[3:12:3] if quick else DIVISORS)]
    ways = exudyn_ways(scene, quick) if isinstance(program, Exudyn) else flexcrank_ways(program, scene, quick)
    name = type(program).__name__
    return [[Point(name, scene, (*names, step_s), run(step_s), angles) for step_s in steps_s] for names, run in ways]


def exudyn_ways(scene, quick):
    """Names of every way to solve a scene, and what makes a run of it for a step."""
    tuned = [
        Settings(spectral_radius=0.9, relative_tolerance=1e-6, reduced_integration=2),
        Settings(spectral_radius=0.9, relative_tolerance=1e-4, reduced_integration=2),
        Settings(spectral_radius=0.6, relative_tolerance=1e-6, reduced_integration=2),
        Settings(spectral_radius=0.6, relative_tolerance=1e-4, reduced_integration=2),
        Settings(spectral_radius=0.8, relative_tolerance=1e-6),
        Settings(spectral_radius=0.6, relative_tolerance=1e-8),
    ]
    for chosen, counts in itertools.product(tuned[: 1 if quick else None], ELEMENTS[: 3 if quick else None]):
        chosen = chosen._replace(solver="EigenDense" if max(counts) <= 4 else "EigenSparse")
        links = f"{named(*counts, 'element')}, ρ {chosen.spectral_radius}, tolerance {chosen.relative_tolerance:g}"
        links += ", reduced integration" if chosen.reduced_integration else ""
        run = lambda step_s, counts=counts, chosen=chosen: lambda: exudyn_chain.solve(scene, counts, step_s, chosen)
        yield ("Exudyn ANCF", "generalized-alpha", links), run


def flexcrank_ways(program, scene, quick):
    """The same of flexcrank."""
    integrators = [
        ("generalized-alpha", ()),
        ("two-point", ()),
        ("generalized-alpha", ("tolerance=1e-4",)),
        ("two-point", ("tolerance=1e-4",)),
        ("generalized-alpha", ("tolerance=1e-4", "rho_infinity=1")),
        ("generalized-alpha", ("tolerance=1e-6", "rho_infinity=0.6")),
        ("generalized-alpha", ("tolerance=1e-4", "rho_infinity=0.6")),
        ("composed-midpoint", ()),
        ("composed-midpoint", ("tolerance=1e-6",)),
        ("composed-midpoint", ("tolerance=1e-5",)),
        ("composed-midpoint", ("tolerance=1e-4",)),
    ]
    links = [("modal", *modes(*counts)) for counts in MODES]
    links += [("finite-element", *elements(*counts)) for counts in ELEMENTS]
    links += [("rigid", "", ())]
    for integrator, solver in integrators[: 1 if quick else None]:
        for model, size, keys in links[::4] if quick else links:
            words = [f"solver.{word}" for word in (f"model={model}", f"integrator={integrator}", *solver)] + list(keys)
            run = lambda step_s, words=words: lambda: program.solve(scene, [*words, f"solver.step_s={step_s}"])
            yield (model, integrator, ", ".join(([size] if size else []) + [*solver]) or "–"), run


def modes(crank, rod, axial):
    """What they are called, and the scene's keys for them."""
    return named(crank, rod, "mode") + ", axial" * axial, (f"crank.modes={crank}", f"rod.modes={rod}", *(f"{link}.axial={str(axial).lower()}" for link in ("crank", "rod")))


def elements(crank, rod):
    """The same of finite elements."""
    return named(crank, rod, "element"), (f"crank.elements={crank}", f"rod.elements={rod}")


def named(crank, rod, what):
    return (f"{rod} {what}" if crank == rod else f"{crank} and {rod} {what}") + "s" * (rod > 1)


def sweep(families, levels):
    """Runs families from their longest steps on, one run at a time, until shorter steps cannot pay."""
    least = {level: np.inf for level in levels}
    for family in families:
        for place, point in enumerate(family):
            point.run()
            yield
            for level in levels:
                if point.error <= level:
                    least[level] = min(least[level], point.seconds)
            finer = family[place + 1] if place + 1 < len(family) else None
            if finer is None or is_done(point, family[:place], finer, least):
                break


def is_done(point, before, finer, least):
    """Whether a family's shorter steps cannot be the best at any level: too dear for all that it may still reach, too long, or
    no better than its mesh allows."""
    if not np.isfinite(point.seconds):
        return False
    next_s = point.seconds * point.names[-1] / finer.names[-1]
    reachable = [seconds for level, seconds in least.items() if level < point.error]
    errors = [other.error for other in before] + [point.error]
    settled = len(errors) > IDLE and min(errors[-IDLE:]) > GAIN * min(errors[:-IDLE])
    return settled or next_s > LONGEST_S or all(next_s > NEAR * seconds for seconds in reachable)


def take_turns(*runs):
    """Goes through several sweeps at once, a run of each in turn."""
    for _ in itertools.zip_longest(*runs):
        pass


def best(points, level):
    holding = [point for point in points if point.error <= level]
    return min(holding, key=lambda point: point.seconds, default=None)


def compare(scene, programs, quick):
    """All points of a scene."""
    levels = LEVELS[scene]
    name = {"ref-r2": "R2", "ref-r2s": "R2s"}[scene]
    angles = np.loadtxt(ROOT / "tests" / "data" / f"{name}.csv", delimiter=",", skiprows=1)[:, 4]
    grids = [families(program, scene, angles, quick) for program in programs]
    take_turns(*(sweep(grid, levels) for grid in grids))
    points = [[point for family in grid for point in family if point.runs] for grid in grids]
    for _ in range(1, ROUNDS):
        again = [[point for point in own if is_near(point, own, levels)] for own in points]
        for pair in itertools.zip_longest(*again):
            for point in filter(None, pair):
                point.run()
    return [point for own in points for point in own]


def is_near(point, points, levels):
    least = [best(points, level) for level in levels if point.error <= level]
    return point.seconds < 2.0 and any(point.seconds <= NEAR * other.seconds for other in least if other)


def report(scene, points):
    """Prints the table of a scene; returns the goals missed."""
    missed = []
    print(f"\n{scene}: least seconds for two simulated seconds, by error of the crank's angle")
    for level in LEVELS[scene]:
        theirs, ours = (best([p for p in points if p.program == name], level) for name in ("Exudyn", "Flexcrank"))
        for point in (theirs, ours):
            if point:
                print(f"  {level:.0e} rad  {point.seconds:.3e} s  error {point.error:.1e}  {point}")
        if not (theirs and ours):
            missed.append(f"{scene} at {level:.0e} rad: reached by {'Exudyn' if theirs else 'flexcrank' if ours else 'neither'} only")
            continue
        ratio = theirs.seconds / ours.seconds
        print(f"             {ratio:.1f} times less time than Exudyn (goal {GOAL[level]})")
        if ratio < GOAL[level]:
            missed.append(f"{scene} at {level:.0e} rad: {ratio:.2f} times less time; the goal is {GOAL[level]}")
    return missed


def write(path, points):
    """As `flexcrank trade --csv` does, so that `flexcrank plot` draws the diagram."""
    with open(path, "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["model", "integrator", "discretization", "step_s", "error", "seconds_per_simulated_s"])
        for point in points:
            if np.isfinite(point.error):
                writer.writerow([*point.names, point.error, point.seconds / exudyn_chain.UNTIL_S])


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--quick", action="store_true", help="a few configurations on ref-r2s: whether it works at all")
    arguments.add_argument("--out", type=Path, default=ROOT / "target" / "versus-exudyn", help="folder for tables and figures")
    arguments = arguments.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    programs = [Exudyn(), Flexcrank()]
    missed = []
    for scene in ["ref-r2s"] if arguments.quick else LEVELS:
        points = compare(scene, programs, arguments.quick)
        path = arguments.out / f"{scene}.csv"
        write(path, points)
        missed += report(scene, points)
        title = f"{scene}: largest error of the crank's angle [rad], beside Exudyn"
        subprocess.run([ROOT / "target/release/flexcrank", "plot", path, "--title", title, "-o", path.with_suffix(".svg")], check=True)
    if missed and not arguments.quick:
        sys.exit("goals missed:\n  " + "\n  ".join(missed))


if __name__ == "__main__":
    main()
