"""A flood of commands from one client, in paired runs with and without: lateness moves little, and every command is counted."""

import subprocess
import sys
import time

import zenoh

import pairs
from check import Client, Machine, expect, expect_if, expect_real_time, service, wait_for

RATE_HZ = 100_000
# The service shares its processors with the client: without the flood, the client wakes as often and sends nothing.
BURST_S = 1e-3
# What is to reach the service, beside what is tried.
REACHING_HZ = 90_000


def flood(endpoint, seconds, rate_hz):
    """Puts pulses at a rate; prints a line when it begins, then how many it has put."""
    client = Client(endpoint, "flood")
    client.learn()
    client.subscriber.undeclare()
    message = client.type("TorquePulse")(torque_nm=1e-9, duration_s=1e-3).SerializeToString()
    # Blocking, a full queue of the client slows it down. Otherwise it drops commands without a word.
    blocking = zenoh.CongestionControl.BLOCK
    publisher = client.session.declare_publisher(f"{client.root}/torque", congestion_control=blocking)
    print("begins", flush=True)
    begun, sent = time.perf_counter(), 0
    while (passed := time.perf_counter() - begun) < seconds:
        for _ in range(int(rate_hz * passed) - sent):
            publisher.put(message)
            sent += 1
        time.sleep(BURST_S)
    print(sent, flush=True)
    sys.stdin.read()  # until the service has counted them
    client.session.close()


def counted(status):
    return status.commands_accepted + status.commands_rejected


def run(seconds, floods, options=pairs.OPTIONS):
    """The stretch that was flooded, or was not, the last status, and the commands sent and counted a second."""
    arguments = ["run", "--no-record", *options, "--set", "solver.step_s=1e-3"]
    with service(arguments, "flood") as (process, client):
        client.learn()
        wait_for(lambda: client.newest("status"), "the service runs")
        command = [sys.executable, __file__, sys.argv[1], "client", process.args[-1], str(seconds), str(RATE_HZ * floods)]
        sender = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        sender.stdout.readline()
        seen = len(client.payloads["status"])
        wait_for(lambda: len(client.payloads["status"]) > seen, "a status of the stretch")
        before = client.newest("status")
        sent = int(sender.stdout.readline())
        after = client.newest("status")
        wait_for(lambda: counted(client.newest("status")) >= sent, "all commands are counted")
        last = client.newest("status")
        sender.stdin.close()
        sender.wait()
    expect("accepted + refused = sent", counted(last) == sent, f"{last.commands_accepted} + {last.commands_rejected} = {sent}")
    stretch = pairs.stretch(before, after)
    return stretch, last, sent / seconds, (counted(after) - counted(before)) / stretch.seconds


def main(count, seconds):
    machine, without, disturbed, rates = Machine(), [], [], []
    for number in range(count):
        quiet, *_ = run(seconds, False)
        flooded, _, sent_hz, counted_hz = run(seconds, True)
        without.append(quiet)
        disturbed.append(flooded)
        rates.append(counted_hz)
        print(f"pair {number + 1}: without {pairs.told(quiet)};\n        with {pairs.told(flooded)}; "
              f"{sent_hz:.0f} commands/s sent, {counted_hz:.0f} counted", flush=True)
    _, caught_up, *_ = run(seconds, True, ())
    quiet = machine.is_quiet()
    expect_if(quiet, f"at least {REACHING_HZ} commands/s reach the service", min(rates) >= REACHING_HZ, f"{min(rates):.0f}/s")
    expect_real_time(quiet, caught_up.real_time_factor, 2e-3)
    pairs.expect_alike(quiet, without, disturbed)


if __name__ == "__main__":
    if sys.argv[2] == "client":
        flood(sys.argv[3], float(sys.argv[4]), float(sys.argv[5]))
    else:
        main(int(sys.argv[2]), float(sys.argv[3]))
