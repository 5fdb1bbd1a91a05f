"""The whole study of the default scene, and its choice; every figure that is checked is printed."""

import csv
import resource
import subprocess
import tempfile
import time
import tomllib
from pathlib import Path

from check import BINARY, Machine, expect, expect_if

LIMIT_S = 300.0
MODELS = {"rigid", "modal", "finite-element"}


def main():
    machine, begun, before = Machine(), time.monotonic(), resource.getrusage(resource.RUSAGE_CHILDREN)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "trade.csv"
        told = subprocess.run([BINARY, "trade", "crank-slider", "--csv", str(path)], capture_output=True, text=True)
        took_s = time.monotonic() - begun
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        expect("trade ends with 0", told.returncode == 0, told.stderr.strip())
        with path.open(newline="") as file:
            rows = list(csv.DictReader(file))
    quiet = machine.is_quiet()
    cpu_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    front = [row for row in rows if float(row["on_front"] or 0) == 1]
    whole = "the time budget ran out" not in told.stderr
    models = sorted({row["model"] for row in front})
    expect_if(quiet, "within five minutes", took_s < LIMIT_S, f"{took_s:.0f} s, {cpu_s:.0f} s of processor time")
    expect_if(quiet, "and not because its time was over", whole, f"{len(rows)} configurations")
    expect_if(quiet or whole, "every model is on the front", set(models) == MODELS, f"{len(front)} on it: {', '.join(models)}")


def choice():
    """The default scene has the settings that it says it has: the choice among all, by counted work."""
    machine = Machine()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "chosen.toml"
        demands = ["--tolerance", "1e-3", "--real-time-factor", "20", "--write", str(path)]
        told = subprocess.run([BINARY, "trade", "crank-slider", *demands], capture_output=True, text=True)
        quiet, whole = machine.is_quiet(), "the time budget ran out" not in told.stderr
        expect_if(quiet or whole, "the choice ends with 0", told.returncode == 0, told.stderr.strip().split("\n")[-1])
        chosen = tomllib.loads(path.read_text()) if path.exists() else {}
    own = tomllib.loads(subprocess.run([BINARY, "scenes", "crank-slider"], capture_output=True, text=True).stdout)
    expect_if(quiet or whole, "and is the default scene's own settings", chosen == own, str(chosen.get("solver")))


if __name__ == "__main__":
    main()
    choice()
