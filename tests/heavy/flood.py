"""A flood of commands from one client, in paired runs with and without: lateness moves little, what is refused is counted."""

import statistics
import subprocess
import sys
import time

from check import Client, expect, service, wait_for

RATE_HZ = 100_000
LIMIT = 0.25
# Quantiles below this are the clock's and the histogram's own noise.
FLOOR_S = 2e-6


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
        time.sleep(0.0005)
    print(sent)
    client.session.close()


def run(seconds, floods):
    with service(["run", "--no-record", "--until", str(seconds + 3), "--set", "solver.step_s=1e-3"], "flood") as (process, client):
        client.learn()
        wait_for(lambda: client.newest("status"), "the service runs")
        sent = 0
        command = [sys.executable, __file__, sys.argv[1], "client" if floods else "idle", process.args[-1], str(seconds)]
        sender = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        sent = int(sender.communicate()[0] or 0)
        process.wait(60)
        status = client.newest("status")
    return status, sent


def main(pairs, seconds):
    quiet, noisy = [], []
    for number in range(pairs):
        without, _ = run(seconds, False)
        status, sent = run(seconds, True)
        quiet.append((without.lateness_p50_s, without.lateness_p99_s))
        noisy.append((status.lateness_p50_s, status.lateness_p99_s))
        counted = status.commands_accepted + status.commands_rejected
        us = lambda pair: " / ".join(f"{x * 1e6:.1f}" for x in pair)
        print(f"pair {number + 1}: p50 / p99 without {us(quiet[-1])} us, with {us(noisy[-1])} us; {sent / seconds:.0f} commands/s sent, "
              f"{status.commands_accepted} taken, {status.commands_rejected} refused", flush=True)
        expect("every command that came is counted", 0 < counted <= sent, f"{counted} of {sent}")
        expect("the service holds real time", abs(status.real_time_factor - 1) < 2e-3, f"{status.real_time_factor:.5f}")
    for k, name in enumerate(("median", "p99")):
        before, after = (statistics.median(row[k] for row in rows) for rows in (quiet, noisy))
        moved = (after - before) / max(before, FLOOR_S)
        expect(f"{name} lateness moves by less than {LIMIT:.0%}", moved < LIMIT, f"{before * 1e6:.1f} -> {after * 1e6:.1f} us, {moved:+.0%}")


if __name__ == "__main__":
    if sys.argv[2] == "client":
        flood(sys.argv[3], float(sys.argv[4]))
    elif sys.argv[2] == "idle":
        time.sleep(float(sys.argv[4]))
    else:
        main(int(sys.argv[2]), float(sys.argv[3]))
