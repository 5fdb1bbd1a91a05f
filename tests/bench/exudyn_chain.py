"""Scenes ref-r2 and ref-r2s in Exudyn: cubic ANCF cables, generalised-alpha."""

import math
import sys
import time
import warnings
from typing import NamedTuple

sys.exudynFast = True  # the build without range checks
import exudyn as exu
import numpy as np
from exudyn.beams import GenerateStraightLineANCFCable2D
from exudyn.itemInterface import MarkerNodePosition, MarkerNodeRigid, ObjectANCFCable2D, RevoluteJoint2D, SensorNode, Torque
from exudyn.utilities import CreateSymbolicUserFunction

warnings.simplefilter("ignore", DeprecationWarning)

PULSE_S, TORQUE_NM, UNTIL_S, INTERVAL_S = 0.1, 20.0, 2.0, 0.01
E_PA, AREA_M2, SECOND_MOMENT_M4, DENSITY = 2.1e11, 1e-4, 8.333e-10, 7700.0


class Settings(NamedTuple):
    """What a user would tune."""

    spectral_radius: float = 0.8
    relative_tolerance: float = 1e-8
    reduced_integration: int = 0
    solver: str = "EigenSparse"


def chain(elements, reduced_integration):
    """The mechanism of so many elements for crank and rod, its load (torque at the pivot's tangent), and a sensor of the crank pin's position."""
    mbs = exu.SystemContainer().AddSystem()
    cable = ObjectANCFCable2D(
        physicsMassPerLength=DENSITY * AREA_M2,
        physicsBendingStiffness=E_PA * SECOND_MOMENT_M4,
        physicsAxialStiffness=E_PA * AREA_M2,
        useReducedOrderIntegration=reduced_integration,
    )

    def link(start_m, end_m, fixed_start, fixed_end, elements):
        ends = [[start_m, 0, 0], [end_m, 0, 0]]
        return GenerateStraightLineANCFCable2D(
            mbs, *ends, elements, cable, fixedConstraintsNode0=fixed_start, fixedConstraintsNode1=fixed_end
        )[0]

    free = [0, 0, 0, 0]
    crank = link(0.0, 0.5, [1, 1, 0, 0], free, elements[0])
    rod = link(0.5, 2.0, free, [0, 1, 0, 0], elements[1])
    pins = [mbs.AddMarker(MarkerNodePosition(nodeNumber=node)) for node in (crank[-1], rod[0])]
    mbs.AddObject(RevoluteJoint2D(markerNumbers=pins))
    load = mbs.AddLoad(Torque(markerNumber=mbs.AddMarker(MarkerNodeRigid(nodeNumber=crank[0])), loadVector=[0, 0, 0]))
    position = exu.OutputVariableType.Position
    sensor = SensorNode(nodeNumber=crank[-1], outputVariableType=position, storeInternal=True, writeToFile=False)
    return mbs, load, mbs.AddSensor(sensor)


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
    """Seconds that the solver's steps take, and the crank's chord angle every 0.01 s; or None when Newton fails.

    Two legs, during the pulse and after it: neither sees the pulse's edge within a step. Only the steps are timed.
    """
    mbs, load, sensor = chain(elements, chosen.reduced_integration)
    mbs.Assemble()
    seconds, seen = 0.0, {0: 0.0}
    for from_s, to_s in ((0.0, PULSE_S), (PULSE_S, UNTIL_S)):
        function = pulse(mbs, load, scene, from_s)
        settings = simulation_settings(step_s, from_s, to_s, chosen)
        solver = exu.MainSolverImplicitSecondOrder()
        if not solver.InitializeSolver(mbs, settings):
            return None
        begin = time.thread_time()
        solved = solver.SolveSteps(mbs, settings)
        seconds += time.thread_time() - begin
        solver.FinalizeSolver(mbs, settings)
        del function
        if not solved:
            return None
        rows = np.array(mbs.GetSensorStoredData(sensor))
        seen |= {round(t / INTERVAL_S): math.atan2(y, x) for t, x, y, _ in rows if abs(t / INTERVAL_S % 1 - 0.5) > 0.499}
        go_on(mbs.systemData)
    return seconds, np.unwrap([seen[k] for k in range(round(UNTIL_S / INTERVAL_S) + 1)])


def pulse(mbs, load, scene, from_s):
    """Sets the torque of a leg. What it returns must live as long as the leg: an expression that Exudyn evaluates by itself."""
    acts = from_s < PULSE_S
    mbs.SetLoadParameter(load, "loadVectorUserFunction", 0)
    mbs.SetLoadParameter(load, "loadVector", [0, 0, TORQUE_NM if acts else 0.0])
    if not acts or scene == "ref-r2":
        return None
    torque = lambda mbs, t, vector: [0, 0, TORQUE_NM * (1 - exu.symbolic.cos(2 * math.pi * t / PULSE_S))]
    function = CreateSymbolicUserFunction(mbs, torque, "loadVectorUserFunction", load)
    mbs.SetLoadParameter(load, "loadVectorUserFunction", function)
    return function


def go_on(data):
    """Makes the present state the next leg's beginning."""
    initial = exu.ConfigurationType.Initial
    data.SetODE2Coordinates(data.GetODE2Coordinates(), initial)
    data.SetODE2Coordinates_t(data.GetODE2Coordinates_t(), initial)
    data.SetODE2Coordinates_tt(data.GetODE2Coordinates_tt(), initial)
    data.SetAECoordinates(data.GetAECoordinates(), initial)
