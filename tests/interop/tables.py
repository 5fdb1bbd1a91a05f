"""Exported tables as pandas and polars read them; every figure that is checked is printed."""

import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pandas
import polars
import pyarrow.parquet

from check import BINARY, expect, free_endpoint

SECONDS = 60.0
TIMES = ("log_time", "publish_time", "stamp.wall_time")
INTEGERS = ("stamp.step", "stamp.epoch")


def exported(recording, folder, *arguments):
    """Both formats of a recording: the names of its tables."""
    command = [BINARY, "export", str(recording), "--csv", str(folder), "--parquet", str(folder), *arguments]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    names = sorted(path.stem for path in folder.glob("*.parquet"))
    expect(f"{recording.name} {' '.join(arguments)}: as many tables", names == sorted(path.stem for path in folder.glob("*.csv")), len(names))
    return names


def alike(folder, name):
    """A table is the same in both formats and by both readers, with a type for each column."""
    binary, text = polars.read_parquet(folder / f"{name}.parquet"), polars.read_csv(folder / f"{name}.csv", infer_schema_length=None)
    expect(f"{name}: the same columns and rows", binary.columns == text.columns and len(binary) == len(text), f"{binary.shape}")
    wrong = [column for column in binary.columns if not same(binary[column], text[column])]
    nulls = sum(binary.null_count().row(0))
    expect(f"{name}: polars reads the same values, of one type a column", not wrong, wrong or f"{nulls} of them null")
    frame, plain = pandas.read_parquet(folder / f"{name}.parquet"), pandas.read_csv(folder / f"{name}.csv")
    numbers = [column for column in frame.columns if pandas.api.types.is_numeric_dtype(frame[column].dtype)]
    equal = frame[numbers].astype(float).equals(plain[numbers].astype(float))
    times = str(frame["log_time"].dtype) == "datetime64[ns, UTC]" and bool((frame["log_time"] == pandas.to_datetime(plain["log_time"])).all())
    expect(f"{name}: pandas reads the same numbers and times", equal and times, f"{len(numbers)} columns of numbers")


def same(typed, text):
    """Whether a column of Parquet has the values of the CSV, and the type that its name promises."""
    if typed.name in TIMES:
        return typed.dtype == polars.Datetime("ns", "UTC") and typed.dt.strftime("%Y-%m-%dT%H:%M:%S.%9fZ").equals(text)
    if typed.dtype == polars.String:
        return typed.fill_null("").equals(text.cast(polars.String).fill_null(""))
    if typed.name in INTEGERS and typed.dtype != polars.Int64:
        return False
    return typed.equals(text.cast(typed.dtype), null_equal=True)


def memory_mb(process):
    """The most memory that a process has had so far."""
    lines = Path(f"/proc/{process}/status").read_text().splitlines()
    return sum(int(line.split()[1]) / 1024 for line in lines if line.startswith("VmHWM:"))


def long(folder):
    """A long recording goes through in pieces: row groups, and memory that does not grow with it."""
    recording, peak = folder / "long.mcap", []
    for seconds in (SECONDS / 4, SECONDS):
        recording.unlink(missing_ok=True)
        run = ["run", "--pace", "max", "--until", str(seconds), "--publish-hz", "all", "--set", "solver.step_s=1e-3", "--record", str(recording)]
        subprocess.run([BINARY, *run, "--listen", free_endpoint(), "--name", "tables"], check=True, stderr=subprocess.DEVNULL)
        begun, most = time.monotonic(), 0.0
        process = subprocess.Popen([BINARY, "export", str(recording), "--parquet", str(folder / "long")], stdout=subprocess.DEVNULL)
        while process.poll() is None:
            most = max(most, memory_mb(process.pid))
            time.sleep(0.01)
        expect(f"{seconds:.0f} s at 1 kHz are exported", process.returncode == 0, f"in {time.monotonic() - begun:.1f} s, with {most:.0f} MB")
        peak.append(most)
    expect("in less than 100 MB, however long", max(peak) < 100.0 and peak[1] - peak[0] < 30.0)
    table = pyarrow.parquet.ParquetFile(folder / "long" / "flexcrank.tables.displacements.parquet")
    groups = [table.metadata.row_group(n).num_rows for n in range(table.num_row_groups)]
    expect("row groups of bounded size", len(groups) > 1 and sum(groups) == SECONDS * 1000 + 1, groups)
    steps = table.read(columns=["stamp.step"])["stamp.step"].to_pylist()
    expect("every step, in order", steps == list(range(int(SECONDS * 1000) + 1)))
    size = sum(path.stat().st_size for path in (folder / "long").glob("*.parquet"))
    print(f"     {size / 1e6:.1f} MB of Parquet from {recording.stat().st_size / 1e6:.1f} MB of MCAP")


def main():
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        cases = [("sample-three-pulses", []), ("sample-thesis", []), ("sample-diverging", [])]
        cases.append(("sample-three-pulses", ["--from", "1", "--to", "5", "--every", "0.01", "--columns", "stamp,links.crank"]))
        for n, (sample, arguments) in enumerate(cases):
            tables = folder / str(n)
            for name in exported(Path("recordings") / f"{sample}.mcap", tables, *arguments):
                alike(tables, name)
        long(folder)
    print("tables: all holds")


if __name__ == "__main__":
    main()
