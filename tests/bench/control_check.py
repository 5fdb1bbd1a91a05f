"""Compares the response of a linearised mechanism, loaded by python-control, with the response in a CSV file.

MODEL is the Python output of `flexcrank linearise`: NumPy arrays `A, B, C, D`, lists `states, inputs, outputs`, and the sampling
interval `dt` in s (None for continuous time). RESPONSE has the column `time_s` at equal intervals from 0 on, and one column for each
output, as differences from the start: `crank_angle_rad` and `slider_m`. A torque of 1e-6 N·m acts during the first 0.02 s.

A continuous model is discretised exactly for an input that is constant during each interval (zero-order hold): a chain's poles reach
1e5 rad/s, so that the step of a solver would be far shorter than the interval.

Prints the largest difference of each output relative to its largest response. Exit code 1 if one is above 1e-6, 2 if the files do not
fit each other. `--example` checks the script itself: two bodies joined by a spring, against their closed form.
Usage, in an environment with control==0.10.2: python tests/bench/control_check.py MODEL RESPONSE [--input NAME] [--outputs NAME ...]
"""

import argparse
import runpy
import sys
import tempfile
from pathlib import Path

import control
import numpy as np

TORQUE_NM, PULSE_S = 1e-6, 0.02
BOUND = 1e-6
# Times are equal when they differ by less than this part of an interval.
SAME = 1e-6


class Misfit(Exception):
    """Model and response do not fit each other."""


def load(file):
    """The model of a file. To python-control `dt = 0` is continuous time, and None is undecided."""
    given = runpy.run_path(str(file))
    matrices = [given[name] for name in "ABCD"]
    names = {kind: given[kind] for kind in ("states", "inputs", "outputs")}
    return control.ss(*matrices, given["dt"] or 0, **names)


def read(file):
    """Columns by name."""
    names = Path(file).read_text().split("\n", 1)[0].strip().split(",")
    rows = np.loadtxt(file, delimiter=",", skiprows=1, ndmin=2)
    return dict(zip(names, rows.T))


def whole(ratio, what):
    """A ratio as a number of intervals."""
    if round(ratio) < 1 or abs(ratio - round(ratio)) > SAME:
        raise Misfit(f"{what} is {ratio:g} intervals, not a whole number")
    return round(ratio)


def place(names, name):
    if name not in names:
        raise Misfit(f"the model has no {name!r}, but {', '.join(names)}")
    return names.index(name)


def respond(model, times_s, torque_input):
    """Every output of the model at these times, one a row."""
    interval_s = times_s[-1] / (len(times_s) - 1)
    if np.any(np.abs(times_s - interval_s * np.arange(len(times_s))) > SAME * interval_s):
        raise Misfit("time_s does not begin at 0, or its intervals differ")
    sampled = model if model.isdtime(strict=True) else model.sample(interval_s, "zoh")
    every = whole(interval_s / sampled.dt, "an interval of the response")
    pulse = whole(PULSE_S / sampled.dt, "the pulse")
    inputs = np.zeros((model.ninputs, every * (len(times_s) - 1) + 1))
    inputs[torque_input, :pulse] = TORQUE_NM
    return control.forced_response(sampled, inputs=inputs, squeeze=False).outputs[:, ::every]


def check(model_file, response_file, torque_input=None, outputs=None):
    """Whether the model's response is that of the file."""
    model, response = load(model_file), read(response_file)
    times_s = response.pop("time_s")
    outputs = outputs or list(response)
    if len(outputs) != len(response):
        raise Misfit(f"{len(outputs)} outputs for the columns {', '.join(response)}")
    found = respond(model, times_s, place(model.input_labels, torque_input) if torque_input else 0)
    good = True
    for output, (column, expected) in zip(outputs, response.items()):
        largest = np.max(np.abs(expected))
        if not largest > 0:
            raise Misfit(f"{column} does not respond")
        off = np.max(np.abs(found[place(model.output_labels, output)] - expected)) / largest
        within = bool(off <= BOUND)
        print(f"{column}: largest response {largest:.6g}, difference {off:.1e} of it{'' if within else ': FAILED'}")
        good &= within
    return good


def example(folder, natural_rad_s, error=0.0):
    """A model and a response: inertia `J` under the torque, mass `m`, a spring between; `ω² = k (1/J + 1/m)`.

    A step of torque `T` moves the centre by `T t² / (2 (J + m))` and stretches the spring by `T (1 − cos ωt) / (J ω²)`.
    """
    j, m = 0.03, 0.2
    k = natural_rad_s**2 / (1 / j + 1 / m)
    a = [[0, 0, 1, 0], [0, 0, 0, 1], [-k / j, k / j, 0, 0], [k / m, -k / m, 0, 0]]
    model, response = Path(folder) / "model.py", Path(folder) / "response.csv"
    model.write_text(
        f"import numpy as np\nA = np.array({a})\nB = np.array([[0], [0], [{1 / j}], [0]])\n"
        "C = np.eye(2, 4)\nD = np.zeros((2, 1))\nstates = ['q1', 'q2', 'v1', 'v2']\n"
        "inputs = ['torque_nm']\noutputs = ['crank_angle_rad', 'slider_m']\ndt = None\n"
    )
    times_s = np.arange(501) * 1e-3

    def step(since_s):
        since_s = np.maximum(since_s, 0)
        centre = since_s**2 / (2 * (j + m))
        stretch = 2 * np.sin(natural_rad_s * since_s / 2) ** 2 / (j * natural_rad_s**2)
        return np.array([centre + m / (j + m) * stretch, centre - j / (j + m) * stretch])

    moved = TORQUE_NM * (step(times_s) - step(times_s - PULSE_S)) * (1 + error)
    rows = np.vstack([times_s, moved]).T
    np.savetxt(response, rows, fmt="%.17g", delimiter=",", header="time_s,crank_angle_rad,slider_m", comments="")
    return model, response


def check_examples():
    """Soft and stiff springs pass; a response that is off by twice the bound does not."""
    with tempfile.TemporaryDirectory() as folder:
        passed = all([check(*example(folder, natural_rad_s)) for natural_rad_s in (60, 1e3, 1e5)])
        return passed and not check(*example(folder, 60, error=2 * BOUND))


def main():
    arguments = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    arguments.add_argument("model", nargs="?")
    arguments.add_argument("response", nargs="?")
    arguments.add_argument("--input", help="the torque's name in the model (default: its first input)")
    arguments.add_argument("--outputs", nargs="+", help="the columns' names in the model (default: the same)")
    arguments.add_argument("--example", action="store_true", help="check this script on a closed form")
    chosen = arguments.parse_args()
    if not chosen.example and not chosen.response:
        arguments.error("MODEL and RESPONSE are needed")
    try:
        good = check_examples() if chosen.example else check(chosen.model, chosen.response, chosen.input, chosen.outputs)
    except Misfit as misfit:
        print(misfit, file=sys.stderr)
        sys.exit(2)
    sys.exit(0 if good else 1)


if __name__ == "__main__":
    main()
