"""A viewer against the real program: payloads and times as on the bus and in the recording, commands, parameters, timeline."""

import hashlib
import signal
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from google.protobuf import descriptor_pb2
from mcap.reader import make_reader

from check import BINARY, PATIENCE_S, Client, expect, free_endpoint, service, wait_for
from viewer import ENDED, PAUSED, PLAYING, Viewer

SECONDS = 3.0
TELEMETRY = ("displacements", "angles", "loads", "energies", "scene_updates")
CONTROL = "--foxglove-control"


class Numbered(Client):
    """Keeps the numbers that messages carry, too."""

    def __init__(self, *arguments):
        self.numbers = {}
        super().__init__(*arguments)

    def take(self, sample):
        super().take(sample)
        if sample.attachment is not None:
            topic = str(sample.key_expr).rsplit("/", 1)[1]
            self.numbers.setdefault(topic, []).append(struct.unpack("<Q", sample.attachment.to_bytes())[0])

    def missed(self, topic):
        numbers = self.numbers[topic]
        return numbers[-1] - numbers[0] + 1 - len(numbers)


def free_port():
    return int(free_endpoint().rsplit(":", 1)[1])


def recorded(path):
    """Log time and payload of every message, by topic."""
    topics = {}
    with open(path, "rb") as file:
        for _, channel, message in make_reader(file).iter_messages():
            topics.setdefault(channel.topic, []).append((message.log_time, message.data))
    return topics


def digest(payloads):
    return hashlib.sha256(b"".join(payloads)).hexdigest()


def overlap(longer, part):
    """The stretch of a list that begins with another's first item and is as long."""
    begin = longer.index(part[0])
    return longer[begin:begin + len(part)]


def shown(port, root, wanted=lambda topic: True):
    viewer = Viewer(port, wanted)
    wait_for(lambda: viewer.info and viewer.services, "the server introduces itself")
    return viewer


def equal_to_bus_and_recording(folder, seconds):
    path, port, name = folder / "shown.mcap", free_port(), "shown"
    root = f"flexcrank/{name}"
    options = ["run", "--publish-hz", "all", "--record", str(path), f"--foxglove=127.0.0.1:{port}", CONTROL]
    with service([*options, "--set", "solver.step_s=1e-3"], name, client=Numbered) as (process, client):
        client.learn()
        wait_for(lambda: client.newest("status"), "the service runs")
        viewer = shown(port, root)
        offered = {channel["topic"] for channel in viewer.channels.values()}
        expect("every topic of the bus is offered", {f"{root}/{topic}" for topic in (*TELEMETRY, "status", "commands", "gaps")} <= offered)
        encoding, name_, kind, schema = viewer.schema(f"{root}/angles")
        files = descriptor_pb2.FileDescriptorSet.FromString(schema).file
        expect("with its protobuf schema", (encoding, name_, kind) == ("protobuf", "flexcrank.v1.Angles", "protobuf") and len(files) > 0)
        wait_for(lambda: viewer.of(f"{root}/angles"), "telemetry arrives")
        acts(viewer, client, root)
        time.sleep(seconds)
        parameters(viewer, root)
        status_log(viewer, client, root)
        port_in_use(port)
        got = {topic: viewer.of(f"{root}/{topic}") for topic in (*TELEMETRY, "status", "commands")}
        viewer.close()
        stop(client)
        expect("the run ends with 0", process.wait(PATIENCE_S) == 0)
        bus = client.payloads
    topics = recorded(path)
    for topic, messages in got.items():
        payloads = [payload for _, payload in messages]
        in_file = overlap(topics[f"{root}/{topic}"], messages)
        sums = {digest(payloads), digest(payload for _, payload in in_file)}
        expect(f"{topic}: SHA-256 as in the recording", len(sums) == 1, f"{min(sums)[:12]}, {len(payloads)} messages")
        expect(f"{topic}: log times as in the recording", in_file == messages)
        # On a busy machine the bus drops messages for a slow subscriber, and its numbers show that.
        missed, received = client.missed(topic), set(bus[topic])
        common = [payload for payload in payloads if payload in received]
        on_bus = overlap(bus[topic], common)
        figure = f"{len(common)} messages, {missed} missed on the bus"
        expect(f"{topic}: SHA-256 as on the bus", digest(common) == digest(on_bus) and len(payloads) - len(common) <= missed, figure)
    receipts = [payload for _, payload in topics[f"{root}/commands"]]
    expect("pulses of viewers are recorded", all(any(id in payload for payload in receipts) for id in (b"by-service", b"by-topic", b"by-json")))


def stop(client):
    command = client.type("Control")(id="stop")
    command.stop.SetInParent()
    expect("stop is accepted", client.command("control", command).accepted)


def acts(viewer, client, root):
    """Pulses, setpoints and control commands of viewers take effect."""
    answers = {
        "torque": {"id": "by-service", "torque_nm": 5, "duration_s": 0.1},
        "setpoint": {"torque_nm": 1.5, "hold_s": 0.2},
        "control": {"action": "pause"},
    }
    for key, request in answers.items():
        call = viewer.call(f"{root}/{key}", request)
        wait_for(lambda: call in viewer.replies, f"{key} is answered")
        done, reply = viewer.replies[call]
        expect(f"service {key} acts", done and reply["accepted"] and reply["effective_step"] > 0, f"step {done and reply['effective_step']}")
    call = viewer.call(f"{root}/control", {"action": "resume"})
    wait_for(lambda: call in viewer.replies, "resume is answered")
    pulse = client.type("TorquePulse")
    viewer.advertise(1, f"{root}/torque", "flexcrank.v1.TorquePulse", "protobuf")
    viewer.publish(1, pulse(id="by-topic", torque_nm=-2.0, duration_s=0.05).SerializeToString())
    viewer.advertise(2, f"/{root}/torque", "flexcrank.v1.TorquePulse", "json")
    viewer.publish(2, b'{"id": "by-json", "torque_nm": -2, "duration_s": 0.05}')
    wait_for(lambda: sum(b"by-" in payload for _, payload in viewer.of(f"{root}/commands")) == 3, "published pulses take effect")
    bad = {
        "a pulse over the limit": {"torque_nm": 1e9, "duration_s": 0.1},
        "a pulse without duration": {"torque_nm": 1},
        "no JSON": b"\xff\xfe",
    }
    for what, request in bad.items():
        call = viewer.call(f"{root}/torque", request)
        wait_for(lambda: call in viewer.replies, f"{what} is answered")
        done, reply = viewer.replies[call]
        expect(f"{what} is refused", not done or not reply["accepted"], reply["reason"] if done else reply)
    seen = len(viewer.statuses)
    viewer.publish(1, b"\xff\xff\xff")
    wait_for(lambda: len(viewer.statuses) > seen, "garbage is refused")
    expect("garbage is refused with the key", f"{root}/torque" in viewer.statuses[-1], viewer.statuses[-1])
    viewer.advertise(3, "/else/where", "flexcrank.v1.TorquePulse", "protobuf")
    wait_for(lambda: any("else/where" in status for status in viewer.statuses), "other topics are refused")


def parameters(viewer, root):
    viewer.get([], "all")
    wait_for(lambda: viewer.parameters("all"), "parameters are answered")
    every = viewer.parameters("all")
    expect("the scene's keys are parameters", every[f"{root}/slider.mass_kg"] > 0 and every[f"{root}/solver.step_s"] == 1e-3, f"{len(every)} keys")
    viewer.send({"op": "subscribeParameterUpdates", "parameterNames": [f"{root}/slider.mass_kg"]})
    viewer.set([{"name": f"{root}/slider.mass_kg", "value": 0.3, "type": "float64"}], "heavier")
    wait_for(lambda: viewer.parameters("heavier"), "a change is answered")
    expect("a mass is changed while running", viewer.parameters("heavier") == {f"{root}/slider.mass_kg": 0.3})
    updates = lambda: [message for message in viewer.values if "id" not in message]
    wait_for(lambda: updates() and updates()[-1]["parameters"][0]["value"] == 0.3, "subscribers learn of it")
    before = len(viewer.statuses)
    viewer.set([{"name": f"{root}/rod.length_m", "value": 9.0}], "longer")
    wait_for(lambda: viewer.parameters("longer"), "a refused change is answered")
    expect("a length is refused and stays", viewer.parameters("longer")[f"{root}/rod.length_m"] == every[f"{root}/rod.length_m"])
    wait_for(lambda: len(viewer.statuses) > before, "with the reason")
    expect("the reason is the service's", "keeps its geometry" in viewer.statuses[-1], viewer.statuses[-1])
    viewer.set([{"name": "nobody/else", "value": 1}], "unknown")
    wait_for(lambda: any("nobody/else" in status for status in viewer.statuses), "an unknown parameter is refused")


def status_log(viewer, client, root):
    lines = lambda: b"\n".join(payload for _, payload in viewer.of(f"{root}/log"))
    wait_for(lambda: b"paused" in lines() and b"running" in lines(), "changes of the status are logged")
    expect("the log is foxglove.Log", viewer.schema(f"{root}/log")[1] == "foxglove.Log")


def port_in_use(port):
    other = subprocess.run([BINARY, "run", "--no-record", "--no-bus", f"--foxglove=127.0.0.1:{port}"], capture_output=True, text=True)
    named = other.returncode == 1 and f"127.0.0.1:{port}" in other.stderr and "--foxglove=" in other.stderr
    expect("a port in use is refused with the remedy", named, other.stderr.strip())


def refused(folder):
    """Without --foxglove-control, every command is refused by name, and nothing takes effect."""
    port, name = free_port(), "guarded"
    root = f"flexcrank/{name}"
    with service(["run", "--no-record", f"--foxglove=127.0.0.1:{port}"], name) as (_, client):
        client.learn()
        wait_for(lambda: client.newest("status"), "the service runs")
        viewer = shown(port, root)
        for key in ("torque", "setpoint", "control"):
            call = viewer.call(f"{root}/{key}", {})
            wait_for(lambda: call in viewer.replies, f"{key} is answered")
            done, why = viewer.replies[call]
            expect(f"service {key} is refused by name", not done and f"{root}/{key}" in why and CONTROL in why, why)
        viewer.advertise(1, f"{root}/torque", "flexcrank.v1.TorquePulse", "protobuf")
        viewer.publish(1, client.type("TorquePulse")(torque_nm=5.0, duration_s=0.1).SerializeToString())
        wait_for(lambda: len(viewer.statuses) >= 2, "a published pulse is refused")
        expect("published pulses are refused by name", all(f"{root}/torque" in why and CONTROL in why for why in viewer.statuses))
        viewer.get([], "all")
        wait_for(lambda: viewer.parameters("all"), "parameters are readable")
        viewer.set([{"name": f"{root}/slider.mass_kg", "value": 0.3}], "set")
        wait_for(lambda: viewer.parameters("set"), "a change is answered")
        why = viewer.statuses[-1]
        expect("parameters are refused by name", "slider.mass_kg" in why and CONTROL in why, why)
        expect("and keep their values", viewer.parameters("set")[f"{root}/slider.mass_kg"] == viewer.parameters("all")[f"{root}/slider.mass_kg"])
        status = client.newest("status")
        expect("no command took effect", status.commands_accepted == 0 and not client.payloads["commands"])
        viewer.close()


def timeline(folder):
    """A replay obeys seek, pause and rate of the viewer's timeline, and stays at its end."""
    path, port, name = folder / "shown.mcap", free_port(), "again"
    root = f"flexcrank/{name}"
    angles = recorded(path)["flexcrank/shown/angles"]
    options = ["replay", str(path), "--start-paused", f"--foxglove=127.0.0.1:{port}"]
    with service(options, name) as (process, client):
        wait_for(lambda: listening(port), "the server listens")
        viewer = shown(port, root, lambda topic: topic.endswith("/angles") or topic.endswith("/status"))
        first, last = (viewer.info[end]["sec"] * 10**9 + viewer.info[end]["nsec"] for end in ("dataStartTime", "dataEndTime"))
        expect("the server states the span of the recording", first <= angles[0][0] and angles[-1][0] <= last, f"{(last - first) * 1e-9:.3f} s")
        expect("and can be controlled", "playbackControl" in viewer.info["capabilities"])
        time_of = lambda part: angles[int(part * len(angles))][0]
        answered = lambda id: [state for state in viewer.playback if state[4] == id]
        got = lambda: viewer.of(f"{root}/angles")
        target = time_of(0.5)
        viewer.control(1, 1.0, target, "seek")
        wait_for(lambda: answered("seek"), "a seek is answered")
        expect("a seek is confirmed", answered("seek")[0][:4] == (PAUSED, target, 1.0, True), str(answered("seek")[0]))
        viewer.control(0, 0.5, None, "slow")
        wait_for(lambda: len(got()) > 50, "the replay plays on from there")
        expect("from the message that was sought", got()[0] == next(message for message in angles if message[0] >= target))
        begun, then = time.monotonic(), got()[-1][0]
        wait_for(lambda: time.monotonic() - begun > 0.5, "half a second passes")
        rate = (got()[-1][0] - then) * 1e-9 / (time.monotonic() - begun)
        expect("half the rate is obeyed", 0.3 < rate < 0.7, f"{rate:.3f}")
        viewer.control(1, 0.5, None, "pause")
        wait_for(lambda: answered("pause"), "a pause is answered")
        seen = len(viewer.of(f"{root}/status"))
        wait_for(lambda: len(viewer.of(f"{root}/status")) > seen, "a status after the pause")
        count, seen = len(got()), len(viewer.of(f"{root}/status"))
        wait_for(lambda: len(viewer.of(f"{root}/status")) > seen, "another status")
        expect("a pause is obeyed", len(got()) == count, f"{count} messages")
        wait_for(lambda: viewer.clock, "the server's clock")
        expect("the clock shows recorded time", first <= viewer.clock <= last < time.time_ns(), f"{(viewer.clock - first) * 1e-9:.3f} s")
        back = time_of(0.1)
        viewer.control(0, 100.0, back, "back")
        wait_for(lambda: any(state[0] == ENDED for state in viewer.playback), "the end is reached and told")
        rest = [message for message in angles if message[0] >= back]
        wait_for(lambda: len(got()) == count + len(rest), "everything from there has been played")
        expect("payloads and times after a seek are the recorded ones", got()[count:] == rest, f"{len(rest)} messages")
        expect("the replay stays at its end", process.poll() is None)
        viewer.control(0, 100.0, time_of(0.9), "again")
        wait_for(lambda: len(got()) > count + len(rest), "and can be moved back")
        viewer.close()
        process.send_signal(signal.SIGINT)
        expect("and ends when asked to", process.wait(PATIENCE_S) == 0)


def listening(port):
    try:
        Viewer(port, lambda topic: False).close()
        return True
    except OSError:
        return False


def main(seconds):
    with tempfile.TemporaryDirectory() as folder:
        equal_to_bus_and_recording(Path(folder), seconds)
        refused(Path(folder))
        timeline(Path(folder))
    print("foxglove: all holds")


if __name__ == "__main__":
    main(float(sys.argv[2]) if len(sys.argv) > 2 else SECONDS)
