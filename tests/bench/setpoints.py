#!/usr/bin/env python3
"""Setpoints at 1 kHz from Python, by put, for 10 s: counts how many took effect, and in which steps.

Usage: tests/bench/setpoints.py BINARY [SECONDS [RATE_HZ]]   (a Python with tests/interop/requirements.txt)
"""

import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "interop"))
from check import BINARY, Machine, expect, expect_if, service, wait_for  # noqa: E402


def main():
    seconds = float(sys.argv[2]) if len(sys.argv) > 2 else 10.0
    rate_hz = float(sys.argv[3]) if len(sys.argv) > 3 else 1000.0
    machine = Machine()
    with tempfile.TemporaryDirectory() as folder:
        arguments = ["run", "--record", f"{folder}/run.mcap", "--set", "pulse=[]"]
        with service(arguments, "fast") as (process, client):
            client.learn()
            wait_for(lambda: client.newest("status") is not None, "status")
            publisher = client.session.declare_publisher(f"{client.root}/setpoint")
            setpoint = client.type("Setpoint")
            count, late_s, begun = int(seconds * rate_hz), 0.0, time.perf_counter()
            for n in range(count):
                due_s = begun + n / rate_hz
                while (now := time.perf_counter()) < due_s:
                    time.sleep(max(0.0, due_s - now - 1e-4))
                late_s = max(late_s, now - due_s)
                publisher.put(setpoint(torque_nm=0.5 * (-1) ** n, hold_s=0.05).SerializeToString())
            took_s = time.perf_counter() - begun
            wait_for(lambda: client.newest("status").setpoints_expired > 0, "the last one expires")
            status = client.newest("status")
            stop = client.type("Control")()
            stop.stop.SetInParent()
            client.command("control", stop)
            process.wait(20)
        print(f"     {count} puts in {took_s:.3f} s, the latest {1e3 * late_s:.1f} ms late; overruns {status.overruns}, "
              f"step cost p99 {1e6 * status.step_cost_p99_s:.0f} us, lateness p99 {1e6 * status.lateness_p99_s:.0f} us")
        expect("none is lost", status.commands_accepted == count, f"{status.commands_accepted} of {count}")
        # They expire after 50 ms without another, so that a stall of the machine ends one.
        expect_if(machine.is_quiet(), "none expired but the last", status.setpoints_expired == 1, status.setpoints_expired)
        verified = subprocess.run([BINARY, "verify", f"{folder}/run.mcap"], capture_output=True, text=True)
        expect("the recording is computed again to the bit", verified.returncode == 0, "\n" + verified.stdout)


main()
