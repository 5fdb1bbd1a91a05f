"""What `linearise` writes, as python-control, NumPy and Octave read it, beside a run: 1e-6 N·m on the crank at 57° for 0.02 s."""

import csv
import math
import runpy
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy
from scipy.io import loadmat
from check import BINARY, expect, free_endpoint

sys.path.insert(0, str(Path(__file__).parent.parent / "bench"))
from control_check import check, load  # noqa: E402

ANGLE_DEG = 57.0
SECONDS = 0.5
PULSE = "pulse=[{start_s=0.0,torque_nm=1e-6,duration_s=0.02}]"
# Columns of the recording, by topic and output.
COLUMNS = {
    "crank_angle_rad": ("angles", "links.crank.start_rotation_rad"),
    "crank_chord_rad": ("angles", "links.crank.chord_rad"),
    "rod_chord_rad": ("angles", "links.rod.chord_rad"),
    "slider_m": ("displacements", "nodes.rod.4.x_m"),
}


def run(*arguments):
    subprocess.run([BINARY, *map(str, arguments)], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def recorded(folder):
    """A run's outputs as differences from its start, in a file as `control_check` reads it."""
    scene = ["crank-slider", "--set", PULSE, "--set", f"start.angle_rad={math.radians(ANGLE_DEG)!r}"]
    fine = ["--set", "solver.step_s=1e-4", "--set", "solver.tolerance=1e-12", "--set", "solver.integrator=esdirk"]
    run("run", *scene, *fine, "--pace", "max", "--until", SECONDS, "--listen", free_endpoint(), "--record", folder / "run.mcap")
    run("export", folder / "run.mcap", "--csv", folder)
    tables = {}
    for topic in ("angles", "displacements"):
        with open(next(folder.glob(f"*.{topic}.csv"))) as file:
            tables[topic] = list(csv.DictReader(file))
    times = [float(row["stamp.sim_time_s"]) for row in tables["angles"]]
    columns = [[float(row[column]) for row in tables[topic]] for topic, column in COLUMNS.values()]
    rows = zip(times, *([value - column[0] for value in column] for column in columns))
    response = folder / "response.csv"
    lines = [",".join(["time_s", *COLUMNS])] + [",".join(map(repr, row)) for row in rows]
    response.write_text("\n".join(lines) + "\n")
    return response


def val_python_control_reads_what_linearise_writes(folder):
    response = recorded(folder)
    for name, more in (("continuous", []), ("held", ["--step", "1ms"])):
        model = folder / f"{name}.py"
        run("linearise", "crank-slider", "--angle", ANGLE_DEG, "-o", model, *more)
        system = load(model)
        expect(f"{name}: states, inputs and outputs have names", "torque_nm" in system.input_labels, system.nstates)
        expect(f"{name}: the response is that of a run to 1e-6 of its largest", check(model, response, "torque_nm"), "above")


def by_octave(file):
    """The arrays of a file for Octave, and those of the system that its second line makes of them."""
    made = next(line for line in file.read_text().splitlines() if "ss(" in line).lstrip("% ")
    saved = file.with_suffix(".mat")
    program = f"pkg load control; source('{file}'); {made}; [a, b, c, d] = ssdata(sys); save('-v6', '{saved}')"
    subprocess.run(["octave-cli", "--quiet", "--eval", program], check=True, stdout=subprocess.DEVNULL)
    return loadmat(saved, chars_as_strings=True)


def val_all_read_the_same(folder):
    for name, more in (("free", []), ("held", ["--crank", "held", "--step", "1ms"]), ("clamped", ["--crank", "held"])):
        scene = "thesis-beam" if name == "clamped" else "crank-slider"
        model = ["--set", "solver.model=modal", "--set", "solver.integrator=esdirk"]
        for extension in ("py", "npz", "m"):
            run("linearise", scene, *model, *more, "-o", folder / f"{name}.{extension}")
        text, binary = runpy.run_path(str(folder / f"{name}.py")), numpy.load(folder / f"{name}.npz")
        same = all(numpy.array_equal(text[key], binary[key]) for key in (*"ABCD", "states", "outputs", "at"))
        same &= list(text["inputs"]) == list(binary["inputs"]) and (text["dt"] or 0) == binary["dt"]
        expect(f"{name}: .npz holds what .py does", same, binary["A"].shape)
        octave = by_octave(folder / f"{name}.m")
        same = all(numpy.array_equal(text[key], octave[own]) for key in "ABCD" for own in (key, key.lower()))
        same &= all(list(text[key]) == [str(cell[0]) for cell in octave[key].flat] for key in ("states", "inputs", "outputs"))
        same &= (text["dt"] or 0) == octave["dt"].item() and numpy.array_equal(text["at"], octave["at"].flatten())
        expect(f"{name}: Octave holds what .py does, and makes a system of it", same, octave["A"].shape)


with tempfile.TemporaryDirectory() as temporary:
    val_python_control_reads_what_linearise_writes(Path(temporary))
    val_all_read_the_same(Path(temporary))
