"""A Python client against the real program; every figure that is checked is printed."""

import contextlib
import hashlib
import math
import os
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections import defaultdict
from pathlib import Path

import zenoh
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.reader import make_reader
from mcap.records import Message
from mcap.stream_reader import StreamReader
from mcap_protobuf.decoder import DecoderFactory

BINARY = sys.argv[1]
TELEMETRY = ("displacements", "angles", "loads", "energies")
PATIENCE_S = 30.0


def expect(what, holds, figure=""):
    print(f"{'ok  ' if holds else 'FAIL'} {what} {figure}", flush=True)
    if not holds:
        sys.exit(1)


def spent_s():
    """CPU time that all programs have taken so far, and this one with those that it started, s."""
    fields = [int(field) for field in Path("/proc/stat").read_text().split("\n")[0].split()[1:]]
    idle = fields[3] + fields[4]
    return (sum(fields) - idle) / os.sysconf("SC_CLK_TCK"), sum(os.times()[:4])


class Machine:
    """What other programs take of it from now on: where they take much, figures of time say nothing, and are only printed."""

    def __init__(self):
        self.before, self.begun = spent_s(), time.monotonic()

    def is_quiet(self):
        """To be asked when everything that was started has ended: only then does it count as own.

        Where `FLEXCRANK_JUDGE_TIMES` is `no`, times are not judged at all: a few seconds say little of a 99th percentile.
        """
        (all_s, own_s), took_s = (now - then for now, then in zip(spent_s(), self.before)), time.monotonic() - self.begun
        others = (all_s - own_s) / took_s
        print(f"     everything else took {others:.2f} of a core meanwhile", flush=True)
        return others < 0.1 and os.environ.get("FLEXCRANK_JUDGE_TIMES") != "no"


def expect_if(quiet, what, holds, figure=""):
    """Where times are not judged, the figure is printed, and `tests/heavy/run` calls the trial measured."""
    if quiet:
        expect(what, holds, figure)
    else:
        print(f"     measured, not judged: {what}: {figure}", flush=True)


def expect_real_time(quiet, factor, within):
    """Where times are not judged, at least not far from it: what a stall of the machine has cost is caught up with."""
    off = abs(factor - 1)
    expect("real-time factor is 1 within 0.05", off < 0.05, f"{factor:.6f}")
    expect_if(quiet, f"real-time factor is 1 within {within:g}", off < within, f"{factor:.6f}")


def free_endpoint():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"


def wait_for(condition, what):
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        if time.monotonic() > deadline:
            expect(what, False, "(timed out)")
        time.sleep(0.01)


class Client:
    """A subscriber to everything a service says, decoding by the schema that the service itself serves."""

    def __init__(self, endpoint, name):
        config = zenoh.Config()
        config.insert_json5("scouting/multicast/enabled", "false")
        config.insert_json5("listen/endpoints", "[]")
        config.insert_json5("connect/endpoints", f'["{endpoint}"]')
        config.insert_json5("connect/retry", '{"period_init_ms": 20, "period_max_ms": 100}')
        self.session = zenoh.open(config)
        self.endpoint = endpoint
        self.root = f"flexcrank/{name}"
        self.payloads = defaultdict(list)
        self.encodings = {}
        self.lock = threading.Lock()
        self.subscriber = self.session.declare_subscriber(f"{self.root}/*", self.take)

    def take(self, sample):
        with self.lock:
            topic = str(sample.key_expr).rsplit("/", 1)[1]
            self.payloads[topic].append(sample.payload.to_bytes())
            self.encodings[topic] = str(sample.encoding)

    def ask(self, key, payload=None, patience_s=3.0):
        for reply in self.session.get(f"{self.root}/{key}", payload=payload, timeout=patience_s):
            if reply.ok is not None:
                return reply.ok.payload.to_bytes()
        return None

    def learn(self):
        answer = []
        wait_for(lambda: (answer.append(self.ask("schema", patience_s=0.5)), answer[-1])[1], "schema is served")
        pool = descriptor_pool.DescriptorPool()
        for file in descriptor_pb2.FileDescriptorSet.FromString(answer[-1]).file:
            pool.Add(file)
        self.type = lambda name: message_factory.GetMessageClass(pool.FindMessageTypeByName(f"flexcrank.v1.{name}"))

    def newest(self, topic):
        with self.lock:
            payloads = self.payloads[topic]
            return self.type(topic.capitalize()).FromString(payloads[-1]) if payloads else None

    def command(self, key, message):
        answer = self.ask(key, message.SerializeToString() if not isinstance(message, bytes) else message)
        expect(f"{key} is answered", answer is not None)
        return self.type("CommandReply").FromString(answer)


@contextlib.contextmanager
def service(arguments, name, client=Client):
    endpoint = free_endpoint()
    process = subprocess.Popen([BINARY, *arguments, "--name", name, "--listen", endpoint])
    client = client(endpoint, name)
    try:
        yield process, client
    finally:
        client.session.close()
        if process.poll() is None:
            process.kill()
        process.wait()


def digests(payloads):
    return {topic: hashlib.sha256(b"".join(payloads[topic])).hexdigest() for topic in TELEMETRY}


def recorded(path):
    topics = defaultdict(list)
    with open(path, "rb") as file:
        for _, channel, message, decoded in make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages():
            topics[channel.topic.rsplit("/", 1)[1]].append((message, decoded))
    return topics


def live(folder):
    """Run, push, look: over the bus and in the recording."""
    path, name, step_s = folder / "live.mcap", "interop", 5e-4
    arguments = ["run", "--publish-hz", "all", "--record", str(path), "--set", f"solver.step_s={step_s}", "--set", "solver.model=rigid"]
    arguments += ["--set", "solver.integrator=runge-kutta"]
    with service(arguments, name) as (process, client):
        client.learn()
        wait_for(lambda: client.newest("angles") and client.newest("status"), "telemetry arrives")
        expect("encoding names the type", client.encodings["loads"] == "application/protobuf;flexcrank.v1.Loads")
        wait_for(lambda: client.newest("angles").stamp.sim_time_s >= 1.0, "t = 1 s")
        pulse = client.type("TorquePulse")
        reply = client.command("torque", pulse(id="short", torque_nm=5.0, duration_s=0.37 * step_s))
        expect("a pulse of 0.37 steps is accepted", reply.accepted, f"step {reply.effective_step}")
        again = client.command("torque", pulse(id="short", torque_nm=5.0, duration_s=0.37 * step_s))
        expect("a retry is acknowledged", again.accepted and again.effective_step == reply.effective_step, again.reason)
        long = client.command("torque", pulse(id="long", torque_nm=5.0, duration_s=0.1))
        expect("a pulse of 0.1 s is accepted", long.accepted, f"step {long.effective_step}")
        over = long.effective_step + math.ceil(0.1 / step_s) + 2
        wait_for(lambda: client.newest("angles").stamp.step > over, "the long pulse ends")
        before = client.newest("status").commands_accepted
        put = pulse(id="put", torque_nm=-3.0, duration_s=0.1, shape=1)
        client.session.put(f"{client.root}/torque", put.SerializeToString())
        wait_for(lambda: client.newest("status").commands_accepted > before, "a put pulse takes effect")
        refusals(client, pulse)
        snapshot = client.type("Snapshot").FromString(client.ask("snapshot"))
        expect("snapshot has everything", snapshot.HasField("loads") and snapshot.HasField("energies") and snapshot.HasField("status"))
        expect("scene is served", b"[crank]" in client.ask("scene"))
        wait_for(lambda: client.newest("status").pulses_pending == 0, "pulses end")
        stop = client.type("Control")(id="stop")
        stop.stop.SetInParent()
        expect("stop is accepted", client.command("control", stop).accepted)
        expect("exit code 0", process.wait(PATIENCE_S) == 0)
        received = client.payloads
    topics = recorded(path)
    for topic in TELEMETRY:
        kept = [message.data for message, _ in topics[topic]]
        tail = kept[len(kept) - len(received[topic]):]
        expect(f"{topic}: recording equals what was received", tail == received[topic], f"{len(tail)} of {len(kept)} messages")
    loads = [decoded for _, decoded in topics["loads"]]
    angles = [decoded for _, decoded in topics["angles"]]
    impulse = sum(
        now.driving_torque_nm * (now.stamp.sim_time_s - before.stamp.sim_time_s) for before, now in zip(loads, loads[1:])
    )
    exact = 20.0 * 0.1 + 5.0 * 0.37 * step_s + 5.0 * 0.1 - 3.0 * 0.1
    expect("driving torque integrates to the impulses", abs(impulse / exact - 1) < 1e-12, f"{impulse / exact - 1:.1e}")
    felt = next(load for load in loads if load.stamp.step >= reply.effective_step)
    expect("the pulse begins in the step replied", felt.stamp.step == reply.effective_step and felt.driving_torque_nm != 0.0)
    for what, answer, duration_s in (("short", reply, 0.37 * step_s), ("long", long, 0.1)):
        first = answer.effective_step - 1
        last = first + math.ceil(duration_s / step_s) + 1
        states = [decoded for _, decoded in topics["displacements"]]
        gained = kinetic_j(states[last]) - kinetic_j(states[first])
        work = sum(
            loads[n].driving_torque_nm * (angles[n].links[0].chord_rad - angles[n - 1].links[0].chord_rad)
            for n in range(first + 1, last + 1)
        )
        if duration_s < step_s:
            # It acts on a part of the step's travel only: mean torque times travel is not quite its work.
            spread, works = work, [decoded.work_in_j for _, decoded in topics["energies"]]
            work = works[last] - works[first]
            expect("the short pulse's work is nearly its mean torque times the travel", abs(work - spread) < 1e-3 * abs(work), f"{work:.6f} {spread:.6f} J")
        error = (gained - work) / work
        expect(f"kinetic energy gains the work of the {what} pulse, within 1e-9 of it", abs(error) < 1e-9, f"{error:.1e} of {work:.6f} J")
    commands = [decoded.reply.id for _, decoded in topics["commands"]]
    expect("applied commands are recorded once", commands == ["short", "long", "put", "stop"], str(commands))
    return path


def kinetic_j(state):
    """Of the default scene's uniform bars and slider, from the velocities of their ends: m (a·a + a·b + b·b)/6."""
    ends = {}
    for node in state.nodes:
        ends.setdefault(node.link, []).append((node.vx_m_per_s, node.vy_m_per_s))
    dot = lambda a, b: a[0] * b[0] + a[1] * b[1]
    bar = lambda mass, a, b: mass * (dot(a, a) + dot(a, b) + dot(b, b)) / 6
    crank = bar(7700 * 1e-4 * 0.5, ends["crank"][0], ends["crank"][-1])
    rod = bar(7700 * 1e-4 * 1.5, ends["rod"][0], ends["rod"][-1])
    return crank + rod + 0.5 * 0.2 * dot(ends["rod"][-1], ends["rod"][-1])


def refusals(client, pulse):
    """What is refused is refused with a reason, counted, and harms nothing."""
    before = client.newest("status").commands_rejected
    bad = {
        "garbage": b"\xff\xff\xff",
        "NaN": pulse(torque_nm=math.nan, duration_s=0.1),
        "no duration": pulse(torque_nm=1.0),
        "two hours": pulse(torque_nm=1.0, duration_s=7200.0),
        "over the limit": pulse(torque_nm=1e5, duration_s=0.1),
        "endless delay": pulse(torque_nm=1.0, duration_s=0.1, delay_s=math.inf),
    }
    for what, message in bad.items():
        reply = client.command("torque", message)
        expect(f"{what} is refused", not reply.accepted and reply.reason, reply.reason)
    route = client.type("Control")(id="route")
    route.start_recording.name = "../escape"
    reply = client.command("control", route)
    expect("a route is no recording name", not reply.accepted, reply.reason)
    wait_for(lambda: client.newest("status").commands_rejected >= before + len(bad), "refusals are counted")


def replayed(path):
    """The recorded bytes come back, in order, under another name."""
    wanted = digests({topic: [message.data for message, _ in rows] for topic, rows in recorded(path).items()})
    with service(["replay", str(path), "--wait-for", "1", "--rate", "2"], "ghost") as (process, client):
        expect("replay exits with 0", process.wait(PATIENCE_S) == 0)
        expect("replayed payloads are identical", digests(client.payloads) == wanted, wanted["loads"][:12])
        status = client.payloads["status"]
    expect("replayer has a status of its own", len(status) > 0 and b"replaying live.mcap" in status[0])


def killed(folder):
    """What a killed run leaves is readable up to the last flush."""
    path = folder / "killed.mcap"
    with service(["run", "--record", str(path)], "victim") as (process, client):
        client.learn()
        wait_for(lambda: client.newest("angles") and client.newest("angles").stamp.sim_time_s > 2.0, "t = 2 s")
        process.send_signal(signal.SIGKILL)
        process.wait()
        end_s = client.newest("angles").stamp.sim_time_s
        kept = 0.0
        try:
            start = None
            for record in StreamReader(open(path, "rb")).records:
                if isinstance(record, Message):
                    start = start or record.log_time
                    kept = (record.log_time - start) * 1e-9
        except Exception as cut:  # the file ends where the program died
            print(f"     stream ends: {type(cut).__name__}")
    expect("at most a second is lost to kill -9", end_s - kept < 1.0, f"{end_s - kept:.3f} s lost")


def regress_an_error_ends_the_subscriber(listing):
    """The README's Python listing with an error while it listens: a session that stays open blocks the exit of Python."""
    failing = listing.replace("time.sleep(5)", "time.sleep(0.5); raise ValueError('mine')")
    ended = subprocess.run([sys.executable, "-c", failing], capture_output=True, text=True, timeout=PATIENCE_S)
    says = ended.returncode == 1 and ended.stderr.endswith("ValueError: mine\n")
    expect("an error ends the README's subscriber", says, ended.stderr.strip())


def readme(folder):
    """A service found with no options at all, and the README's Python listing as printed."""
    listing = Path("README.md").read_text().split("```python\n")[1].split("```")[0]
    expect("the README's subscriber has at most 15 lines", len(listing.strip().splitlines()) <= 15)
    begun = time.monotonic()
    lonely = subprocess.run([BINARY, "pulse", "crank", "--torque", "5", "--duration", "0.1"], capture_output=True, text=True)
    waited_s = time.monotonic() - begun
    says = lonely.returncode == 1 and "flexcrank run" in lonely.stderr and waited_s < 3.0
    expect("without a service, a client says so within 3 s, with the fix", says, f"{waited_s:.2f} s: {lonely.stderr.strip()}")
    lonely = subprocess.run([sys.executable, "-c", listing, "tcp/127.0.0.1:9"], capture_output=True, text=True)
    refusal = lonely.stderr.strip().splitlines()[-1]
    says = lonely.returncode == 1 and refusal.startswith("zenoh.ZError: Unable to connect to any of [Single(tcp/127.0.0.1:9)]")
    expect("without a service, the README's subscriber says so", says, refusal)
    process = subprocess.Popen([BINARY, "run", "--no-record"], cwd=folder)
    try:
        ask = lambda *words: subprocess.run([BINARY, *words], capture_output=True, text=True)
        wait_for(lambda: "crank" in ask("list").stdout.split(), "the service is found")
        pulse = ask("pulse", "crank", "--torque", "5", "--duration", "0.1")
        expect("pulse with no options", pulse.returncode == 0 and "takes effect in step" in pulse.stdout, pulse.stdout.strip())
        printed = subprocess.run([sys.executable, "-c", listing], capture_output=True, text=True, timeout=PATIENCE_S)
        angles = [float(line) for line in printed.stdout.split()]
        expect("the README's subscriber runs", len(angles) > 500, f"{len(angles)} angles, last {angles[-1:]}")
        regress_an_error_ends_the_subscriber(listing)
        process.send_signal(signal.SIGINT)
        expect("Ctrl-C ends cleanly", process.wait(PATIENCE_S) == 0)
    finally:
        process.kill()
        process.wait()


def main():
    with tempfile.TemporaryDirectory() as folder:
        path = live(Path(folder))
        replayed(path)
        killed(Path(folder))
        readme(Path(folder))
    print("interoperability: all holds")


if __name__ == "__main__":
    main()
