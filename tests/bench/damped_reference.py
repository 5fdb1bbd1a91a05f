"""The reference of the default scene (`tests/data/crank-slider.csv`): damped links that stretch, by two other programs.

1. `spline_chain.py`: splines of degree 7, Radau IIA of order 5. Its finest run is the reference.
2. Exudyn's cubic ANCF cables with generalized-alpha, extrapolated in the step.

Prints how far the runs of each lie apart, and the two programs; takes about half an hour.
Usage, in the environment that `versus-exudyn` makes: python tests/bench/damped_reference.py [FILE | --quick]
--quick: a coarse run of each, against the file; exit code 1 if a crank's angle is off by more than 2e-3 rad. It writes nothing.
"""

import sys
from pathlib import Path

import numpy as np

import exudyn_chain
import spline_chain
from exudyn_chain import LENGTHS_M, SCENES, Settings, exu

FILE = Path(__file__).parent.parent / "data" / "crank-slider.csv"
HEADER = (
    "t_s,xB_m,yB_m,xC_m,crank_chord_angle_rad,crank_root_angle_rad,crank_mid_defl_m,rod_mid_defl_m,"
    "crank_chord_elong_m,rod_chord_elong_m,total_energy_J"
)
COLUMNS = HEADER.split(",")
# Spans of crank and rod, degree, step in s, stages.
SPLINES = [((4, 8), 7, 2e-4, 3), ((6, 12), 7, 2e-4, 3), ((6, 12), 7, 1e-4, 3), ((10, 24), 7, 1e-4, 3)]
# Elements of each link, steps in s.
MESHES, STEPS_S = (32, 64), (2e-5, 1e-5, 5e-6)
# Of the quick runs.
SPLINE, CABLES, BOUND_RAD = ((2, 4), 5, 1e-3, 2), (8, 5e-4), 2e-3


def splines(spans, degree, step_s, stages):
    bars = SCENES["crank-slider"]
    mechanism = spline_chain.Mechanism(
        second_moment_m4=bars.second_moment_m4, damping_s=bars.damping_s, slider_kg=bars.slider_kg
    )
    return spline_chain.solve(mechanism, spans, degree, step_s, stages)


def cables(elements, step_s):
    """The same columns from Exudyn, but the energy."""
    bars = SCENES["crank-slider"]
    mbs, loads, crank, rod = exudyn_chain.chain(bars, (elements, elements), 0)
    position, middle = exu.OutputVariableType.Position, elements // 2
    nodes = [crank[middle], crank[-1], rod[middle], rod[-1]]
    sensors = [exudyn_chain.watch(mbs, node, position) for node in nodes]
    sensors.append(exudyn_chain.watch(mbs, crank[0], exu.OutputVariableType.Coordinates))
    mbs.Assemble()
    _, rows = exudyn_chain.run(mbs, bars, loads, sensors, step_s, Settings(relative_tolerance=1e-10))
    mid1, b, mid2, end = (of[:, :2] for of in rows[:4])
    slope = rows[4][:, 2:4] + [1, 0]  # coordinates are displacements
    out = [np.arange(len(b)) * exudyn_chain.INTERVAL_S, b[:, 0], b[:, 1], end[:, 0]]
    out += [np.unwrap(np.arctan2(of[:, 1], of[:, 0])) for of in (b, slope)]
    for start, mid, stop in ((0 * b, mid1, b), (b, mid2, end)):
        along = (stop - start) / np.hypot(*(stop - start).T)[:, None]
        out.append(along[:, 0] * (mid - start)[:, 1] - along[:, 1] * (mid - start)[:, 0])
    out += [np.hypot(*b.T) - LENGTHS_M[0], np.hypot(*(end - b).T) - LENGTHS_M[1]]
    return np.array(out).T


def apart(what, a, b):
    columns = zip(COLUMNS[1:], np.abs(a[:, 1 : b.shape[1]] - b[:, 1 : a.shape[1]]).max(0))
    off = {name: most for name, most in columns}
    print(f"{what}: " + ", ".join(f"{name} {most:.0e}" for name, most in off.items()), flush=True)
    return off


def quick():
    rows = np.loadtxt(FILE, delimiter=",", skiprows=1)
    off = [apart(f"splines {SPLINE} and the file", splines(*SPLINE), rows), apart(f"Exudyn {CABLES} and the file", cables(*CABLES), rows)]
    sys.exit(any(one["crank_chord_angle_rad"] > BOUND_RAD for one in off))


def main():
    if sys.argv[1:] == ["--quick"]:
        quick()
    finest = None
    for setting in SPLINES:
        rows = splines(*setting)
        if finest is not None:
            apart(f"splines {setting} and the one before", rows, finest)
        finest = rows
    path = Path(sys.argv[1]) if len(sys.argv) > 1 else FILE
    np.savetxt(path, finest, fmt="%.12g", delimiter=",", header=HEADER, comments="")
    for elements in MESHES:
        coarser = None
        for step_s in STEPS_S:
            rows = cables(elements, step_s)
            apart(f"Exudyn, {elements} elements, {step_s:g} s, and splines", rows, finest)
            if coarser is not None:
                apart("  and the step before", rows, coarser)
                apart("  extrapolated in the step, and splines", (4 * rows - coarser) / 3, finest)
            coarser = rows


if __name__ == "__main__":
    main()
