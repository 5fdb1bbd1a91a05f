"""Three hosts made of network namespaces: a service, a router, a client. Every figure that is checked is printed."""

import contextlib
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from check import BINARY, PATIENCE_S, Machine, expect, expect_real_time, wait_for

CUT_S = float(sys.argv[2])
TAG = f"fx{os.getpid() % 100000}"
SERVICE, ROUTER, CLIENT = (f"{TAG}-{who}" for who in ("service", "router", "client"))
TO_SERVICE, TO_CLIENT = "tcp/10.77.1.1:7447", "tcp/10.77.2.1:7447"

ROUTER_SESSION = f"""
import time, zenoh
config = zenoh.Config()
config.insert_json5("mode", '"router"')
config.insert_json5("scouting/multicast/enabled", "false")
config.insert_json5("listen/endpoints", '["{TO_SERVICE}", "{TO_CLIENT}"]')
session = zenoh.open(config)
while True:
    time.sleep(1)
"""

LISTENER = f"""
import sys, time, zenoh
config = zenoh.Config()
config.insert_json5("mode", '"client"')
config.insert_json5("scouting/multicast/enabled", "false")
config.insert_json5("connect/endpoints", '["{TO_CLIENT}"]')
session = zenoh.open(config)
subscriber = session.declare_subscriber("flexcrank/far/angles", lambda sample: print(time.monotonic(), flush=True))
while True:
    time.sleep(1)
"""


def ip(*words):
    subprocess.run(["ip", *words], check=True)


def link(host, number):
    """A cable between a host and the router, 10.77.NUMBER.2 at the host's end and .1 at the router's."""
    here, there = f"{TAG}h{number}", f"{TAG}r{number}"
    ip("link", "add", here, "netns", host, "type", "veth", "peer", "name", there, "netns", ROUTER)
    for end, namespace, last in ((here, host, 2), (there, ROUTER, 1)):
        ip("-n", namespace, "addr", "add", f"10.77.{number}.{last}/24", "dev", end)
        ip("-n", namespace, "link", "set", end, "up")
    return there


@contextlib.contextmanager
def hosts():
    try:
        for namespace in (SERVICE, ROUTER, CLIENT):
            ip("netns", "add", namespace)
            ip("-n", namespace, "link", "set", "lo", "up")
        yield link(SERVICE, 1), link(CLIENT, 2)
    finally:
        for namespace in (SERVICE, ROUTER, CLIENT):
            subprocess.run(["ip", "netns", "delete", namespace], stderr=subprocess.DEVNULL)


@contextlib.contextmanager
def on(host, *command, **options):
    process = subprocess.Popen(["ip", "netns", "exec", host, *map(str, command)], **options)
    try:
        yield process
    finally:
        if process.poll() is None:
            process.kill()
        process.wait()


def ask(host, *command, patience_s=PATIENCE_S):
    begun = time.monotonic()
    done = subprocess.run(["ip", "netns", "exec", host, *map(str, command)], capture_output=True, text=True, timeout=patience_s)
    return done, time.monotonic() - begun


def router():
    zenohd = shutil.which("zenohd")
    if zenohd:
        print(f"     router: {zenohd}")
        return on(ROUTER, zenohd, "--no-multicast-scouting", "-l", TO_SERVICE, "-l", TO_CLIENT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    print("     router: a zenoh session in router mode (Python); no zenohd here")
    return on(ROUTER, sys.executable, "-c", ROUTER_SESSION)


def arrivals(path):
    return [float(line) for line in Path(path).read_text().split("\n")[:-1]]


def deployment(folder, service_cable):
    recording, heard = folder / "far.mcap", folder / "heard"
    run = [BINARY, "run", "--name", "far", "--connect", TO_SERVICE, "--record", recording]
    client = ["--connect", TO_CLIENT]
    with contextlib.ExitStack() as stack:
        routing = contextlib.ExitStack()
        stack.push(routing)
        routing.enter_context(router())
        service = stack.enter_context(on(SERVICE, *run))
        wait_for(lambda: "far" in ask(CLIENT, BINARY, "list", *client)[0].stdout.split(), "the service is seen through the router")
        expect("the client sees the service through the router", True)
        stack.enter_context(on(CLIENT, sys.executable, "-c", LISTENER, stdout=open(heard, "w")))
        wait_for(lambda: len(arrivals(heard)) > 200, "telemetry crosses the router")
        expect("telemetry crosses the router", True, f"{len(arrivals(heard))} angles")
        pulse, took_s = ask(CLIENT, BINARY, "pulse", "far", "--torque", "5", "--duration", "0.1", "--id", "through", *client)
        expect("a pulse crosses the router", pulse.returncode == 0 and "accepted" in pulse.stdout, f"{took_s:.2f} s: {pulse.stdout.strip()}")
        second, _ = ask(CLIENT, BINARY, "run", "--name", "far", "--until", "1", "--no-record", *client)
        refused = second.returncode == 1 and "running already" in second.stderr and "--force" in second.stderr
        expect("a second service of the name is refused", refused, second.stderr.strip().splitlines()[-1:])
        forced, _ = ask(CLIENT, BINARY, "run", "--name", "far", "--until", "1", "--no-record", "--force", *client)
        expect("with --force it runs", forced.returncode == 0)
        cut(heard, service, lambda up: ip("-n", ROUTER, "link", "set", service_cable, "up" if up else "down"), "the cable")
        def swap(up):
            routing.enter_context(router()) if up else routing.close()
        cut(heard, service, swap, "the router")
        stop, took_s = ask(CLIENT, BINARY, "control", "far", "stop", *client)
        expect("the service is stopped from afar", stop.returncode == 0, f"{took_s:.2f} s: {stop.stdout.strip()} {stop.stderr.strip()}")
        expect("and ends well", service.wait(PATIENCE_S) == 0)
    return recording


def cut(heard, service, connect, what):
    """Takes something away for a while; telemetry resumes by itself."""
    connect(False)
    begun = time.monotonic()
    time.sleep(CUT_S)
    last = max(arrivals(heard))
    expect(f"without {what} nothing arrives", last - begun < 1.0, f"for {time.monotonic() - last:.1f} s")
    expect("the service goes on", service.poll() is None)
    connect(True)
    restored = time.monotonic()
    wait_for(lambda: len([at for at in arrivals(heard) if at > restored]) > 200, f"telemetry resumes after {what} was away")
    first = min(at for at in arrivals(heard) if at > restored)
    expect(f"telemetry resumes by itself when {what} is back", True, f"after {first - restored:.1f} s")


def whole(recording, quiet):
    """Neither simulation nor recording has noticed anything."""
    verified = subprocess.run([BINARY, "verify", str(recording)], capture_output=True, text=True)
    expect("verify finds the recording whole and equal to the bit", verified.returncode == 0, verified.stdout.strip().splitlines()[-1:])
    status, commands = [], []
    with open(recording, "rb") as file:
        for _, channel, _, decoded in make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages():
            status += [decoded] if channel.topic.endswith("/status") else []
            commands += [decoded.reply.id] if channel.topic.endswith("/commands") else []
    last = status[-1]
    wall = lambda one: one.stamp.wall_time.seconds + one.stamp.wall_time.nanos * 1e-9
    pace = (last.stamp.sim_time_s - status[1].stamp.sim_time_s) / (wall(last) - wall(status[1]))
    expect_real_time(quiet, pace, 2e-3)
    expect("nothing was dropped", last.dropped_samples == 0, f"over {last.stamp.sim_time_s:.1f} s")
    expect("the pulse is recorded once", commands.count("through") == 1, str(commands))


def main():
    machine = Machine()
    with tempfile.TemporaryDirectory() as folder, hosts() as (service_cable, _):
        recording = deployment(Path(folder), service_cable)
        whole(recording, machine.is_quiet())


if __name__ == "__main__":
    main()
