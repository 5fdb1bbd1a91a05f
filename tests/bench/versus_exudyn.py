"""Work against precision: flexcrank and Exudyn on the same mechanisms, one thread each, taking turns in one run.

**Error.** The largest over two seconds in the crank's chord angle, against references computed with neither (tests/data/README.md).
A configuration reaches a level of error only if the next two finer steps of its family reach it, too: where errors happen to
cancel, nothing is counted. For each level each program's least time counts. Only stepping is timed, in the seconds of its thread.

**What each program may choose.**

- Both: elements or modes of each link, and the step.
- Exudyn: cubic ANCF cables, with full or reduced integration, or its reduced-order flexible bodies, one or several a link; its
  generalized-alpha with modified Newton, the spectral radius and Newton's tolerance. It has the linear solver that was quickest.
- flexcrank: its models `modal` (with or without stretch), `finite-element` and `rigid`; its integrators `generalized-alpha`,
  `two-point` and `esdirk`, Newton's tolerance and the spectral radius.

So flexcrank has more models and schemes to choose from; that is part of what is compared. Like for like is the last table: cubic
finite elements and generalized-alpha in both, as many elements, the same step.

Exit code 1 when a goal is missed.
"""

import argparse
import csv
import itertools
import subprocess
import sys
from pathlib import Path

import numpy as np

import exudyn_chain
import exudyn_reduced
from exudyn_chain import Settings

ROOT = Path(__file__).parent.parent.parent
# How many times less time flexcrank is to take, by scene and level of error in rad.
GOALS = {
    "ref-r2": {1e-1: 10, 1e-2: 10, 1e-3: 6},
    "ref-r2s": {1e-1: 10, 1e-2: 10, 1e-3: 10, 1e-4: 4, 1e-5: 4},
}
REFERENCES = {"ref-r2": "R2.csv", "ref-r2s": "R2s.csv"}
# Like for like: elements of each link, one step, and how many times as many steps a second.
ALIKE_SCENE, ALIKE_ELEMENTS, ALIKE_STEP_S, ALIKE_GOAL = "ref-r2s", (4, 8, 16, 32), 1e-4, 4
# No single run is to take longer, as far as the one before tells.
LONGEST_S = 30.0
# Runs near the best at a level are repeated, so that chance does not choose: long ones once, others more often.
ROUNDS, NEAR, LONG_S = 5, 1.4, 2.0
# So many finer steps must hold a level, too.
FINER = 2
# A family whose error does not fall below this part of its least in so many steps has reached its mesh's. With 3, the search on ref-r2
# gave up ESDIRK with 8 and 24 elements at 0.36 ms, where errors rise a little before they fall.
GAIN, IDLE = 0.9, 5
# Instants are compared every 0.01 s; steps divide that.
DIVISORS = (1, 2, 3, 4, 5, 7, 10, 14, 20, 28, 40, 50, 70, 100, 140, 200, 280, 400, 500, 700, 1000, 1400, 2000)
# Elements of crank and rod: as many for each, or of one length (the rod is three times as long). Likely ones first: what they reach
# tells which others cannot pay.
ELEMENTS = [(n, n) for n in (4, 8, 16, 2, 6, 12, 3, 24, 1, 32)] + [(-(-n // 3), n) for n in (2, 6, 3, 9, 12, 24)]
# Modes of crank and rod, and whether both may stretch: as many for each, or up to one frequency (the rod is three times as long).
MODES = [(n, n, False) for n in (2, 1, 3, 4, 5, 6)] + [(n // 3, n, True) for n in (6, 8, 9, 10, 11, 12)]
# Sines a body and bodies a link, of crank and rod, in Exudyn's reduced-order form.
REDUCED = [((1, 1), (1, 1)), ((1, 2), (1, 1)), ((1, 3), (1, 1)), ((1, 1), (1, 2)), ((1, 1), (2, 2)), ((1, 1), (1, 3))]


class Point:
    """A configuration of one program on one scene: its least time and its error."""

    def __init__(self, program, scene, names, run, angles):
        self.program, self.scene, self.names, self.run_it, self.angles = program, scene, names, run, angles
        self.seconds, self.error, self.runs = np.inf, np.inf, 0
        self.finer = []

    def run(self):
        answer = self.run_it()
        self.runs += 1
        if answer is not None:
            seconds, angles = answer
            self.seconds = min(self.seconds, seconds)
            self.error = float(np.max(np.abs(angles - self.angles)))

    def holds(self, level):
        """Whether it reaches a level, and the next finer steps of its family do."""
        return len(self.finer) == FINER and all(point.error <= level for point in (self, *self.finer))

    def __str__(self):
        model, integrator, links, step_s = self.names
        return f"{model}, {integrator}, {links}, {step_s:g} s"


class Flexcrank:
    """The library behind a pipe, without bus or recording."""

    def __init__(self, quick):
        command = ["cargo", "test" if quick else "bench", "--quiet", "--bench", "solve"]
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
    steps_s = [exudyn_chain.INTERVAL_S / divisor for divisor in (DIVISORS[3:12:2] if quick else DIVISORS)]
    ways = exudyn_ways(scene, quick) if isinstance(program, Exudyn) else flexcrank_ways(program, scene, quick)
    name = type(program).__name__
    all_of = [[Point(name, scene, (*names, step_s), run(step_s), angles) for step_s in steps_s] for names, run in ways]
    for family in all_of:
        for place, point in enumerate(family):
            point.finer = family[place + 1 : place + 1 + FINER]
    return all_of


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
        links = f"{named(*counts, 'element')}, {described(chosen)}" + ", reduced integration" * bool(chosen.reduced_integration)
        run = lambda step_s, counts=counts, chosen=chosen: lambda: exudyn_chain.solve(scene, counts, step_s, chosen)
        yield ("Exudyn ANCF", "generalized-alpha", links), run
    for chosen, (modes, bodies) in itertools.product(tuned[: 1 if quick else 4], REDUCED[: 2 if quick else None]):
        chosen = chosen._replace(solver="EXUdense" if max(bodies) == 1 else "EigenDense")
        links = f"{named(*bodies, 'part')} of {named(*modes, 'mode')}, {described(chosen)}"
        run = lambda step_s, sizes=(modes, bodies), chosen=chosen: lambda: exudyn_reduced.solve(scene, *sizes, step_s, chosen)
        yield ("Exudyn reduced-order", "generalized-alpha", links), run


def described(chosen):
    return f"ρ {chosen.spectral_radius}, tolerance {chosen.relative_tolerance:g}"


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
        ("esdirk", ()),
        ("esdirk", ("tolerance=1e-6",)),
        ("esdirk", ("tolerance=1e-5",)),
        ("esdirk", ("tolerance=1e-4",)),
    ]
    links = [("modal", *modes(*counts)) for counts in MODES]
    links += [("finite-element", *elements(*counts)) for counts in ELEMENTS]
    links += [("rigid", "", ())]
    for integrator, solver in integrators[::7] if quick else integrators:
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
    for number, family in enumerate(families):
        if number % 10 == 0:
            print(f"{family[0].scene}: {family[0].program}, {number} of {len(families)} families", file=sys.stderr)
        for place, point in enumerate(family):
            point.run()
            yield
            for level in levels:
                for earlier in family[max(0, place - FINER) : place]:
                    if earlier.holds(level):
                        least[level] = min(least[level], earlier.seconds)
            if not point.finer or is_done(family[: place + 1], point.finer[0], least):
                break


def is_done(run, finer, least):
    """Whether a family's shorter steps are not needed: at no level can one of them be the best, nor one that ran already and
    counts only if they reach the level, too. They cannot where they are too dear, take too long, or the mesh allows no more."""
    point = run[-1]
    if not np.isfinite(point.seconds):
        return False
    next_s = point.seconds * point.names[-1] / finer.names[-1]
    errors = [other.error for other in run]
    settled = len(errors) > IDLE and min(errors[-IDLE:]) > GAIN * min(errors[:-IDLE])
    wanted = False
    for level, seconds in least.items():
        reaching = len(list(itertools.takewhile(lambda error: error <= level, reversed(errors))))
        if reaching == 0:
            wanted |= not settled and next_s <= NEAR * seconds
        elif reaching <= FINER:
            wanted |= run[-reaching].seconds <= NEAR * seconds
    return not wanted or next_s > LONGEST_S


def take_turns(*runs):
    """Goes through several sweeps at once, a run of each in turn."""
    for _ in itertools.zip_longest(*runs):
        pass


def best(points, level):
    holding = [point for point in points if point.holds(level)]
    return min(holding, key=lambda point: point.seconds, default=None)


def compare(scene, programs, quick):
    """All points of a scene."""
    levels = GOALS[scene]
    angles = np.loadtxt(ROOT / "tests" / "data" / REFERENCES[scene], delimiter=",", skiprows=1)[:, 4]
    grids = [families(program, scene, angles, quick) for program in programs]
    take_turns(*(sweep(grid, levels) for grid in grids))
    points = [[point for family in grid for point in family if point.runs] for grid in grids]
    for turn in range(1, ROUNDS):
        again = [[point for point in own if is_near(point, own, levels, turn)] for own in points]
        for pair in itertools.zip_longest(*again):
            for point in filter(None, pair):
                point.run()
    return [point for own in points for point in own]


def is_near(point, points, levels, turn):
    least = [best(points, level) for level in levels if point.holds(level)]
    return (turn == 1 or point.seconds < LONG_S) and any(point.seconds <= NEAR * other.seconds for other in least if other)


def report(scene, points):
    """Prints the table of a scene; returns the goals missed."""
    missed = []
    print(f"\n{scene}: least seconds for two simulated seconds, by error of the crank's angle")
    for level, goal in GOALS[scene].items():
        theirs, ours = (best([p for p in points if p.program == name], level) for name in ("Exudyn", "Flexcrank"))
        other = best([p for p in points if p.program == "Exudyn" and (theirs is None or p.names[0] != theirs.names[0])], level)
        for point in filter(None, (theirs, other, ours)):
            print(f"  {level:.0e} rad  {point.seconds:.3e} s  error {point.error:.1e}  {point}")
        if not (theirs and ours):
            by = "Exudyn only" if theirs else "flexcrank only" if ours else "neither"
            missed.append(f"{scene} at {level:.0e} rad: reached by {by}")
            continue
        ratio = theirs.seconds / ours.seconds
        print(f"             {ratio:.1f} times less time than Exudyn (goal {goal})")
        if ratio < goal:
            missed.append(f"{scene} at {level:.0e} rad: {ratio:.2f} times less time; the goal is {goal}")
    for model in sorted({point.names[0] for point in points}):
        point = min((p for p in points if p.names[0] == model), key=lambda p: p.error)
        print(f"  least error of {model}: {point.error:.1e} rad, {point.seconds:.3e} s, {point}")
    return missed


def alike(programs, quick):
    """Finite elements of both, as many, with the same scheme and step: prints steps a second and returns the goals missed.

    Both take the same points of quadrature (Exudyn's reduced integration). Each has the quickest of three tolerances of Newton's
    iteration that leaves the error what the tightest makes it, to a tenth: that of mesh and step.
    """
    exudyn, flexcrank = (next(p for p in programs if type(p) is kind) for kind in (Exudyn, Flexcrank))
    angles = np.loadtxt(ROOT / "tests" / "data" / REFERENCES[ALIKE_SCENE], delimiter=",", skiprows=1)[:, 4]
    step_s, rounds = (10 * ALIKE_STEP_S, 1) if quick else (ALIKE_STEP_S, ROUNDS)
    steps, missed = exudyn_chain.UNTIL_S / step_s, []
    print(f"\nlike for like: {ALIKE_SCENE}, finite elements, generalized-alpha, {step_s:g} s: steps a second")
    for count in ALIKE_ELEMENTS[:1] if quick else ALIKE_ELEMENTS:
        both = [[alike_point(program, count, step_s, tolerance, angles) for tolerance in tolerances]
                for program, tolerances in ((exudyn, (1e-8, 1e-6, 1e-4)), (flexcrank, (1e-9, 1e-6, 1e-4)))]
        for _, pair in itertools.product(range(rounds), zip(*both)):
            for point in pair:
                point.run()
        theirs, ours = (min((p for p in own if abs(p.error / own[0].error - 1) <= 0.1), key=lambda p: p.seconds) for own in both)
        for point in (theirs, ours):
            print(f"  {point.program:9} {steps / point.seconds:8.0f}  error {point.error:.1e} rad  {point.names[2]}")
        ratio = theirs.seconds / ours.seconds
        print(f"             {ratio:.1f} times as many as Exudyn (goal {ALIKE_GOAL})")
        if not ratio >= ALIKE_GOAL:
            missed.append(f"like for like, {count} elements: {ratio:.2f} times as many steps a second; the goal is {ALIKE_GOAL}")
    return missed


def alike_point(program, count, step_s, tolerance, angles):
    names = (named(count, count, "element") + f", tolerance {tolerance:g}", step_s)
    if isinstance(program, Exudyn):
        chosen = Settings(0.9, tolerance, 2, "EigenDense" if count <= 4 else "EigenSparse")
        run = lambda: exudyn_chain.solve(ALIKE_SCENE, (count, count), step_s, chosen)
        return Point("Exudyn", ALIKE_SCENE, ("Exudyn ANCF", "generalized-alpha", *names), run, angles)
    words = ["model=finite-element", "integrator=generalized-alpha", f"step_s={step_s}", f"tolerance={tolerance}"]
    words = [f"solver.{word}" for word in words] + list(elements(count, count)[1])
    run = lambda: program.solve(ALIKE_SCENE, words)
    return Point("Flexcrank", ALIKE_SCENE, ("finite-element", "generalized-alpha", *names), run, angles)


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
    arguments.add_argument("--quick", action="store_true", help="a few configurations on ref-r2s: whether it works; judges no time")
    arguments.add_argument("--scene", choices=GOALS, help="only this one, without the table of like for like")
    arguments.add_argument("--out", type=Path, default=ROOT / "target" / "versus-exudyn", help="folder for tables and figures")
    arguments = arguments.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    programs = [Exudyn(), Flexcrank(arguments.quick)]
    binary = ROOT / "target" / ("debug" if arguments.quick else "release") / "flexcrank"
    missed = []
    for scene in [arguments.scene] if arguments.scene else ["ref-r2s"] if arguments.quick else GOALS:
        points = compare(scene, programs, arguments.quick)
        path = arguments.out / f"{scene}.csv"
        write(path, points)
        missed += report(scene, points)
        title = f"{scene}: largest error of the crank's angle [rad], beside Exudyn"
        subprocess.run([binary, "plot", path, "--title", title, "-o", path.with_suffix(".svg")], check=True)
        for name in ("Exudyn", "Flexcrank") if arguments.quick else ():
            if not best([point for point in points if point.program == name], 1e-2):
                sys.exit(f"{name} does not reach 1e-2 rad")
    if not arguments.scene:
        missed += alike(programs, arguments.quick)
    if missed and not arguments.quick:
        sys.exit("goals missed:\n  " + "\n  ".join(missed))


if __name__ == "__main__":
    main()
