"""Replay against an outside subscriber; every figure that is checked is printed."""

import gc
import hashlib
import json
import random
import re
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from pathlib import Path

import zenoh
from mcap.reader import make_reader

from check import BINARY, Machine, expect, expect_if, free_endpoint

STARTS, ROUNDS = int(sys.argv[2]), int(sys.argv[3])
TELEMETRY = ("displacements", "angles", "loads", "energies")
SECONDS = 10.0


class Listener:
    """Everything that comes on some keys, with the time at which it came. What is heard is only kept, and looked at later."""

    def __init__(self, endpoint, key):
        config = zenoh.Config()
        config.insert_json5("scouting/multicast/enabled", "false")
        config.insert_json5("listen/endpoints", "[]")
        config.insert_json5("connect/endpoints", json.dumps([endpoint]))
        config.insert_json5("connect/retry", '{"period_init_ms": 20, "period_max_ms": 100}')
        self.samples = []
        keep, now = self.samples.append, time.monotonic
        self.session = zenoh.open(config)
        self.subscriber = self.session.declare_subscriber(key, lambda sample: keep((now(), sample)))

    def heard(self):
        """By topic."""
        topics = defaultdict(list)
        for came, sample in list(self.samples):
            topics[str(sample.key_expr).rsplit("/", 1)[1]].append((came, sample))
        return topics


def recorded(path):
    topics = defaultdict(list)
    with open(path, "rb") as file:
        for _, channel, message in make_reader(file).iter_messages():
            topics[channel.topic.rsplit("/", 1)[1]].append((message.log_time, message.data))
    return topics


def replay(path, endpoint, *arguments):
    command = [BINARY, "replay", str(path), "--name", "ghost", "--listen", endpoint, "--wait-for", "1", *arguments]
    return subprocess.Popen(command, stdin=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)


def spread_ms(late_s):
    """Quantiles 0.5, 0.99 and 1 of times late, the least of them taken off: clocks that begin elsewhere."""
    late_s = sorted(late_s)
    return [(late_s[int(quantile * (len(late_s) - 1))] - late_s[0]) * 1e3 for quantile in (0.5, 0.99, 1.0)]


def faithful(path):
    """At the recorded speed: the same bytes, and a report that agrees with what came.

    How late a message was put is judged by the stamp that zenoh itself gives it then: when it comes depends on network and
    subscriber as well, which on an ordinary machine are late by more than the replayer, and by other amounts every time.
    """
    wanted, endpoint = recorded(path), free_endpoint()
    stamping = path.with_name("stamping.json5")
    stamping.write_text("{ timestamping: { enabled: true } }")
    machine = Machine()
    process = replay(path, endpoint, "--zenoh-config", str(stamping))
    gc.disable()
    listener = Listener(endpoint, "flexcrank/ghost/*")
    report = process.communicate()[1]
    gc.enable()
    quiet = machine.is_quiet()
    listener.session.close()
    heard = listener.heard()
    print(f"     {report.strip()}")
    expect("replay exits with 0", process.returncode == 0)
    for topic in TELEMETRY:
        digest = lambda payloads: hashlib.sha256(b"".join(payloads)).hexdigest()
        sent, came = digest(data for _, data in wanted[topic]), digest(sample.payload.to_bytes() for _, sample in heard[topic])
        expect(f"{topic}: SHA-256 of all payloads", sent == came, sent[:16])
    messages, rate, *reported = re.search(
        r"replayed (\d+) messages .* at ([\d.]+) times .* late by ([\d.]+) ms \(p50\), ([\d.]+) ms \(p99\), ([\d.]+) ms \(max\)", report
    ).groups()
    reported = [float(figure) for figure in reported]
    # When it came, when it was put, and its log time, s.
    times = [
        (came, sample.timestamp.get_time().timestamp(), log_time * 1e-9)
        for topic in TELEMETRY
        for (came, sample), (log_time, _) in zip(heard[topic], wanted[topic])
    ]
    expect("as many messages as reported", int(messages) == len(times), f"{len(times)}")
    first, last = min(times), max(times)
    outside = (last[2] - first[2]) / (last[0] - first[0])
    expect("rate as reported, within 1e-3", abs(outside / float(rate) - 1) < 1e-3, f"{outside:.5f}, reported {rate}")
    expect_if(quiet, "the recorded speed is kept within 1e-3", abs(outside - 1) < 1e-3, f"{outside:.5f}")
    put = spread_ms(put - log_time for _, put, log_time in times)
    came = spread_ms(came - log_time for came, _, log_time in times)
    way = spread_ms(came - put for came, put, _ in times)
    for name, figures in (("by the report", reported), ("as put", put), ("as it came", came), ("on its way", way)):
        print(f"     late {name + ':':<15} p50 {figures[0]:.3f}, p99 {figures[1]:.3f}, max {figures[2]:.3f} ms")
    for name, outside, inside in zip(("p50", "p99"), put, reported):
        # The report has two digits.
        expect(f"{name} as put agrees within 0.1 ms and 2 %", abs(outside - inside) < 0.1 + 0.02 * inside)
    for name, limit_ms, outside, inside in zip(("p50", "p99"), (0.5, 1.0), came, reported):
        expect_if(quiet, f"{name} as it came agrees within {limit_ms} ms", abs(outside - inside) < limit_ms, f"{outside:.3f}, reported {inside:.3f} ms")
    for name, late_ms in (("by the report", reported[1]), ("as put", put[1])):
        expect_if(quiet, f"p99 {name} is at most 0.5 ms", late_ms <= 0.5, f"{late_ms:.3f} ms")


def first_messages(path):
    """However late a subscriber comes, the first message reaches it."""
    first = recorded(path)["angles"][0][1]
    got = 0
    for _ in range(STARTS):
        endpoint = free_endpoint()
        process = replay(path, endpoint, "--rate", "100", "--duration", "0.2", "--topics", "angles")
        time.sleep(random.uniform(0.0, 0.3))
        listener = Listener(endpoint, "flexcrank/ghost/angles")
        complaint = process.communicate()[1]
        # What was put may still be on its way into this process when the replayer has gone.
        deadline = time.monotonic() + 5.0
        while not listener.samples and time.monotonic() < deadline:
            time.sleep(0.005)
        listener.session.close()
        came = [sample.payload.to_bytes() for _, sample in listener.samples]
        arrived = process.returncode == 0 and came[:1] == [first]
        if not arrived:
            print(f"     exit code {process.returncode}, {len(came)} messages came: {complaint.strip()}")
        got += arrived
    expect("the first message arrives", got == STARTS, f"in {got} of {STARTS} starts")


def main():
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "take.mcap"
        run = ["run", "--pace", "max", "--until", str(SECONDS), "--publish-hz", "1000", "--record", str(path)]
        run += ["--set", "solver.step_s=1e-3"]
        run += ["--name", "heavy-replay", "--listen", free_endpoint()]
        subprocess.run([BINARY, *run], check=True, stderr=subprocess.DEVNULL)
        for _ in range(ROUNDS):
            faithful(path)
        first_messages(path)


if __name__ == "__main__":
    main()
