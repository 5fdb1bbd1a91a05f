"""What viewers get from a recording: shapes in Foxglove's own schema, where the mechanism's nodes are; entities in Rerun's."""

import json
import re
import subprocess
import sys
import tempfile
from collections import defaultdict
from pathlib import Path

from foxglove_schemas_protobuf import SceneUpdate_pb2
from google.protobuf import descriptor_pb2, descriptor_pool
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from check import BINARY, expect, free_endpoint

HZ = 25


def record(folder, scene, *options):
    path = folder / f"{scene}.mcap"
    command = [BINARY, "run", scene, "--pace", "max", "--until", "2", "--listen", free_endpoint(), "--record", str(path), *options]
    subprocess.run(command, check=True, stderr=subprocess.DEVNULL)
    topics, raw, schema = defaultdict(dict), {}, None
    with open(path, "rb") as file:
        for channel_schema, channel, message, decoded in make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages():
            chunk = channel.topic.rsplit("/", 1)[1]
            topics[chunk][message.log_time] = decoded
            if chunk == "scene_updates":
                raw[message.log_time], schema = message.data, channel_schema
    return path, topics, raw, schema


def fields(message):
    """Names, numbers and types of all fields that a message is made of; lineage and identities are later additions."""
    known, waiting = {}, [message]
    while waiting:
        one = waiting.pop()
        if one.full_name in known or not one.full_name.startswith("foxglove."):
            continue
        own = [field for field in one.fields if field.number < 100]
        known[one.full_name] = {(field.name, field.number, field.type, field.is_repeated) for field in own}
        waiting += [field.message_type for field in own if field.message_type]
    return known


def crank_slider(folder):
    path, topics, raw, schema = record(folder, "crank-slider", "--scene-updates")
    times = sorted(raw)
    gaps = {round((after - before) * 1e-9, 6) for before, after in zip(times, times[1:])}
    expect("25 updates a second", len(times) in (50, 51) and gaps == {1 / HZ}, f"{len(times)} in 2 s, {sorted(gaps)} s apart")
    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(schema.data).file:
        pool.Add(file)
    own, official = fields(pool.FindMessageTypeByName("foxglove.SceneUpdate")), fields(SceneUpdate_pb2.SceneUpdate.DESCRIPTOR)
    expect("the schema in the file is Foxglove's", schema.name == "foxglove.SceneUpdate" and own == official, f"{len(own)} messages")
    furthest = 0.0
    for time in times:
        update = SceneUpdate_pb2.SceneUpdate.FromString(raw[time])
        (entity,) = update.entities
        nodes = defaultdict(list)
        for node in topics["displacements"][time].nodes:
            nodes[node.link].append((node.x_m, node.y_m))
        stamp_ns = entity.timestamp.seconds * 1_000_000_000 + entity.timestamp.nanos
        fits = stamp_ns == time and len(entity.lines) == 2 and len(entity.spheres) == 2 and len(entity.cubes) == 1
        for line, places in zip(entity.lines, nodes.values()):
            drawn = [(point.x, point.y) for point in line.points]
            fits &= len(drawn) > 4 * len(places) and min(map(len, (drawn, places))) > 1
            furthest = max([furthest] + [min(abs(x - u) + abs(y - v) for u, v in drawn) for x, y in places])
        slider = entity.cubes[0].pose.position
        furthest = max(furthest, abs(slider.x - nodes["rod"][-1][0]) + abs(slider.y))
        if not fits:
            expect(f"shapes at {time}", False, str(entity)[:400])
    expect("lines go through every node, the slider is at the rod's end", furthest < 1e-9, f"within {furthest:.1e} m")
    verified = subprocess.run([BINARY, "verify", str(path)], capture_output=True, text=True)
    expect("verify finds the recording sound", verified.returncode == 0, verified.stdout.strip().splitlines()[-1:])


def oscillator(folder):
    _, topics, raw, _ = record(folder, "thesis-two-masses", "--scene-updates=5")
    entity = SceneUpdate_pb2.SceneUpdate.FromString(raw[max(raw)]).entities[0]
    places = [node.x_m for node in topics["displacements"][max(raw)].nodes]
    expect("masses are cubes", [cube.pose.position.x for cube in entity.cubes] == places, f"{places} m")


def layout():
    """The layout file names topics and fields that there are."""
    text = subprocess.run([BINARY, "files", "foxglove-layout.json"], check=True, capture_output=True, text=True).stdout
    panels = json.loads(text)["configById"]
    topics = set(re.findall(r"flexcrank/crank/(\w+)", text))
    expect("the layout shows scene and charts", any(key.startswith("3D!") for key in panels), ", ".join(sorted(topics)))
    paths = [path["value"] for panel in panels.values() for path in panel.get("paths", [])]
    reply = Path("proto/flexcrank.proto").read_text()
    named = [name for path in paths for name in re.findall(r"\.(\w+)", path.split("}")[-1])]
    expect("its paths end in fields of our messages", all(re.search(rf"\b{name} =", reply) for name in named), f"{len(paths)} paths")


def rerun(folder):
    """Rerun reads what `to-rerun` has written."""
    path, out = folder / "crank-slider.mcap", folder / "crank-slider.rrd"
    subprocess.run([sys.executable, "src/files/to-rerun", str(path), str(out)], check=True)
    stats = subprocess.run([sys.executable, "-m", "rerun", "rrd", "stats", str(out)], capture_output=True, text=True, check=True)
    drawn = re.findall(r"^/((?:mechanism|deflection_m|rate_rad_per_s)/\w+|driving_torque_nm):", stats.stdout, re.MULTILINE)
    links = [f"{chart}/{link}" for chart in ("deflection_m", "mechanism", "rate_rad_per_s") for link in ("crank", "rod")]
    cut = folder / "cut.mcap"
    cut.write_bytes(path.read_bytes()[:-100])
    told = subprocess.run([sys.executable, "src/files/to-rerun", str(cut), str(out)], capture_output=True, text=True)
    one = told.returncode == 1 and told.stderr.count("\n") == 1
    expect("a recording that was cut off is refused in a sentence", one and "flexcrank recover" in told.stderr, told.stderr.strip())
    bare = subprocess.run([sys.executable, "-S", "src/files/to-rerun", str(path), str(out)], capture_output=True, text=True)
    one = bare.returncode == 1 and bare.stderr.count("\n") == 1
    expect("without Rerun, a sentence says what to install", one and "pip install rerun-sdk" in bare.stderr, bare.stderr.strip())
    expect("Rerun finds mechanism and charts", sorted(drawn) == sorted([*links, "driving_torque_nm"]), ", ".join(drawn))


def main():
    with tempfile.TemporaryDirectory() as folder:
        crank_slider(Path(folder))
        oscillator(Path(folder))
        rerun(Path(folder))
    layout()
    print("scene updates: all holds")


if __name__ == "__main__":
    main()
