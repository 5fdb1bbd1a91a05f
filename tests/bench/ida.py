"""SUNDIALS IDA and flexcrank on the equations of flexcrank's own models, both called as compiled code (`tests/bench/ida`)."""

import ctypes
import importlib.util
import os
import time
from ctypes import byref, c_char_p, c_double, c_int, c_long, c_size_t, c_void_p
from pathlib import Path

import numpy as np

INTERVAL_S, INSTANTS = 0.01, 200
NORMAL, PRECONDITION_LEFT = 1, 1
# Between two instants; more are given up.
MOST_STEPS = 5000
COUNTS = ("Steps", "ResEvals", "NonlinSolvIters", "LinSolvSetups")


def declare(library, name, result, *arguments):
    function = getattr(library, name)
    function.restype, function.argtypes = result, arguments
    return function


class Equations:
    """The library of `tests/bench/ida`."""

    def __init__(self, path):
        self.library = library = ctypes.CDLL(str(path))
        self.open = declare(library, "equations_open", c_void_p, c_char_p, c_void_p, c_void_p)
        self.count = declare(library, "equations_count", c_size_t, c_void_p)
        self.start = declare(library, "equations_start", c_int, c_void_p, c_void_p, c_void_p)
        self.angle = declare(library, "equations_angle", c_double, c_void_p, c_double, c_void_p, c_void_p)
        self.jacobians_s = declare(library, "equations_jacobians_s", c_double, c_void_p)
        self.close = declare(library, "equations_close", None, c_void_p)
        self.simulation = declare(library, "simulation_open", c_void_p, c_char_p)
        self.run = declare(library, "simulation_run", c_int, c_void_p, c_size_t, c_void_p, c_size_t)
        self.end = declare(library, "simulation_close", None, c_void_p)
        self.callback = lambda name: ctypes.cast(getattr(library, name), c_void_p)

    def solve(self, words, step_s):
        """flexcrank: seconds of this thread and angles; None if a step fails."""
        simulation = self.simulation(f"{words} solver.step_s={step_s!r}".encode())
        if not simulation:
            return None
        angles = np.zeros(INSTANTS)
        begun = time.thread_time()
        failed = self.run(simulation, round(INTERVAL_S / step_s), angles.ctypes.data, INSTANTS)
        seconds = time.thread_time() - begun
        self.end(simulation)
        return None if failed else (seconds, angles)


class Ida:
    """IDA by its C functions, as scikit-sundae brings it."""

    def __init__(self, equations):
        self.equations = equations
        folder = Path(importlib.util.find_spec("sksundae").origin).parent.parent / "scikit_sundae.libs"
        self.libraries = [
            ctypes.CDLL(str(next(folder.glob(f"libsundials_{part}-*"))), ctypes.RTLD_GLOBAL)
            for part in ("core", "nvecserial", "sunmatrixdense", "sunlinsoldense", "sunlinsolspgmr", "ida")
        ]
        # That an iteration converges badly shows in the time that it takes.
        os.environ["SUNLOGGER_WARNING_FILENAME"] = os.devnull
        self.context = c_void_p()
        self.call("SUNContext_Create", c_int(0), byref(self.context))
        self.call("SUNContext_ClearErrHandlers", self.context)
        address = lambda name: ctypes.cast(self.function(name), c_void_p)
        self.data = [address("N_VGetArrayPointer"), address("SUNDenseMatrix_Data")]

    def function(self, name):
        return next(getattr(library, name) for library in self.libraries if hasattr(library, name))

    def call(self, name, *arguments):
        """Calls a function that returns 0 if it succeeds."""
        function = self.function(name)
        function.restype = c_int
        if code := function(*arguments):
            raise RuntimeError(f"{name} returns {code}")

    def make(self, name, *arguments):
        function = self.function(name)
        function.restype = c_void_p
        return c_void_p(function(*arguments, self.context))

    def vector(self, numbers):
        made = self.make("N_VNew_Serial", c_long(len(numbers)))
        data = self.function("N_VGetArrayPointer")
        data.restype = ctypes.POINTER(c_double)
        view = np.ctypeslib.as_array(data(made), (len(numbers),))
        view[:] = numbers
        return made, view

    def solve(self, words, relative, absolute, velocities, order, dense, longest_s=10.0):
        """Seconds of this thread, angles, and IDA's counts; None if IDA fails.

        `absolute` is the absolute tolerance of coordinates, and `velocities` times that is the one of velocities. The linear
        solver is dense, with a Jacobian whose computation is not timed, or GMRES with flexcrank's own factors as preconditioner.
        """
        equations = self.equations
        system = equations.open(words.encode(), *self.data)
        n = equations.count(system)
        (y, ys), (yp, yps) = self.vector(np.zeros(2 * n)), self.vector(np.zeros(2 * n))
        bounds, _ = self.vector(np.repeat([absolute, absolute * velocities], n))
        equations.start(system, ys.ctypes.data, yps.ctypes.data)
        memory = self.make("IDACreate")
        self.call("IDAInit", memory, equations.callback("ida_residual"), c_double(0.0), y, yp)
        self.call("IDASVtolerances", memory, c_double(relative), bounds)
        self.call("IDASetUserData", memory, c_void_p(system))
        self.call("IDASetMaxOrd", memory, c_int(order))
        self.call("IDASetMaxNumSteps", memory, c_long(MOST_STEPS))
        if dense:
            matrix = self.make("SUNDenseMatrix", c_long(2 * n), c_long(2 * n))
            self.call("IDASetLinearSolver", memory, self.make("SUNLinSol_Dense", y, matrix), matrix)
            self.call("IDASetJacFn", memory, equations.callback("ida_jacobian"))
        else:
            self.call("IDASetLinearSolver", memory, self.make("SUNLinSol_SPGMR", y, c_int(PRECONDITION_LEFT), c_int(5)), None)
            self.call("IDASetPreconditioner", memory, equations.callback("ida_set_up"), equations.callback("ida_precondition"))
        angles, reached, seconds = np.zeros(INSTANTS), c_double(), 0.0
        try:
            for k in range(INSTANTS):
                begun = time.thread_time()
                self.call("IDASolve", memory, c_double((k + 1) * INTERVAL_S), byref(reached), y, yp, c_int(NORMAL))
                seconds += time.thread_time() - begun
                angles[k] = equations.angle(system, reached, ys.ctypes.data, yps.ctypes.data)
                if seconds > longest_s:
                    return None
        except RuntimeError:
            return None
        # What a run has allocated is left to the end of the program.
        counts = {name: self.counted(memory, f"IDAGetNum{name}") for name in COUNTS}
        return seconds - equations.jacobians_s(system), angles, counts

    def counted(self, memory, name):
        count = c_long()
        self.call(name, memory, byref(count))
        return count.value
