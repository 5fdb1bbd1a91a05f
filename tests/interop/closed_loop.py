"""The guide's pulse and controller as printed, the latter in lock-step and in real time; and how often Python can advance a service."""

import json
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from check import BINARY, PATIENCE_S, Machine, expect, expect_if, free_endpoint, service, wait_for

RESISTANCE = "slider.resistance_table=[[0, 0], [3.14, 0], [5.8, 20], [6.28, 0]]"


def endpoints(name="crank"):
    """The endpoints of the service of this name, if it runs."""
    listed = subprocess.run([BINARY, "list", "--json"], capture_output=True, text=True)
    services = [json.loads(line) for line in listed.stdout.splitlines()]
    return next((service["endpoints"] for service in services if service["name"] == name), [])


def listing(number, most_lines):
    """The guide's listing of this number, from 0."""
    text = Path("src/guide/bus.md").read_text().split("```python\n")[1 + number].split("```")[0]
    expect(f"listing {number} of the guide has at most {most_lines} lines", len(text.strip().splitlines()) <= most_lines)
    return text


def regress_a_program_reaches_its_endpoint_alone(folder):
    """The guide's programs at another endpoint than that of `crank`: a peer of zenoh goes on from there to `crank`."""
    programs = (listing(0, 15), listing(1, 25))
    sent = lambda program, endpoint: subprocess.run(
        [sys.executable, "-c", program, endpoint], capture_output=True, text=True, timeout=PATIENCE_S
    )
    process = subprocess.Popen([BINARY, "run", "--no-record", "--name", "arm"], cwd=folder)
    try:
        wait_for(lambda: endpoints("arm"), "the other service is found")
        for program in programs * 2:
            refused = sent(program, endpoints("arm")[0])
            says = refused.returncode == 1 and refused.stderr.startswith("no `schema` from `crank` at ")
            expect("a program of the guide reaches its endpoint alone", says, refused.stdout + refused.stderr)
    finally:
        process.kill()
        process.wait()
    for program in programs:
        refused = sent(program, free_endpoint())
        says = refused.returncode == 1 and "ZError: Unable to connect" in refused.stderr
        expect("an endpoint where nothing listens is an error", says, (refused.stdout + refused.stderr).strip().splitlines()[-1])


def pulsed(folder):
    """Runs the guide's program that sends a pulse, with a service."""
    process = subprocess.Popen([BINARY, "run", "--no-record"], cwd=folder)
    try:
        wait_for(endpoints, "the service is found")
        command = [sys.executable, "-c", listing(0, 15), endpoints()[0]]
        sent = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S)
        expect("the guide's pulse is accepted", sent.stdout.startswith("accepted: true\neffective_step: "), sent.stdout + sent.stderr)
        regress_a_program_reaches_its_endpoint_alone(folder)
        process.send_signal(signal.SIGINT)
        expect("Ctrl-C ends cleanly", process.wait(PATIENCE_S) == 0)
    finally:
        process.kill()
        process.wait()


def controlled(folder, pace, within):
    """Runs the guide's controller with a service at this pace, and verifies the recording."""
    record = f"{folder}/{pace}.mcap"
    arguments = ["run", "--pace", pace, "--record", record, "--set", "pulse=[]", "--set", RESISTANCE]
    process = subprocess.Popen([BINARY, *arguments], cwd=folder)
    try:
        wait_for(endpoints, "the service is found")
        command = [sys.executable, "-c", listing(1, 25), endpoints()[0]]
        printed = subprocess.run(command, capture_output=True, text=True, timeout=2 * PATIENCE_S)
        speed = float(printed.stdout.split()[0]) if printed.returncode == 0 else printed.stderr
        expect(f"the controller holds 10 rad/s, {pace}", printed.returncode == 0 and abs(speed - 10) < within, speed)
        process.send_signal(signal.SIGINT)
        expect("Ctrl-C ends cleanly", process.wait(PATIENCE_S) == 0)
    finally:
        process.kill()
        process.wait()
    verified = subprocess.run([BINARY, "verify", record, "--json"], capture_output=True, text=True)
    expect("its recording is computed again to the bit", json.loads(verified.stdout)["verdict"] == "equal", verified.stdout)
    return speed


def round_trips():
    """Round trips a second of one step each, beside those of a query that zenoh's own thread answers."""
    machine, count, rates = Machine(), 1000, {}
    with service(["run", "--pace", "lockstep", "--no-record"], "fast") as (process, client):
        client.learn()
        advance = client.type("Advance")(torque_nm=0.1, steps=1).SerializeToString()
        for key, payload in (("advance", advance), ("about", None)) * 3:
            begun = time.perf_counter()
            for _ in range(count):
                if client.ask(key, payload) is None:
                    expect(f"{key} is answered", False)
            rates.setdefault(key, []).append(count / (time.perf_counter() - begun))
        process.send_signal(signal.SIGINT)
        process.wait(PATIENCE_S)
    quiet = machine.is_quiet()
    plain, advances = (sorted(rates[key])[1] for key in ("about", "advance"))
    figure = f"{advances:.0f} a second; {plain:.0f} of a query for `about`"
    expect_if(quiet, "Python advances a service 1,500 times a second", advances > 1500, figure)


def main():
    with tempfile.TemporaryDirectory() as folder:
        pulsed(folder)
        controlled(folder, "lockstep", 0.1)
        controlled(folder, "real", 0.5)
    round_trips()
    print("closed loop: all holds")


if __name__ == "__main__":
    main()
