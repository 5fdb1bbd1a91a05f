"""Pulses from four clients at once, each in a process of its own, every third sent twice: in the recording, and in
the torque that was felt, each is there once. The balance of energy says nothing of single pulses: it is checked as in any run."""

import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from check import Client, Machine, expect, expect_if, recorded, service, wait_for

CLIENTS = 4
TORQUE_NM = 0.001
DURATION_S = 1e-3
STEP_S = 1e-3
ATTEMPTS = 5


def send(endpoint, who, count):
    """Sends its share; prints the wall time that each answer took."""
    client = Client(endpoint, "pulses")
    client.learn()
    client.subscriber.undeclare()
    pulse = client.type("TorquePulse")
    reply = client.type("CommandReply")
    for number in range(count):
        message = pulse(id=f"{who}-{number}", torque_nm=TORQUE_NM, duration_s=DURATION_S).SerializeToString()
        for _ in range(2 if number % 3 == 0 else 1):
            for _ in range(ATTEMPTS):
                begun = time.perf_counter()
                answer = client.ask("torque", message)
                if answer is not None and reply.FromString(answer).accepted:
                    print(time.perf_counter() - begun)
                    break
                time.sleep(0.01)
            else:
                sys.exit(f"{who}-{number} was never accepted")
    client.session.close()


def main(total):
    machine, each = Machine(), total // CLIENTS
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "pulses.mcap"
        arguments = ["run", "--publish-hz", "all", "--record", str(path), "--set", "pulse=[]", "--set", f"solver.step_s={STEP_S}"]
        # Rigid links: what the pulses do is all the energy there is, and nothing rings that the step does not resolve.
        arguments += ["--set", "solver.model=rigid", "--set", "solver.integrator=runge-kutta"]
        with service([*arguments, "--set", "commands.pending_limit=65536"], "pulses") as (process, client):
            client.learn()
            endpoint = process.args[-1]
            wait_for(lambda: client.newest("status"), "the service runs")
            command = [sys.executable, __file__, sys.argv[1], "client", endpoint]
            senders = [subprocess.Popen([*command, str(who), str(each)], stdout=subprocess.PIPE, text=True) for who in range(CLIENTS)]
            answers = [float(line) for sender in senders for line in sender.communicate()[0].split()]
            expect("every client is answered", all(sender.returncode == 0 for sender in senders))
            wait_for(lambda: client.newest("status").pulses_pending == 0, "the last pulse ends")
            stop = client.type("Control")(id="stop")
            stop.stop.SetInParent()
            client.command("control", stop)
            process.wait(30)
        topics = recorded(path)
    ids = [decoded.reply.id for _, decoded in topics["commands"] if decoded.reply.id != "stop"]
    expect("no pulse is lost", len(set(ids)) == each * CLIENTS, f"{len(set(ids))} of {each * CLIENTS}")
    expect("no pulse is doubled", len(ids) == len(set(ids)))
    loads = [decoded for _, decoded in topics["loads"]]
    felt = sum(b.driving_torque_nm * (b.stamp.sim_time_s - a.stamp.sim_time_s) for a, b in zip(loads, loads[1:]))
    exact = each * CLIENTS * TORQUE_NM * DURATION_S
    expect("the torque felt integrates to their impulse", abs(felt / exact - 1) < 1e-9, f"off by {felt / exact - 1:.1e}")
    last = topics["status"][-1][1]
    energy_j = last.kinetic_j
    balance = abs(last.balance_error_j) / (abs(last.work_in_j) + energy_j + 1e-12)
    expect("the energy ledger balances", balance < 1e-6, f"{balance:.1e} of work and energy")
    answers.sort()
    p99 = answers[len(answers) * 99 // 100]
    print(f"     answers: median {statistics.median(answers) * 1e3:.2f} ms, p99 {p99 * 1e3:.2f} ms, {p99 / STEP_S:.2f} steps")
    expect_if(machine.is_quiet(), "acknowledged within two steps at the 99th percentile", p99 <= 2 * STEP_S, f"{p99 / STEP_S:.2f} steps (Python, own process)")


if __name__ == "__main__":
    if sys.argv[2] == "client":
        send(sys.argv[3], sys.argv[4], int(sys.argv[5]))
    else:
        main(int(sys.argv[2]))
