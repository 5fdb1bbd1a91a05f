"""A flood of commands from one client, in paired runs with and without: lateness moves little, what is refused is counted."""

import subprocess
import sys
import time

import pairs
from check import Client, Machine, expect, expect_real_time, service, wait_for

RATE_HZ = 100_000
# Seldom: on the machine of the service, whose processors these are as well, every one of the client's own wake-ups is an interrupt that
# takes 15 us on a virtual machine, flood or not.
BURST_S = 0.005


def flood(endpoint, seconds):
    """Puts pulses as fast as asked; prints how many."""
    client = Client(endpoint, "flood")
    client.learn()
    client.subscriber.undeclare()
    message = client.type("TorquePulse")(torque_nm=1e-9, duration_s=1e-3).SerializeToString()
    publisher = client.session.declare_publisher(f"{client.root}/torque")
    begun, sent = time.perf_counter(), 0
    while time.perf_counter() - begun < seconds:
        while sent < RATE_HZ * (time.perf_counter() - begun):
            publisher.put(message)
            sent += 1
        time.sleep(BURST_S)
    print(sent)
    client.session.close()


def run(seconds, floods, options=pairs.OPTIONS):
    with service(["run", "--no-record", "--until", str(seconds + 3), *options, "--set", "solver.step_s=1e-3"], "flood") as (process, client):
        client.learn()
        wait_for(lambda: client.newest("status"), "the service runs")
        sent = 0
        command = [sys.executable, __file__, sys.argv[1], "client" if floods else "idle", process.args[-1], str(seconds)]
        sender = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        sent = int(sender.communicate()[0] or 0)
        process.wait(60)
        status = client.newest("status")
    return status, sent


def main(count, seconds):
    machine, without, disturbed = Machine(), [], []
    for number in range(count):
        quiet, _ = run(seconds, False)
        status, sent = run(seconds, True)
        without.append(quiet)
        disturbed.append(status)
        counted = status.commands_accepted + status.commands_rejected
        print(f"pair {number + 1}: p50 / p99 without {pairs.told(quiet)}, with {pairs.told(status)}; {sent / seconds:.0f} commands/s sent, "
              f"{status.commands_accepted} taken, {status.commands_rejected} refused", flush=True)
        expect("every command that came is counted", 0 < counted <= sent, f"{counted} of {sent}")
    caught_up, _ = run(seconds, True, ())
    quiet = machine.is_quiet()
    expect_real_time(quiet, caught_up.real_time_factor, 2e-3)
    pairs.expect_alike(quiet, without, disturbed)


if __name__ == "__main__":
    if sys.argv[2] == "client":
        flood(sys.argv[3], float(sys.argv[4]))
    elif sys.argv[2] == "idle":
        time.sleep(float(sys.argv[4]))
    else:
        main(int(sys.argv[2]), float(sys.argv[3]))
