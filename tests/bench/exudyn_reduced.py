"""The same mechanisms with Exudyn's reduced-order flexible bodies: each a floating frame with modes.

Frames lie on the chord, with the sines of a pinned beam and, where a moment acts at an end, what they lack of its static shape.
Exudyn's body is spatial. Its mesh is given by hand: nodes on the axis, and at both ends four without mass that turn with the
section. Modes bend in the plane, joints hold x, y and the rotation about z; by symmetry nothing leaves the plane, so that nothing
else need be held. The torque works on the tangent at the pivot: on the frame, and on each mode by its slope there.

Strains and shapes of such a body are linear: a link that bends does not shorten. So its error has a floor, whatever the modes and
the step: with one body a link 0.06 rad on ref-r2s and 0.1 on ref-r2, with two 0.010 to 0.013 and 0.03. Two bodies a link take four
times as long as four ANCF cables a link, which err by 0.003 rad on ref-r2s (all at steps of 1 ms).
"""

import math

import numpy as np
from exudyn.FEM import FEMinterface, ObjectFFRFreducedOrderInterface
from exudyn.itemInterface import (
    GenericJoint,
    LoadCoordinate,
    MarkerBodyPosition,
    MarkerNodeCoordinate,
    MarkerNodePosition,
    MarkerSuperElementPosition,
    MarkerSuperElementRigid,
    ObjectGround,
    SensorMarker,
    SphericalJoint,
)
from scipy.sparse import csr_matrix, diags

from exudyn_chain import AREA_M2, DENSITY, E_PA, LENGTHS_M, SCENES, Load, exu, moment, run

AXIS = 101  # nodes on the axis: Simpson's points
SECTION = ((1, 0), (-1, 0), (0, 1), (0, -1))
HALF_WIDTH_M = 0.005


def solve(scene, modes, bodies, step_s, chosen):
    """As `exudyn_chain.solve`, for so many sines a body and bodies a link, of crank and rod."""
    bars = SCENES[scene]
    mbs, loads, pin = chain(bars, modes, bodies)
    position = exu.OutputVariableType.Position
    sensor = mbs.AddSensor(SensorMarker(markerNumber=pin, outputVariableType=position, storeInternal=True, writeToFile=False))
    mbs.Assemble()
    solved = run(mbs, bars, loads, [sensor], step_s, chosen)
    return solved and (solved[0], np.unwrap([math.atan2(y, x) for x, y, _ in solved[1][0]]))


def chain(bars, modes, bodies):
    """The mechanism, its loads, and a marker of the crank pin."""
    mbs = exu.SystemContainer().AddSystem()
    links, at_m = [], 0.0
    for link in (0, 1):
        length_m, last, own = LENGTHS_M[link] / bodies[link], bodies[link] - 1, []
        for i in range(bodies[link]):
            own.append(Body(mbs, bars, length_m, modes[link], at_m, (i > 0 or link == 0, i < last)))
            at_m += length_m
        for one, next_one in zip(own, own[1:]):
            ends = [one.section(mbs, 1), next_one.section(mbs, 0)]
            mbs.AddObject(GenericJoint(markerNumbers=ends, constrainedAxes=[1, 1, 0, 0, 0, 1]))
        links.append(own)
    crank, rod = links
    ground = mbs.AddMarker(MarkerBodyPosition(bodyNumber=mbs.AddObject(ObjectGround())))
    pin = crank[-1].end(mbs)
    for ends, axes in (
        ([ground, crank[0].start(mbs)], [1, 1, 0]),
        ([pin, rod[0].start(mbs)], [1, 1, 0]),
        ([ground, rod[-1].end(mbs)], [0, 1, 0]),
    ):
        mbs.AddObject(SphericalJoint(markerNumbers=ends, constrainedAxes=axes))
    return mbs, crank[0].torque(mbs), pin


def functions(modes, moments):
    """Points on the unit axis; deflections there, their slopes and their second derivatives."""
    xi = np.linspace(0, 1, AXIS)
    k = math.pi * np.arange(1, modes + 1)[:, None]
    sets = [(np.sin(k * xi), k * np.cos(k * xi), -k * k * np.sin(k * xi))]
    if moments[0]:  # unit slope at the start, no moment at the end
        sets.append(((xi - 1.5 * xi**2 + 0.5 * xi**3)[None], (1 - 3 * xi + 1.5 * xi**2)[None], (3 * xi - 3)[None]))
    if moments[1]:
        sets.append(((0.5 * xi**3 - 0.5 * xi)[None], (1.5 * xi**2 - 0.5)[None], 3 * xi[None]))
    return xi, *map(np.concatenate, zip(*sets))


class Body:
    """A link or a part of one."""

    def __init__(self, mbs, bars, length_m, modes, at_m, moments):
        xi, phi, slope, curvature = functions(modes, moments)
        self.slope, curvature = slope / length_m, curvature / length_m**2
        weights = np.ones(AXIS)
        weights[1:-1:2], weights[2:-1:2] = 4, 2
        weights *= length_m / (AXIS - 1) / 3
        places = [(x * length_m, 0, 0) for x in xi]
        moves = [(0 * deflection, deflection, 0 * deflection) for deflection in phi.T]
        for end in (0, -1):
            for y, z in SECTION:
                places.append((xi[end] * length_m, y * HALF_WIDTH_M, z * HALF_WIDTH_M))
                moves.append((-y * HALF_WIDTH_M * self.slope[:, end], phi[:, end], 0 * phi[:, end]))
        self.made = self.reduced(places, moves, weights, E_PA * bars.second_moment_m4 * (curvature * weights) @ curvature.T)(
            mbs, positionRef=[at_m, 0, 0], stiffnessProportionalDamping=bars.damping_s
        )

    @staticmethod
    def reduced(places, moves, weights, stiffness):
        mesh = FEMinterface()
        mesh.nodes = {"Position": np.array(places)}
        mass = np.concatenate([DENSITY * AREA_M2 * weights, np.zeros(len(places) - AXIS)])
        mesh.massMatrix = csr_matrix(diags(np.repeat(mass, 3)))
        mesh.stiffnessMatrix = csr_matrix((3 * len(places),) * 2)
        mesh.modeBasis = {"matrix": np.concatenate(moves), "type": "NormalModes"}
        interface = ObjectFFRFreducedOrderInterface(mesh, rigidBodyNodeType="NodeType.RotationRxyz")
        interface.stiffnessMatrixReduced = stiffness
        # About its axis nothing turns the body; without inertia there its mass matrix were singular.
        interface.inertiaLocal[0, 0] += 1e-4 * interface.inertiaLocal[1, 1]
        return interface.AddObjectFFRFreducedOrder

    def start(self, mbs):
        return mbs.AddMarker(MarkerNodePosition(nodeNumber=self.made["nRigidBody"]))

    def end(self, mbs):
        return self.marker(mbs, MarkerSuperElementPosition, [AXIS - 1])

    def section(self, mbs, end):
        return self.marker(mbs, MarkerSuperElementRigid, [AXIS + len(SECTION) * end + i for i in range(len(SECTION))])

    def marker(self, mbs, kind, nodes):
        return mbs.AddMarker(
            kind(bodyNumber=self.made["oFFRFreducedOrder"], meshNodeNumbers=nodes, weightingFactors=[1 / len(nodes)] * len(nodes))
        )

    def torque(self, mbs):
        loads = [moment(mbs, self.made["nRigidBody"])]
        for coordinate, slope in enumerate(self.slope[:, 0]):
            marker = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=self.made["nGenericODE2"], coordinate=coordinate))
            loads.append(Load(mbs.AddLoad(LoadCoordinate(markerNumber=marker, load=0.0)), slope, is_moment=False))
        return loads
