"""Real time as an outside subscriber sees it, against what the service says of itself; then the recording, replayed."""

import sys
import tempfile
import time
from pathlib import Path

from check import Client, TELEMETRY, digests, expect, recorded, service, wait_for

STEP_S = 1e-3


class Timed(Client):
    """Also notes when each `angles` message came."""

    def __init__(self, *arguments):
        self.came = []
        super().__init__(*arguments)

    def take(self, sample):
        if str(sample.key_expr).endswith("/angles"):
            self.came.append(time.monotonic())
        super().take(sample)


def main(seconds):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "minute.mcap"
        arguments = ["run", "--publish-hz", "all", "--until", str(seconds), "--record", str(path)]
        arguments += ["--set", f"solver.step_s={STEP_S}"]
        with service(arguments, "minute", client=Timed) as (process, client):
            client.learn()
            expect("exit code 0", process.wait(seconds + 60) == 0)
            angles = [client.type("Angles").FromString(payload) for payload in client.payloads["angles"]]
            status = client.newest("status")
        steps = [angle.stamp.step for angle in angles]
        expect("no step skipped", steps == list(range(steps[0], steps[0] + len(steps))), f"{len(steps)} steps seen")
        outside = (angles[-1].stamp.sim_time_s - angles[0].stamp.sim_time_s) / (client.came[-1] - client.came[0])
        wall = lambda stamp: stamp.wall_time.seconds + 1e-9 * stamp.wall_time.nanos
        stamped = (angles[-1].stamp.sim_time_s - angles[0].stamp.sim_time_s) / (wall(angles[-1].stamp) - wall(angles[0].stamp))
        inside = status.real_time_factor
        expect("real-time factor is 1.000 within 0.001", abs(inside - 1) < 1e-3, f"{inside:.6f}")
        expect("an outside subscriber agrees", abs(outside - inside) < 1e-3, f"arrivals {outside:.6f}, stamps {stamped:.6f}")
        late = [wall(a.stamp) - wall(angles[0].stamp) - (a.stamp.sim_time_s - angles[0].stamp.sim_time_s) for a in angles]
        late = sorted(x - min(late) for x in late)
        print(f"     lateness by status: p50 {status.lateness_p50_s * 1e3:.3f} p99 {status.lateness_p99_s * 1e3:.3f} "
              f"max {status.lateness_max_s * 1e3:.3f} ms; by stamps, against the earliest: p50 {late[len(late) // 2] * 1e3:.3f} "
              f"p99 {late[len(late) * 99 // 100] * 1e3:.3f} max {late[-1] * 1e3:.3f} ms; overruns {status.overruns}")
        topics = recorded(path)
        wanted = {topic: [message.data for message, _ in topics[topic]] for topic in TELEMETRY}
        expect("every step is recorded", len(wanted["angles"]) == round(seconds / STEP_S) + 1, f"{len(wanted['angles'])} messages")
        with service(["replay", str(path), "--wait-for", "1", "--rate", "4"], "echo") as (process, client):
            expect("replay exits with 0", process.wait(seconds + 60) == 0)
            wait_for(lambda: len(client.payloads["loads"]) >= len(wanted["loads"]), "all of it arrives")
            expect("replayed payloads are identical (SHA-256)", digests(client.payloads) == digests(wanted))
    print("real time: all holds")


if __name__ == "__main__":
    main(float(sys.argv[2]))
