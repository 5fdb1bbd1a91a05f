"""Ten minutes with a pulse a second, verified; every figure that is checked is printed."""

import re
import subprocess
import tempfile
from pathlib import Path

from check import BINARY, PATIENCE_S, Machine, expect, expect_if, service

PULSES = 600
SECONDS = 600
# Of the default scene.
STEPS_PER_S = 500


def record(path):
    arguments = ["run", "--pace", "max", "--until", str(SECONDS), "--record", str(path)]
    with service(arguments, "verified") as (process, client):
        client.learn()
        control, pulse = client.type("Control"), client.type("TorquePulse")
        pause, resume = control(), control()
        pause.pause.SetInParent()
        resume.resume.SetInParent()
        expect("paused", client.command("control", pause).accepted)
        for n in range(PULSES):
            # Some of the time is over before the first is sent: what is left of it goes between them.
            message = pulse(id=f"{n}", torque_nm=(-1) ** n, duration_s=0.1, delay_s=0.8 * n)
            reply = client.type("CommandReply").FromString(client.ask("torque", message.SerializeToString()))
            if not reply.accepted:
                expect(f"pulse {n} is accepted", False, reply.reason)
        expect("and goes on", client.command("control", resume).accepted)
        expect("the session ends by itself", process.wait(PATIENCE_S + SECONDS) == 0)


def main():
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "take.mcap"
        record(path)
        machine = Machine()
        verified = subprocess.run([BINARY, "verify", str(path)], capture_output=True, text=True)
        quiet = machine.is_quiet()
    print("     " + verified.stdout.strip().replace("\n", "\n     "))
    expect("intact, and equal to the bit", verified.returncode == 0, verified.stderr.strip())
    steps, pulses, factor = map(int, re.search(r"(\d+) steps from \d+ checkpoints? with (\d+) pulses?.*\((\d+) times real", verified.stdout).groups())
    expect("all of it", pulses == PULSES and steps == SECONDS * STEPS_PER_S, f"{pulses} pulses, {steps} steps")
    balance_j, part = map(float, re.search(r"energy balance to (\S+) J, (\S+) of the", verified.stdout).groups())
    expect("energy is balanced within 1e-3 of that in play", part < 1e-3, f"{balance_j} J, {part}")
    expect_if(quiet, "at least 20 times faster than real time", factor >= 20, f"{factor} times")


if __name__ == "__main__":
    main()
