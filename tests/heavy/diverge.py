"""Diverging sessions and extreme scenes, each recorded and verified; every figure that is checked is printed."""

import collections
import contextlib
import random
import subprocess
import sys
import tempfile
from pathlib import Path

from check import BINARY, PATIENCE_S, expect, service

# What `run` may end with: done, lossy, diverged, not to be trusted.
ENDINGS = {0: "finished", 2: "refused", 3: "lossy", 4: "diverged", 6: "not to be trusted"}
# A key, and what it may be.
KEYS = {
    "solver.step_s": [1e-5, 1e-4, 5e-3, 0.02, 0.1, 1.0, 10.0],
    "solver.integrator": ["esdirk", "generalized-alpha", "two-point", "runge-kutta"],
    "solver.model": ["modal", "finite-element", "rigid"],
    "slider.mass_kg": [0.0, 1e-6, 1e3, 1e6],
    "slider.friction_n_s_per_m": [1.0, 1e6, 1e12],
    "crank.damping_s": [0.0, 1e-2, 1.0],
    "rod.damping_s": [0.0, 1e-2, 1.0],
    "base.damper_nm_s_per_rad": [1.0, 1e3, 1e9],
    "rod.youngs_modulus_pa": [1e4, 1e7, 1e15],
    "rod.length_m": [0.5001, 50.0],
    "pulse.0.torque_nm": [1e-6, 1e3, 1e6],
    "pulse.0.duration_s": [1e-6, 1e-2, 1e6],
    "start.rate_rad_per_s": [1e2, 1e4],
    "gravity.y_m_per_s2": [-9.81, -1e4],
}


def judge(path, ended, counts, what):
    """A recording is sound whatever became of its run, and says what `verify` says."""
    verified = subprocess.run([BINARY, "verify", str(path)], capture_output=True, text=True, timeout=600)
    untrusted = "not to be trusted" in verified.stdout
    counts[ENDINGS.get(ended, f"exit code {ended}")] += 1
    sound = verified.returncode in (0, 3) and ended in ENDINGS and (not untrusted or ended in (4, 6))
    if not sound:
        expect(f"{what}: verifies", False, f"run {ended}, verify {verified.returncode}\n{verified.stdout}{verified.stderr}")


def session(path, chance, number):
    """Random pulses until the simulation gives up, or the time is over."""
    arguments = ["run", "--until", "60", "--record", str(path), "--set", "commands.torque_limit_nm=1e9"]
    with service(arguments, f"diverge-{number}") as (process, client):
        client.learn()
        for n in range(12):
            torque_nm = 10 ** chance.uniform(2, 8) * chance.choice((-1, 1))
            pulse = client.type("TorquePulse")(id=f"{n}", torque_nm=torque_nm, duration_s=10 ** chance.uniform(-4, 0), shape=n % 2)
            # Nobody answers any more where it has diverged.
            if process.poll() is not None or client.ask("torque", pulse.SerializeToString(), patience_s=0.3) is None:
                break
        with contextlib.suppress(subprocess.TimeoutExpired):
            return process.wait(1.0)
        stop = client.type("Control")()
        stop.stop.SetInParent()
        client.ask("control", stop.SerializeToString(), patience_s=0.3)
        return process.wait(PATIENCE_S)


def extreme(path, chance, number):
    chosen = chance.sample(sorted(KEYS), chance.randint(1, 4))
    sets = [word for key in chosen for word in ("--set", f"{key}={chance.choice(KEYS[key])}")]
    arguments = [BINARY, "run", "--pace", "max", "--until", "0.5", "--record", str(path), "--name", f"extreme-{number}"]
    ran = subprocess.run([*arguments, "--listen", "tcp/127.0.0.1:0", *sets], capture_output=True, text=True, timeout=600)
    return ran.returncode, " ".join(sets)


def main():
    sessions, runs = int(sys.argv[2]), int(sys.argv[3])
    chance = random.Random(13)
    with tempfile.TemporaryDirectory() as folder:
        counts = collections.Counter()
        for number in range(sessions):
            path = Path(folder) / f"session-{number}.mcap"
            judge(path, session(path, chance, number), counts, f"session {number}")
            path.unlink()
        expect(f"{sessions} sessions verify", True, dict(counts))
        counts = collections.Counter()
        for number in range(runs):
            path = Path(folder) / f"run-{number}.mcap"
            ended, sets = extreme(path, chance, number)
            if ended == 2:
                counts["refused"] += 1
                continue
            judge(path, ended, counts, sets)
            path.unlink()
        expect(f"{runs} extreme runs verify", True, dict(counts))


if __name__ == "__main__":
    main()
