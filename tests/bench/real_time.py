"""Real time as an outside subscriber sees it, against what the service says of itself; then the recording, replayed."""

import sys
import tempfile
import time
from collections import defaultdict
from pathlib import Path

from check import Client, Machine, TELEMETRY, digests, expect, expect_if, expect_real_time, recorded, service, wait_for

STEP_S = 1e-3
FACTOR = 1e-3
# On a quiet machine a message comes so soon after it was published, in half of all cases.
WAY_S = 1e-3


class Timed(Client):
    """Also notes when each message came."""

    def __init__(self, *arguments):
        self.came = defaultdict(list)
        super().__init__(*arguments)

    def take(self, sample):
        self.came[str(sample.key_expr).rsplit("/", 1)[1]].append(time.time())
        super().take(sample)


def wall_s(stamp):
    return stamp.wall_time.seconds + 1e-9 * stamp.wall_time.nanos


def quantiles(values):
    values = sorted(values)
    return [values[int(of * (len(values) - 1))] for of in (0.5, 0.99, 1.0)]


def told(figures):
    return "p50 {:.3f} p99 {:.3f} max {:.3f} ms".format(*(1e3 * figure for figure in figures))


def compare_ages(quiet, client, status, stamps):
    """The age of samples by the service and by this subscriber.

    Deadlines are multiples of the step from a beginning that only the service knows. It lies before the wall time of every sample
    less its simulated time, and by no more than the least lateness with the cost of a step. So this subscriber's ages may be too small
    by that. Else they are larger by the way from service to subscriber: of each sample, and so of each quantile.
    """
    begun_s = min(wall_s(stamp) - stamp.sim_time_s for stamp in stamps)
    last = defaultdict(float)
    for topic in TELEMETRY:
        for payload, came_s in zip(client.payloads[topic], client.came[topic]):
            stamp = client.type(topic.capitalize()).FromString(payload).stamp
            if stamp.step > 0:
                last[stamp.step] = max(last[stamp.step], came_s - begun_s - stamp.sim_time_s)
    inside = [status.sample_age_p50_s, status.sample_age_p99_s, status.sample_age_max_s]
    outside = quantiles(last.values())
    print(f"     age of samples by status: {told(inside)}; by arrival of a sample's last message: {told(outside)}")
    counted = sum(status.sample_age.counts)
    expect("as many ages as samples that came", counted == len(last), f"{counted} of {len(last)}")
    if status.pacing_epoch:
        print("     deadlines were moved: ages cannot be compared")
        return
    hidden_s = status.lateness_p50_s + status.step_cost_max_s
    # Quantiles in Status are exact to a few digits.
    known = all(own <= 1.05 * seen + hidden_s for own, seen in zip(inside, outside))
    expect("none is younger when it comes than the service says, by p50, p99, max", known, f"{1e6 * hidden_s:.0f} us hidden")
    way_s = outside[0] - inside[0]
    expect_if(quiet, f"p50 of both agrees within {1e3 * WAY_S:g} ms", way_s < WAY_S, f"{1e3 * way_s:.3f} ms")


def main(seconds):
    machine = Machine()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "minute.mcap"
        arguments = ["run", "--publish-hz", "all", "--until", str(seconds), "--record", str(path)]
        arguments += ["--set", f"solver.step_s={STEP_S}"]
        with service(arguments, "minute", client=Timed) as (process, client):
            client.learn()
            expect("exit code 0", process.wait(seconds + 60) == 0)
            angles = [client.type("Angles").FromString(payload) for payload in client.payloads["angles"]]
            status = client.newest("status")
        quiet = machine.is_quiet()
        steps = [angle.stamp.step for angle in angles]
        expect("no step skipped", steps == list(range(steps[0], steps[0] + len(steps))), f"{len(steps)} steps seen")
        stamps, came = [angle.stamp for angle in angles], client.came["angles"]
        simulated_s = stamps[-1].sim_time_s - stamps[0].sim_time_s
        outside, stamped = simulated_s / (came[-1] - came[0]), simulated_s / (wall_s(stamps[-1]) - wall_s(stamps[0]))
        inside = status.real_time_factor
        expect_real_time(quiet, inside, FACTOR)
        expect_if(quiet, "an outside subscriber agrees", abs(outside - inside) < FACTOR, f"arrivals {outside:.6f}, stamps {stamped:.6f}")
        late = [wall_s(stamp) - stamp.sim_time_s for stamp in stamps]
        late = quantiles(x - min(late) for x in late)
        print(f"     lateness by status: {told([status.lateness_p50_s, status.lateness_p99_s, status.lateness_max_s])}; "
              f"by stamps, against the earliest: {told(late)}; overruns {status.overruns}")
        compare_ages(quiet, client, status, stamps)
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
