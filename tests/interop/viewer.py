"""A viewer: the Foxglove WebSocket protocol, written from its specification, without the makers' code."""

import base64
import json
import struct
import threading
from collections import defaultdict

from websockets.sync.client import connect

SUBPROTOCOL = "foxglove.sdk.v1"
PLAYING, PAUSED, BUFFERING, ENDED = range(4)


class Viewer:
    """Subscribes to everything that it wants, and keeps what it receives."""

    def __init__(self, port, wanted=lambda topic: True, keep=True):
        self.socket = connect(f"ws://127.0.0.1:{port}", subprotocols=[SUBPROTOCOL], max_size=None, compression=None)
        self.wanted, self.keep, self.lock = wanted, keep, threading.Lock()
        self.info, self.channels, self.services = None, {}, {}
        self.messages = defaultdict(list)
        self.counts = defaultdict(int)
        self.statuses, self.replies, self.values, self.playback = [], {}, [], []
        self.calls, self.clock = 0, None
        self.open = True
        self.thread = threading.Thread(target=self.receive, daemon=True)
        self.thread.start()

    def receive(self):
        try:
            for message in self.socket:
                if isinstance(message, str):
                    self.take_text(json.loads(message))
                else:
                    self.take_binary(message)
        except Exception as error:  # the server ends, or this viewer does
            self.ending = error
        self.open = False

    def take_text(self, message):
        op = message["op"]
        with self.lock:
            if op == "serverInfo":
                self.info = message
            elif op == "advertise":
                new = {channel["id"]: channel for channel in message["channels"]}
                self.channels.update(new)
                wanted = [{"id": id, "channelId": id} for id, channel in new.items() if self.wanted(channel["topic"])]
                self.send({"op": "subscribe", "subscriptions": wanted})
            elif op == "advertiseServices":
                self.services.update({service["name"]: service for service in message["services"]})
            elif op == "status":
                self.statuses.append(message["message"])
            elif op == "parameterValues":
                self.values.append(message)
            elif op == "serviceCallFailure":
                self.replies[message["callId"]] = (False, message["message"])

    def take_binary(self, message):
        op = message[0]
        with self.lock:
            if op == 1:
                id, time = struct.unpack_from("<IQ", message, 1)
                topic = self.channels[id]["topic"]
                self.counts[topic] += 1
                if self.keep:
                    self.messages[topic].append((time, message[13:]))
            elif op == 2:
                self.clock = struct.unpack_from("<Q", message, 1)[0]
            elif op == 3:
                _, call, length = struct.unpack_from("<III", message, 1)
                self.replies[call] = (True, json.loads(message[13 + length:]))
            elif op == 5:
                status, time, speed, seeked, length = struct.unpack_from("<BQfBI", message, 1)
                self.playback.append((status, time, speed, bool(seeked), message[19:19 + length].decode()))

    def send(self, message):
        self.socket.send(json.dumps(message) if isinstance(message, dict) else message)

    def call(self, name, request):
        """Calls a service; the reply comes into `replies` under the number that is returned."""
        self.calls += 1
        head = struct.pack("<BIII", 2, self.services[name]["id"], self.calls, 4)
        self.send(head + b"json" + (request if isinstance(request, bytes) else json.dumps(request).encode()))
        return self.calls

    def advertise(self, id, topic, schema, encoding):
        channel = {"id": id, "topic": topic, "encoding": encoding, "schemaName": schema}
        self.send({"op": "advertise", "channels": [channel]})

    def publish(self, id, payload):
        self.send(struct.pack("<BI", 1, id) + payload)

    def control(self, command, speed, seek_ns=None, id="request"):
        """Sends a request of the timeline: 0 plays, 1 pauses."""
        head = struct.pack("<BBfBQI", 3, command, speed, seek_ns is not None, seek_ns or 0, len(id))
        self.send(head + id.encode())

    def set(self, parameters, id):
        self.send({"op": "setParameters", "parameters": parameters, "id": id})

    def get(self, names, id):
        self.send({"op": "getParameters", "parameterNames": names, "id": id})

    def parameters(self, id):
        """The answer to a request, by name; `None` if it has not come."""
        with self.lock:
            found = next((message for message in self.values if message.get("id") == id), None)
        return found and {parameter["name"]: parameter["value"] for parameter in found["parameters"]}

    def schema(self, topic):
        """The schema that the server states for a topic."""
        with self.lock:
            channel = next(channel for channel in self.channels.values() if channel["topic"] == topic)
        return channel["encoding"], channel["schemaName"], channel["schemaEncoding"], base64.b64decode(channel["schema"])

    def of(self, topic):
        with self.lock:
            return list(self.messages[topic])

    def close(self):
        self.socket.close()
