"""Natural frequencies of a flexible crank-slider at rest, at 36 crank angles: by Exudyn, and exact ones.

They are `tests/data/exudyn-modes.csv` and `tests/data/exact-modes.csv`.

The mechanism is the default scene's, without damping: links are straight and unloaded, and nothing moves. Each link is a row of
cubic ANCF cables. Exudyn linearises about this state and projects mass and stiffness into the null space of the constraints'
Jacobian by a singular value decomposition; LAPACK solves the dense symmetric problem (`ComputeODE2Eigenvalues`).

- `free`: the crank turns about its pivot. The chain then has one motion of zero frequency, which is left out.
- `held`: the direction of the crank's tangent at the pivot is fixed; the crank may still stretch there.

The exact frequencies are those of Euler–Bernoulli links that stretch, without rotary inertia: there the determinant of the
conditions at the mechanism's ends and joint is zero. They use neither elements nor Exudyn.

The script prints the largest relative errors by mode, and checks that they are small:

1. Exudyn's frequencies with 8, 16 and 32 elements a link against the exact ones.
2. The mechanism against its mirror image: both programs' rounding.
3. A clamped crank alone against a cantilever's closed form.
4. The rod between a stiff held crank and a heavy slider against the closed form of two pinned ends.

If a check fails, the script ends with exit code 1 and writes nothing.
Usage, in the environment that `versus-exudyn` makes, with SciPy: python tests/bench/exudyn_modes.py [FOLDER]
"""

import os
import sys
from pathlib import Path
from typing import NamedTuple

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # sums are rounded the same way in every run
import numpy as np
from exudyn.itemInterface import MarkerNodeCoordinates, NodePointGround, ObjectConnectorCoordinateVector
from scipy.optimize import brentq

from exudyn_chain import (
    AREA_M2,
    DENSITY,
    E_PA,
    LENGTHS_M,
    SCENES,
    GenerateStraightLineANCFCable2D,
    MarkerNodePosition,
    MassPoint2D,
    ObjectANCFCable2D,
    RevoluteJoint2D,
    exu,
)

FOLDER = Path(__file__).parent.parent / "data"
ANGLES_DEG, VARIANTS, MODES = range(0, 360, 10), ("free", "held"), 5
ELEMENTS, MESHES = 16, (8, 16, 32)
BARS = SCENES["crank-slider"]
BENDING, AXIAL, LINE_DENSITY = E_PA * BARS.second_moment_m4, E_PA * AREA_M2, DENSITY * AREA_M2
# The largest relative errors that the checks allow. Cubic elements converge with the fourth power of their length.
MESH_BOUNDS = {8: 5e-3, 16: 3e-4, 32: 2e-5}
CANTILEVER_BOUND, PINNED_BOUND, ROUNDING_BOUND = 5e-5, 1e-4, 1e-8
# A motion of lower frequency counts as one of zero frequency.
ZERO_HZ = 0.01


class Chain(NamedTuple):
    """The mechanism; only a check changes the slider's mass and the crank's stiffness."""

    angle_deg: float
    variant: str
    elements: int = ELEMENTS
    slider_kg: float = BARS.slider_kg
    crank_stiffening: float = 1.0


def directions(angle_deg):
    """Unit vectors along crank and rod."""
    angle = np.radians(angle_deg)
    crank = np.array([np.cos(angle), np.sin(angle)])
    sine = -crank[1] * LENGTHS_M[0] / LENGTHS_M[1]
    return crank, np.array([np.sqrt(1 - sine**2), sine])


def link(mbs, start_m, end_m, elements, fixed_start, fixed_end, stiffening=1.0):
    """Node numbers of a link of cables without damping."""
    cable = ObjectANCFCable2D(
        physicsMassPerLength=LINE_DENSITY,
        physicsBendingStiffness=stiffening * BENDING,
        physicsAxialStiffness=stiffening * AXIAL,
    )
    ends = [[*start_m, 0], [*end_m, 0]]
    return GenerateStraightLineANCFCable2D(
        mbs, *ends, elements, cable, fixedConstraintsNode0=fixed_start, fixedConstraintsNode1=fixed_end
    )[0]


def hold(mbs, node, along):
    """Fixes the direction of the tangent at a node: its slope `r′` stays free along the link."""
    tangent = mbs.AddMarker(MarkerNodeCoordinates(nodeNumber=node))
    ground = mbs.AddNode(NodePointGround())
    mbs.AddObject(
        ObjectConnectorCoordinateVector(
            markerNumbers=[mbs.AddMarker(MarkerNodeCoordinates(nodeNumber=ground)), tangent],
            scalingMarker0=np.zeros((1, 0)),
            scalingMarker1=np.array([[0, 0, -along[1], along[0]]]),
        )
    )


def crank_alone(angle_deg, elements):
    """A cantilever: the crank with its tangent held and its other end free."""
    mbs, along = exu.SystemContainer().AddSystem(), directions(angle_deg)[0]
    crank = link(mbs, [0, 0], LENGTHS_M[0] * along, elements, [1, 1, 0, 0], [0, 0, 0, 0])
    hold(mbs, crank[0], along)
    return mbs


def crank_slider(chain):
    """The mechanism: a revolute joint connects crank and rod, and the slider's mass moves on y = 0."""
    mbs, (along_crank, along_rod) = exu.SystemContainer().AddSystem(), directions(chain.angle_deg)
    pin_m = LENGTHS_M[0] * along_crank
    slider_m = [pin_m[0] + LENGTHS_M[1] * along_rod[0], 0]
    crank = link(mbs, [0, 0], pin_m, chain.elements, [1, 1, 0, 0], [0, 0, 0, 0], chain.crank_stiffening)
    rod = link(mbs, pin_m, slider_m, chain.elements, [0, 0, 0, 0], [0, 1, 0, 0])
    mbs.AddObject(MassPoint2D(physicsMass=chain.slider_kg, nodeNumber=rod[-1]))
    pins = [mbs.AddMarker(MarkerNodePosition(nodeNumber=node)) for node in (crank[-1], rod[0])]
    mbs.AddObject(RevoluteJoint2D(markerNumbers=pins))
    if chain.variant == "held":
        hold(mbs, crank[0], along_crank)
    return mbs


def frequencies_hz(mbs):
    """Every natural frequency, from the lowest on; those of rigid motion are near zero."""
    mbs.Assemble()
    return mbs.ComputeODE2Eigenvalues(convert2Frequencies=True)[0]


def modes_hz(chain):
    """The first frequencies of the mechanism, without the free crank's zero."""
    found = frequencies_hz(crank_slider(chain))
    zeros = 1 if chain.variant == "free" else 0
    coordinates, constraints = 8 * (chain.elements + 1), 6 - zeros
    assert len(found) == coordinates - constraints, "each constraint removes one coordinate"
    assert np.sum(found < ZERO_HZ) == zeros, found[:3]
    return found[zeros : zeros + MODES]


def shapes(frequency_hz, length_m, at_m):
    """Harmonic motions of a link at a place, one a column: `u, u′, w, w′, w″, w‴` by row.

    `EA u″ = −ρA ω² u` has two along the link, `EJ w⁗ = ρA ω² w` has four across it.
    """
    omega = 2 * np.pi * frequency_hz
    k, b = omega * np.sqrt(LINE_DENSITY / AXIAL), (LINE_DENSITY * omega**2 / BENDING) ** 0.25
    rows = np.zeros((6, 6))
    for order in range(2):
        turn = order * np.pi / 2
        rows[order, :2] = k**order * np.array([np.cos(k * at_m + turn), np.sin(k * at_m + turn)])
    for order in range(4):
        turn = order * np.pi / 2
        waves = [np.cos(b * at_m + turn), np.sin(b * at_m + turn)]
        decays = [(-1) ** order * np.exp(-b * at_m), np.exp(b * (at_m - length_m))]
        rows[2 + order, 2:] = b**order * np.array(waves + decays)
    return rows


def exact_conditions(frequency_hz, chain):
    """The matrix of the conditions at the mechanism's ends and joint; it is singular at natural frequencies.

    Force on a section: `EA u′` along the link, `−EJ w‴` across it. Moment: `EJ w″`.
    """
    (crank_0, crank_1), (rod_0, rod_1) = (
        [shapes(frequency_hz, length_m, at_m) for at_m in (0, length_m)] for length_m in LENGTHS_M
    )
    turns = [np.array([along, [-along[1], along[0]]]).T for along in directions(chain.angle_deg)]
    moves = lambda turn, ends: turn @ ends[[0, 2]]
    force = lambda turn, ends: turn @ np.array([AXIAL * ends[1], -BENDING * ends[5]])
    none = np.zeros(6)
    slider = moves(turns[1], rod_1)
    inertia_n = chain.slider_kg * (2 * np.pi * frequency_hz) ** 2 * slider[0]
    conditions = [
        *(np.append(row, none) for row in crank_0[[0, 2, 4 if chain.variant == "free" else 3]]),
        *np.hstack([moves(turns[0], crank_1), -moves(turns[1], rod_0)]),
        *np.hstack([force(turns[0], crank_1), -force(turns[1], rod_0)]),
        np.append(crank_1[4], none),
        *(np.append(none, row) for row in (rod_0[4], rod_1[4], slider[1], force(turns[1], rod_1)[0] - inertia_n)),
    ]
    return np.array([row / np.linalg.norm(row) for row in conditions])


def exact_hz(near_hz, chain):
    """The exact frequency near another: the determinant of the conditions changes its sign there."""
    determinant = lambda frequency_hz: np.linalg.det(exact_conditions(frequency_hz, chain))
    return brentq(determinant, near_hz * (1 - 2e-3), near_hz * (1 + 1e-3), xtol=1e-12, rtol=1e-14)


def cases(elements=ELEMENTS):
    return [Chain(angle_deg, variant, elements) for angle_deg in ANGLES_DEG for variant in VARIANTS]


def off(found, exact):
    """The largest relative error of each mode."""
    return np.max(np.abs(np.atleast_2d(found) / exact - 1), axis=0)


def check(name, errors, bound):
    """Prints the largest relative errors by mode, and whether they stay within the bound."""
    good = bool(np.max(errors) <= bound)
    print(f"{name}: {' '.join(f'{error:.1e}' for error in errors)}; allowed {bound:g}{'' if good else ': FAILED'}")
    return good


def exact_rows(near):
    """The exact frequencies near those of each case."""
    exact = np.array([[exact_hz(near_hz, chain) for near_hz in row] for chain, row in zip(cases(), near)])
    assert np.all(np.diff(exact) > 1e-4 * exact[:, 1:]), "each frequency has its own exact one"
    return exact


def check_mirrored(name, rows):
    """The mechanism at −θ is the mirror image of that at θ: they differ by rounding."""
    by_angle = np.reshape(rows, (len(ANGLES_DEG), len(VARIANTS), MODES))
    return check(f"{name}, θ against −θ", off(by_angle[1:], by_angle[:0:-1]).max(axis=0), ROUNDING_BOUND)


def check_cantilever():
    """`cos x cosh x = −1`, `f = x² √(EJ / ρA) / (2π L²)`."""
    roots = [brentq(lambda x: np.cos(x) + 1 / np.cosh(x), (n + 0.1) * np.pi, (n + 0.9) * np.pi) for n in range(3)]
    exact = np.square(roots) * np.sqrt(BENDING / LINE_DENSITY) / (2 * np.pi * LENGTHS_M[0] ** 2)
    return check("crank alone, clamped, at 30°", off(frequencies_hz(crank_alone(30, ELEMENTS))[:3], exact), CANTILEVER_BOUND)


def check_pinned():
    """`f = (nπ)² √(EJ / ρA) / (2π L²)`; at 90° the heavy slider holds the rod's end."""
    exact = np.square(np.arange(1, 4) * np.pi) * np.sqrt(BENDING / LINE_DENSITY) / (2 * np.pi * LENGTHS_M[1] ** 2)
    found = [across_rod_hz(Chain(angle_deg, "held", slider_kg=1e6, crank_stiffening=1e5)) for angle_deg in (0, 90)]
    return check("rod between a stiff crank and a heavy slider", off(found, exact), PINNED_BOUND)


def across_rod_hz(chain):
    """The lowest three frequencies but the slider's own on the stretching links, which is below 1 Hz."""
    found = frequencies_hz(crank_slider(chain))
    return found[found > 1][:3]


def write(file, rows):
    lines = ["angle_deg,variant," + ",".join(f"f{n}_hz" for n in range(1, MODES + 1))]
    for chain, row in zip(cases(), rows):
        lines.append(f"{chain.angle_deg},{chain.variant}," + ",".join(f"{hz:.12g}" for hz in row))
    file.write_text("\n".join(lines) + "\n")


def main(folder):
    found = {mesh: np.array([modes_hz(chain) for chain in cases(mesh)]) for mesh in MESHES}
    exact = exact_rows(found[ELEMENTS])
    good = [check(f"{mesh} elements a link against exact", off(found[mesh], exact), MESH_BOUNDS[mesh]) for mesh in MESHES]
    good += [check_mirrored(f"{ELEMENTS} elements a link", found[ELEMENTS]), check_mirrored("exact", exact)]
    good += [check_cantilever(), check_pinned()]
    if not all(good):
        sys.exit(1)
    write(folder / "exudyn-modes.csv", found[ELEMENTS])
    write(folder / "exact-modes.csv", exact)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if sys.argv[1:] else FOLDER)
