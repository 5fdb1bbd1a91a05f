"""A service seen from ROS 2: an independent implementation of rmw_zenoh's conventions behind a router, and `rosbags`.

The SDK would fetch message definitions from the internet; here it gets the types and hashes of ROS 2 Jazzy from `rosbags`.
"""

import json
import os
import signal
import struct
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from pathlib import Path

import numpy
import zenoh
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore
from zenoh_ros2_sdk import ROS2Publisher, ROS2ServiceClient, ROS2Subscriber
from zenoh_ros2_sdk.discovery import get_service_names_and_types, get_topic_info, get_topic_names_and_types
from zenoh_ros2_sdk.session import ZenohSession

from check import BINARY, PATIENCE_S, expect, free_endpoint, recorded, wait_for

DOMAIN = 7
SECONDS = 10
STORE = get_typestore(Stores.ROS2_JAZZY)
PUBLISHED = {
    "/clock": "rosgraph_msgs/msg/Clock",
    "/tf": "tf2_msgs/msg/TFMessage",
    "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
    "/crank_1/joint_states": "sensor_msgs/msg/JointState",
    "/crank_1/markers": "visualization_msgs/msg/MarkerArray",
    "/crank_1/joints/pivot": "geometry_msgs/msg/WrenchStamped",
    "/crank_1/joints/crank_pin": "geometry_msgs/msg/WrenchStamped",
    "/crank_1/joints/slider_pin": "geometry_msgs/msg/WrenchStamped",
}
TORQUE = "/crank_1/torque"
SERVICES = {"pause": "SetBool", "reset": "Trigger", "step": "Trigger"}
# rosidl hashes `char` as uint8, and rosbags does not. A test in Rust compares the published hash of a service that contains this.
OF_CHARS = "service_msgs/msg/ServiceEventInfo"
RESPONSE = "bool success\nstring message\n"


def router():
    """A router as ROS has one; its endpoint."""
    endpoint = free_endpoint()
    config = zenoh.Config()
    config.insert_json5("mode", '"router"')
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("listen/endpoints", f'["{endpoint}"]')
    return zenoh.open(config), endpoint


def sdk(endpoint):
    """The SDK's session, with the types that it would otherwise download."""
    port = int(endpoint.rsplit(":", 1)[1])
    session = ZenohSession.get_instance("127.0.0.1", port)
    session.store = STORE
    for service in ("SetBool", "Trigger"):
        request = "bool data\n" if service == "SetBool" else "uint8 structure_needs_at_least_one_member\n"
        for part, text in (("Request", request), ("Response", RESPONSE)):
            session.register_message_type(text, f"std_srvs/srv/{service}_{part}")
    session._registered_types.update({name: name for name in STORE.fielddefs if "/srv/" not in name})
    return session, {"domain_id": DOMAIN, "router_ip": "127.0.0.1", "router_port": port}


def ends(topic, where):
    """Publishers and subscriptions of a topic, as the SDK lists them."""
    info = get_topic_info(topic, verbose=True, timeout=PATIENCE_S, **where)
    return info.publishers + info.subscribers if info else []


def listed(where):
    """Everything that the SDK lists: names, types, hashes and QoS. Until its links are settled, zenoh answers with a part."""
    wanted = {**PUBLISHED, TORQUE: "std_msgs/msg/Float64"}
    types = {topic: [kind] for topic, kind in wanted.items()}
    wait_for(lambda: dict(get_topic_names_and_types(timeout=PATIENCE_S, **where)) == types, "topics and types are listed")
    expect("topics and types are listed", True, f"{len(types)}")
    for topic, kind in wanted.items():
        (end,) = wait_until(lambda: ends(topic, where))
        depth = 100 if topic == "/tf" else 10
        holds = end.type_hash == STORE.hash_rihs01(kind) and end.qos == f"::,{depth}:,:,:,," and end.node_name == "crank_1"
        expect(f"hash, QoS and node of {topic}", holds, f"{end.type_hash[:15]}… {end.qos} {end.node_name}")
    services = {f"/crank_1/{name}": [f"std_srvs/srv/{kind}"] for name, kind in SERVICES.items()}
    wait_for(lambda: dict(get_service_names_and_types(timeout=PATIENCE_S, **where)) == services, "services are listed")
    expect("services are listed", True, f"{len(services)}")


def wait_until(find):
    """The first answer that is not empty."""
    found = []
    wait_for(lambda: found.append(find()) or found[-1], "an answer comes")
    return found[-1]


def tokens(session):
    """Keys of all liveliness tokens of ROS."""
    return [str(reply.ok.key_expr) for reply in session.session.liveliness().get("@ros2_lv/**", timeout=1.0) if reply.ok]


def received(where):
    """Messages of ten seconds, as the SDK decodes them."""
    got = defaultdict(list)
    subscribers = [
        ROS2Subscriber(topic, kind, got[topic].append, type_hash=STORE.hash_rihs01(kind), **where)
        for topic, kind in PUBLISHED.items()
    ]
    joints = got["/crank_1/joint_states"]
    wait_for(lambda: joints, "joint states come")
    begun = time.monotonic()
    time.sleep(SECONDS)
    elapsed = time.monotonic() - begun
    for subscriber in subscribers:
        subscriber.close()
    return got, elapsed


def time_ns(message):
    """Simulated time of a message, ns."""
    if hasattr(message, "clock"):
        stamp = message.clock
    else:
        parts = getattr(message, "transforms", None) or getattr(message, "markers", None)
        stamp = (parts[0] if parts else message).header.stamp
    return stamp.sec * 10**9 + stamp.nanosec


def compare(got, topics):
    """Compares the received messages with the recording: nothing missing, equal to the bit."""
    joints = got["/crank_1/joint_states"]
    by_time = {round(message.stamp.sim_time_s * 1e9): message for _, message in topics["angles"] if message.stamp.epoch == 0}
    times = [time_ns(joint) for joint in joints]
    for topic in ("/crank_1/joint_states", "/clock", "/tf", "/crank_1/joints/pivot"):
        own = [time_ns(message) for message in got[topic]]
        between = [time for time in by_time if own[0] <= time <= own[-1]]
        expect(f"nothing is lost on {topic}", own == between and len(own) >= SECONDS * 195, f"{len(own)} of {len(between)}")
    ends = {round(m.stamp.sim_time_s * 1e9): m.nodes[-1] for _, m in topics["displacements"] if m.stamp.epoch == 0}
    loads = {round(m.stamp.sim_time_s * 1e9): m for _, m in topics["loads"] if m.stamp.epoch == 0}
    for at, joint in zip(times, joints):
        angles, end = by_time[at], ends[at]
        positions = [link.chord_rad for link in angles.links] + [end.x_m]
        rates = [link.rate_rad_per_s for link in angles.links] + [end.vx_m_per_s]
        efforts = [loads[at].driving_torque_nm, 0.0, -loads[at].resistance_n]
        bits = lambda numbers: numpy.array(numbers, dtype=numpy.float64).tobytes()
        same = [bits(one) == bits(other) for one, other in ((joint.position, positions), (joint.velocity, rates), (joint.effort, efforts))]
        if joint.name != ["crank", "rod", "slider"] or not all(same):
            expect("joint states equal angles, displacements and loads", False, f"{joint}")
    expect("joint states equal angles, displacements and loads to the bit", True)
    for wrench in got["/crank_1/joints/crank_pin"]:
        (joint,) = [joint for joint in loads[time_ns(wrench)].joints if joint.joint == "crank-pin"]
        if (wrench.wrench.force.x, wrench.wrench.force.y) != (joint.fx_n, joint.fy_n):
            expect("wrenches are the joints' forces", False, f"{wrench}")
    marked = [time_ns(message) for message in got["/crank_1/markers"]]
    apart = {later - earlier for earlier, later in zip(marked, marked[1:])}
    expect("25 markers a second", apart == {40_000_000}, f"{len(marked)}, {apart} ns apart")
    expect("diagnostics come", len(got["/diagnostics"]) > 15 and got["/diagnostics"][0].status[0].level in (0, 1, b"\x00", b"\x01"))


def service_token(service):
    """Key of the liveliness token of a service of the node."""
    of_it = lambda token: "/SS/" in token and f"%crank_1%{service}/" in token
    return wait_until(lambda: [token for token in tokens(ZenohSession.get_instance()) if of_it(token)])[0]


def call(service, where, **request):
    kind = SERVICES[service]
    hashed = service_token(service).split("/")[-2]
    client = ROS2ServiceClient(f"/crank_1/{service}", f"std_srvs/srv/{kind}", type_hash=hashed, timeout=PATIENCE_S, **where)
    response = client.call(**request)
    client.close()
    return response


def commands(where):
    """Sends a torque and calls the services; the recording has their effects."""
    publisher = ROS2Publisher(TORQUE, "std_msgs/msg/Float64", type_hash=STORE.hash_rihs01("std_msgs/msg/Float64"), **where)
    wait_for(lambda: publisher.pub.matching_status.matching, "the service takes torques")
    efforts = []
    kind = "sensor_msgs/msg/JointState"
    told = lambda joint: efforts.append(joint.effort[0])
    subscriber = ROS2Subscriber("/crank_1/joint_states", kind, told, type_hash=STORE.hash_rihs01(kind), **where)
    publisher.publish(data=3.25)
    wait_for(lambda: any(abs(effort - 3.25) < 1e-9 for effort in efforts), "the torque is an effort of the crank")
    subscriber.close()
    for service, request in (("pause", {"data": True}), ("step", None), ("pause", {"data": False}), ("reset", None)):
        request = request or {"structure_needs_at_least_one_member": 0}
        response = call(service, where, **request)
        expect(f"{service} {request} is answered", response is not None and response.success, f"{response}")
    return publisher


def hostile(session, log):
    """Bad payloads on the torque topic and on a service: refused, logged at a limited rate, and without effect."""
    key = f"{DOMAIN}{TORQUE}/std_msgs::msg::dds_::Float64_/{STORE.hash_rihs01('std_msgs/msg/Float64')}"
    good = b"\x00\x01\x00\x00" + struct.pack("<d", 99.0)
    bad = [good[:length] for length in range(len(good))] + [b"\x00\x00" + good[2:], good + bytes(4), bytes(8192)]
    for payload in bad * 20:
        session.put(key, payload)
    session.put(f"{DOMAIN}{TORQUE}/**", good)
    _, kind, hashed, _ = service_token("pause").rsplit("/", 3)
    answers = [
        reply.err is not None
        for payload in (b"", b"\x00\x01\x00\x00", b"\x00\x01\x00\x00\x02", None)
        for reply in session.get(f"{DOMAIN}/crank_1/pause/{kind}/{hashed}", payload=payload, timeout=PATIENCE_S)
    ]
    expect("bad calls are answered with an error", answers == [True] * 4, f"{answers}")
    wait_for(lambda: "std_msgs/msg/Float64" in log.read_text(), "bad torques are logged")
    lines = [line for line in log.read_text().splitlines() if "a command was refused" in line]
    expect("bad payloads are logged, at a limited rate", 1 <= len(lines) <= 20, f"{len(lines)} lines for {len(bad) * 20 + 5}")


def recorded_commands(topics):
    setpoints = [(m.setpoint.torque_nm, m.reply) for _, m in topics["commands"] if m.WhichOneof("command") == "setpoint"]
    (torque, reply) = setpoints[0]
    expect("the torque is recorded, with a receipt", len(setpoints) == 1 and torque == 3.25 and reply.accepted, f"{reply.id}")
    driving = [m.driving_torque_nm for _, m in topics["loads"] if m.stamp.step >= reply.effective_step and m.stamp.epoch == 0]
    expect("and acts", abs(max(driving) - 3.25) < 1e-9, f"{max(driving)} N m")
    actions = [m.control.WhichOneof("action") for _, m in topics["commands"] if m.WhichOneof("command") == "control"]
    expect("services are recorded", actions[:4] == ["pause", "step", "resume", "reset"], f"{actions}")


def exported(folder, record, topics):
    """The exported file, as `rosbags` and `mcap-ros2-support` read it."""
    bag = folder / "bag.mcap"
    subprocess.run([BINARY, "export", str(record), "--ros2", str(bag)], check=True, stdout=subprocess.DEVNULL)
    with open(bag, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        expect("the profile is ros2", reader.get_header().profile == "ros2")
        decoded = [(channel.topic, message) for _, channel, _, message in reader.iter_decoded_messages()]
    angles = [link.chord_rad for _, m in topics["angles"] for link in m.links[:1]]
    of_mcap = [message.position[0] for topic, message in decoded if topic == "/crank_1/joint_states"]
    expect("mcap-ros2-support reads every angle", of_mcap == angles, f"{len(decoded)} messages")
    count, of_rosbags = 0, []
    with AnyReader([bag], default_typestore=STORE) as reader:
        for connection in reader.connections:
            expect(f"rosbags knows {connection.topic}", connection.msgtype in STORE.fielddefs, connection.msgtype)
        for connection, _, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            again = bytes(STORE.serialize_cdr(message, connection.msgtype))
            count += 1
            if again != bytes(data):
                expect("rosbags encodes the same bytes", False, connection.topic)
            if connection.topic == "/crank_1/joint_states":
                of_rosbags.append(float(message.position[0]))
    expect("rosbags reads every angle, and encodes the same bytes", of_rosbags == angles and count == len(decoded), f"{count}")


def live(folder):
    """A service behind a router, and the SDK as another peer there."""
    (hub, endpoint), record, log = router(), folder / "crank.mcap", folder / "log"
    options = ["--name", "crank-1", f"--ros2={DOMAIN}", "--set", "pulse=[]", "--record", str(record)]
    with open(log, "w") as errors:
        process = subprocess.Popen([BINARY, "run", *options, "--listen", free_endpoint(), "--connect", endpoint], stderr=errors)
    try:
        session, where = sdk(endpoint)
        listed(where)
        got, _ = received(where)
        publisher = commands(where)
        hostile(session.session, log)
        publisher.close()
        process.send_signal(signal.SIGINT)
        # 6: hostile torques may leave the energy balance off before the reset, and that counts for the whole session.
        expect("Ctrl-C ends cleanly", process.wait(PATIENCE_S) in (0, 6), log.read_text()[-300:])
        wait_for(lambda: not tokens(session), "the node leaves the graph")
    finally:
        process.kill()
        process.wait()
    topics = recorded(record)
    compare(got, topics)
    recorded_commands(topics)
    return record, topics, hub


def replayed(record, topics):
    """A replay as a node: joint states as recorded, and no torque topic."""
    endpoint = free_endpoint()
    command = [BINARY, "replay", str(record), "--ros2", "--name", "ghost", "--start-paused", "--listen", endpoint]
    process = subprocess.Popen(command, stderr=subprocess.DEVNULL, stdin=subprocess.DEVNULL)
    config = zenoh.Config.from_json5(f'{{ mode: "client", connect: {{ endpoints: ["{endpoint}"], timeout_ms: 10000 }} }}')
    got, kind = [], "sensor_msgs/msg/JointState"
    try:
        with zenoh.open(config) as session:
            subscriber = session.declare_subscriber("0/ghost/joint_states/**", lambda sample: got.append(sample.payload.to_bytes()))
            listed = lambda: [str(reply.ok.key_expr) for reply in session.liveliness().get("@ros2_lv/0/**", timeout=1.0) if reply.ok]
            wait_for(lambda: any("/NN/" in token for token in listed()), "the replay is a node")
            expect("a replay has no torque topic", not any("%torque" in token for token in listed()))
            (pause,) = [token for token in listed() if "/SS/" in token and "%ghost%pause/" in token]
            _, service, hashed, _ = pause.rsplit("/", 3)
            answers = session.get(f"0/ghost/pause/{service}/{hashed}", payload=b"\x00\x01\x00\x00\x00", timeout=PATIENCE_S)
            expect("a call resumes the replay", [reply.ok.payload.to_bytes()[4] for reply in answers] == [1])
            expect("the replay ends", process.wait(PATIENCE_S) == 0)
            subscriber.undeclare()
    finally:
        process.kill()
        process.wait()
    positions = [float(STORE.deserialize_cdr(payload, kind).position[0]) for payload in got]
    angles = [message.links[0].chord_rad for _, message in topics["angles"]]
    expect("a replay's joint states are the recorded angles", positions == angles, f"{len(positions)} of {len(angles)}")


def nothing_when_off():
    endpoint = free_endpoint()
    process = subprocess.Popen([BINARY, "run", "--no-record", "--name", "plain", "--listen", endpoint], stderr=subprocess.DEVNULL)
    config = zenoh.Config.from_json5(f'{{ mode: "client", connect: {{ endpoints: ["{endpoint}"], timeout_ms: 10000 }} }}')
    try:
        with zenoh.open(config) as session:
            present = lambda key: [reply for reply in session.liveliness().get(key, timeout=1.0)]
            wait_for(lambda: present("flexcrank/*"), "the service is there")
            expect("without --ros2 there is nothing of ROS", present("@ros2_lv/**") == [])
    finally:
        process.kill()
        process.wait()


def message_of(kind, values):
    """A message of `rosbags` from nested lists, in which numbers with a fraction are bits."""
    fields = STORE.fielddefs[kind][1]
    return STORE.types[kind](**{name: field_of(desc, value) for (name, desc), value in zip(fields, values)})


def field_of(desc, value):
    node, of = desc
    if node.name in ("ARRAY", "SEQUENCE"):
        element = of[0]
        values = [field_of(element, one) for one in value]
        dtypes = {"float64": "<f8", "float32": "<f4", "uint8": "u1", "char": "u1"}
        named = element[1][0] if element[0].name == "BASE" else None
        return numpy.array(values, dtype=dtypes[named]) if named in dtypes else values
    if node.name == "NAME":
        return message_of(of, value)
    if of[0] == "float64":
        return struct.unpack("<d", struct.pack("<Q", value))[0]
    if of[0] == "float32":
        return struct.unpack("<f", struct.pack("<I", value))[0]
    # rosbags takes `byte` as signed.
    return value - 256 if of[0] == "byte" and value > 127 else value


def vectors():
    """Hashes of all types, and the bytes of 10,000 random messages, which a test in Rust has written."""
    path = Path("target/tmp/ros2-vectors.jsonl")
    if not path.exists():
        subprocess.run(["cargo", "test", "--quiet", "--test", "ros2", "vectors_are_made"], check=True)
    hashes = messages = 0
    for line in open(path):
        vector = json.loads(line)
        kind = vector["type"]
        if kind not in STORE.fielddefs or ("hash" in vector and kind == OF_CHARS):
            continue
        if "hash" in vector:
            expect(f"hash of {kind}", vector["hash"] == STORE.hash_rihs01(kind), vector["hash"][:20])
            hashes += 1
        else:
            cdr = bytes(STORE.serialize_cdr(message_of(kind, vector["value"]), kind)).hex()
            if cdr != vector["cdr"]:
                expect(f"bytes of a random {kind}", False, f"{vector['cdr']} instead of {cdr}")
            messages += 1
    expect("random messages have the bytes of rosbags", hashes == 24 and messages >= 10_000, f"{hashes} types, {messages} messages")


def main():
    os.environ.pop("ROS_DOMAIN_ID", None)
    vectors()
    nothing_when_off()
    with tempfile.TemporaryDirectory() as folder:
        record, topics, hub = live(Path(folder))
        exported(Path(folder), record, topics)
        replayed(record, topics)
        hub.close()
    print("ros2: all holds")


if __name__ == "__main__":
    main()
