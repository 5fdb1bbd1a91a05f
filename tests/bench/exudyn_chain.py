"""Crank-sliders of two flexible links in Exudyn: cubic ANCF cables, generalized-alpha."""

import math
import sys
import time
import warnings
from typing import NamedTuple

sys.exudynFast = True  # the build without range checks
import exudyn as exu
import numpy as np
from exudyn.beams import GenerateStraightLineANCFCable2D
from exudyn.itemInterface import (
    MarkerNodePosition,
    MarkerNodeRigid,
    MassPoint2D,
    ObjectANCFCable2D,
    RevoluteJoint2D,
    SensorNode,
    Torque,
)
from exudyn.utilities import CreateSymbolicUserFunction

warnings.simplefilter("ignore", DeprecationWarning)

PULSE_S, TORQUE_NM, UNTIL_S, INTERVAL_S = 0.1, 20.0, 2.0, 0.01
LENGTHS_M = (0.5, 1.5)
E_PA, AREA_M2, DENSITY = 2.1e11, 1e-4, 7700.0


class Mechanism(NamedTuple):
    """What the scenes differ in."""

    second_moment_m4: float = 8.333e-10
    damping_s: float = 0.0
    slider_kg: float = 0.0
    raised_cosine: bool = True


SCENES = {
    "ref-r2": Mechanism(raised_cosine=False),
    "ref-r2s": Mechanism(),
    "crank-slider": Mechanism(second_moment_m4=1e-8 / 12, damping_s=1e-4, slider_kg=0.2),
}


class Load(NamedTuple):
    """A load of Exudyn that is `factor` times the torque: a moment about z, or the force on a coordinate."""

    number: int
    factor: float = 1.0
    is_moment: bool = True


class Settings(NamedTuple):
    """What a user would tune."""

    spectral_radius: float = 0.8
    relative_tolerance: float = 1e-8
    reduced_integration: int = 0
    solver: str = "EigenSparse"


def chain(bars, elements, reduced_integration):
    """The mechanism of so many elements for crank and rod, its loads (the torque on the tangent at the pivot), and each link's nodes.

    Damping is Kelvin and Voigt's: `N = EA (ε + c ε̇)`, `M = EJ (κ + c κ̇)`.
    """
    mbs = exu.SystemContainer().AddSystem()
    bending, axial = E_PA * bars.second_moment_m4, E_PA * AREA_M2
    cable = ObjectANCFCable2D(
        physicsMassPerLength=DENSITY * AREA_M2,
        physicsBendingStiffness=bending,
        physicsAxialStiffness=axial,
        physicsBendingDamping=bars.damping_s * bending,
        physicsAxialDamping=bars.damping_s * axial,
        useReducedOrderIntegration=reduced_integration,
    )

    def link(start_m, end_m, fixed_start, fixed_end, elements):
        ends = [[start_m, 0, 0], [end_m, 0, 0]]
        return GenerateStraightLineANCFCable2D(
            mbs, *ends, elements, cable, fixedConstraintsNode0=fixed_start, fixedConstraintsNode1=fixed_end
        )[0]

    free, end_m = [0, 0, 0, 0], sum(LENGTHS_M)
    crank = link(0.0, LENGTHS_M[0], [1, 1, 0, 0], free, elements[0])
    rod = link(LENGTHS_M[0], end_m, free, [0, 1, 0, 0], elements[1])
    if bars.slider_kg:
        mbs.AddObject(MassPoint2D(physicsMass=bars.slider_kg, nodeNumber=rod[-1]))
    pins = [mbs.AddMarker(MarkerNodePosition(nodeNumber=node)) for node in (crank[-1], rod[0])]
    mbs.AddObject(RevoluteJoint2D(markerNumbers=pins))
    return mbs, [moment(mbs, crank[0])], crank, rod


def moment(mbs, node):
    """The torque, on a node that turns."""
    return Load(mbs.AddLoad(Torque(markerNumber=mbs.AddMarker(MarkerNodeRigid(nodeNumber=node)), loadVector=[0, 0, 0])))


def simulation_settings(step_s, from_s, to_s, chosen):
    settings = exu.SimulationSettings()
    integration = settings.timeIntegration
    integration.startTime, integration.endTime = from_s, to_s
    integration.numberOfSteps = round((to_s - from_s) / step_s)
    integration.adaptiveStep = False
    integration.generalizedAlpha.spectralRadius = chosen.spectral_radius
    integration.newton.useModifiedNewton = True
    integration.newton.relativeTolerance = chosen.relative_tolerance
    integration.newton.absoluteTolerance = 1e-5  # the pulse begins with no force at all
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = INTERVAL_S
    settings.linearSolver.solverType = getattr(exu.LinearSolverType, chosen.solver)
    settings.linearSolver.reuseAnalyzedPattern = True
    settings.parallel.numberOfThreads = 1
    return settings


def solve(scene, elements, step_s, chosen):
    """Seconds that the solver's steps take, and the crank's chord angle every 0.01 s; or None when Newton fails."""
    bars = SCENES[scene]
    mbs, loads, crank, _ = chain(bars, elements, chosen.reduced_integration)
    pin = watch(mbs, crank[-1], exu.OutputVariableType.Position)
    mbs.Assemble()
    solved = run(mbs, bars, loads, [pin], step_s, chosen)
    return solved and (solved[0], np.unwrap([math.atan2(y, x) for x, y, _ in solved[1][0]]))


def watch(mbs, node, what):
    """A sensor that stores an output of a node every 0.01 s."""
    return mbs.AddSensor(SensorNode(nodeNumber=node, outputVariableType=what, storeInternal=True, writeToFile=False))


def run(mbs, bars, loads, sensors, step_s, chosen):
    """Seconds that the solver's steps take, and each sensor's rows every 0.01 s; or None when Newton fails.

    Two legs, during the pulse and after it: neither sees the pulse's edge within a step. Only the steps are timed.
    """
    seconds, seen = 0.0, [{} for _ in sensors]
    for from_s, to_s in ((0.0, PULSE_S), (PULSE_S, UNTIL_S)):
        functions = pulse(mbs, loads, bars, from_s)
        settings = simulation_settings(step_s, from_s, to_s, chosen)
        solver = exu.MainSolverImplicitSecondOrder()
        if not solver.InitializeSolver(mbs, settings):
            return None
        begin = time.thread_time()
        solved = solver.SolveSteps(mbs, settings)
        seconds += time.thread_time() - begin
        solver.FinalizeSolver(mbs, settings)
        del functions
        if not solved:
            return None
        for rows, sensor in zip(seen, sensors):
            stored = mbs.GetSensorStoredData(sensor)
            rows |= {round(t / INTERVAL_S): row for t, *row in stored if abs(t / INTERVAL_S % 1 - 0.5) > 0.499}
        go_on(mbs.systemData)
    return seconds, [np.array([rows[k] for k in range(round(UNTIL_S / INTERVAL_S) + 1)]) for rows in seen]


def pulse(mbs, loads, bars, from_s):
    """Sets the torque of a leg. What it returns must live as long as the leg: expressions that Exudyn evaluates by itself."""
    acts, functions = from_s < PULSE_S, []
    for load in loads:
        name, torque_nm = "loadVector" if load.is_moment else "load", load.factor * TORQUE_NM if acts else 0.0
        mbs.SetLoadParameter(load.number, name + "UserFunction", 0)
        mbs.SetLoadParameter(load.number, name, [0, 0, torque_nm] if load.is_moment else torque_nm)
        if acts and bars.raised_cosine:
            functions.append(CreateSymbolicUserFunction(mbs, raised_cosine(load), name + "UserFunction", load.number))
            mbs.SetLoadParameter(load.number, name + "UserFunction", functions[-1])
    return functions


def raised_cosine(load):
    """The load over time, in Exudyn's form."""
    size = lambda t: load.factor * TORQUE_NM * (1 - exu.symbolic.cos(2 * math.pi * t / PULSE_S))
    return (lambda mbs, t, vector: [0, 0, size(t)]) if load.is_moment else (lambda mbs, t, number: size(t))


def go_on(data):
    """Makes the present state the next leg's beginning."""
    initial = exu.ConfigurationType.Initial
    data.SetODE2Coordinates(data.GetODE2Coordinates(), initial)
    data.SetODE2Coordinates_t(data.GetODE2Coordinates_t(), initial)
    data.SetODE2Coordinates_tt(data.GetODE2Coordinates_tt(), initial)
    data.SetAECoordinates(data.GetAECoordinates(), initial)
