"""A campaign's table by pyarrow; its indices by SALib; its scalars by a recording of the same scene."""

import csv
import math
import subprocess
import tempfile
from pathlib import Path

import pandas
import pyarrow.parquet
from SALib.analyze import sobol

from check import BINARY, expect

SCENE = ["crank-slider", "--set", "rod.length_m=1.1", "--set", "solver.model=finite-element"]
UNTIL_S = 0.5

def flexcrank(*words, code=0):
    done = subprocess.run([BINARY, *map(str, words)], capture_output=True, text=True)
    expect(f"{' '.join(map(str, words[:1]))}: exit code {code}", done.returncode == code, done.stderr.strip())
    return done.stdout

def indices(folder):
    """First-order and total indices of every scalar, against SALib's on the same outputs."""
    spec = folder / "sweep.toml"
    spec.write_text(flexcrank("files", "sweep.toml"))
    flexcrank("sweep", spec)
    table = pyarrow.parquet.read_table(folder / "sweep.sweep/table.parquet").to_pandas()
    keys = ["rod.length_m", "rod.density_kg_per_m3", "pulse.1.torque_nm"]
    expect("a row for each run, all of them done", list(table["index"]) == list(range(5120)) and set(table["ending"]) == {"done"}, len(table))
    expect("all of them to be trusted", set(table["verdict"]) == {"balanced"})
    expect("identities differ", table["id"].nunique() == len(table))
    problem = {"num_vars": 3, "names": keys, "bounds": [[1.2, 1.8], [2700, 7850], [-0.5, 0.5]]}
    inside = all(table[key].between(*bounds).all() for key, bounds in zip(keys, problem["bounds"]))
    expect("values are within their bounds", inside)
    flexcrank("sweep", spec, "--indices")
    rows = list(csv.DictReader((folder / "sweep.sweep/indices.csv").open()))
    worst, scalars = 0.0, sorted({row["scalar"] for row in rows})
    for scalar in scalars:
        theirs = sobol.analyze(problem, table[scalar].to_numpy(dtype=float), calc_second_order=False, num_resamples=2)
        for key, row in zip(keys, [row for row in rows if row["scalar"] == scalar]):
            place = keys.index(row["key"])
            assert key == row["key"]
            worst = max(worst, abs(float(row["first"]) - theirs["S1"][place]), abs(float(row["total"]) - theirs["ST"][place]))
    expect(f"indices of {len(scalars)} scalars are SALib's within 1e-12", worst < 1e-12 and len(scalars) > 20, worst)

def scalars(folder):
    """Scalars of a run, against a recording of the same scene."""
    spec = folder / "one.toml"
    spec.write_text(
        f'scene = "crank-slider"\nset = ["rod.length_m=1.1"]\nuntil_s = {UNTIL_S}\nmethod = "grid"\n'
        '[[vary]]\nkey = "solver.model"\nvalues = ["finite-element", "modal", "rigid"]\n'
    )
    flexcrank("sweep", spec)
    row = pandas.read_parquet(folder / "one.sweep/table.parquet").iloc[0]
    flexcrank("run", *SCENE, "--pace", "max", "--until", UNTIL_S, "--publish-hz", "all", "--no-bus", "--record", folder / "one.mcap")
    flexcrank("export", folder / "one.mcap", "--parquet", folder / "tables")
    tables = {path.stem.split(".")[-1]: pandas.read_parquet(path) for path in (folder / "tables").glob("*.parquet")}
    angles, loads, energies = (tables[name] for name in ("angles", "loads", "energies"))
    expect("as many steps as the recording", row["steps"] == angles["stamp.step"].max(), int(row["steps"]))
    moments = [name for name in loads if name.startswith("elements.rod.") and "moment" in name]
    for scalar, own in [
        ("rod_peak_rate_rad_per_s", angles["links.rod.rate_rad_per_s"].abs().max()),
        ("rod_mean_rate_rad_per_s", angles["links.rod.rate_rad_per_s"][1:].mean()),
        ("rod_final_angle_rad", angles["links.rod.chord_rad"].iloc[-1]),
        ("rod_peak_moment_nm", loads[moments].abs().max().max()),
        ("peak_kinetic_j", energies["kinetic_j"].max()),
    ]:
        expect(f"{scalar} is the recording's", math.isclose(row[scalar], own, rel_tol=1e-12), f"{row[scalar]} {own}")

def shares(folder):
    """Shares by scheduler's variables, missing rows by name, and the same table as of one worker."""
    spec = folder / "shares.toml"
    spec.write_text(flexcrank("files", "sweep.toml").replace("samples = 1024", "samples = 16"))
    whole = flexcrank("sweep", spec, "-o", folder / "whole")
    for task in "103":
        environment = {"SLURM_ARRAY_TASK_ID": task, "SLURM_ARRAY_TASK_MIN": "0", "SLURM_ARRAY_TASK_COUNT": "4"}
        subprocess.run([BINARY, "sweep", str(spec)], env=environment, check=True, stdout=subprocess.DEVNULL)
    missing = subprocess.run([BINARY, "sweep", str(spec), "--merge"], capture_output=True, text=True)
    expect("missing rows are named, with exit code 1", missing.returncode == 1 and "20 of 80 rows are missing: 2, 6, 10" in missing.stderr, missing.stderr)
    environment = {"JOB_COMPLETION_INDEX": "2", "JOB_COMPLETIONS": "4"}
    subprocess.run([BINARY, "sweep", str(spec)], env=environment, check=True, stdout=subprocess.DEVNULL)
    merged = flexcrank("sweep", spec, "--merge")
    expect("four shares make one worker's table", merged.split("SHA-256 ")[1] == whole.split("SHA-256 ")[1])
    lone = subprocess.run([BINARY, "sweep", str(spec)], env={"JOB_COMPLETION_INDEX": "2"}, capture_output=True, text=True)
    expect("an index without a number of completions is refused", lone.returncode == 2, lone.stderr.strip())

with tempfile.TemporaryDirectory() as folder:
    indices(Path(folder))
    scalars(Path(folder))
    shares(Path(folder))
