"""Lateness of the stepping thread in runs with a disturbance and without, in turn.

Deadlines that are missed are left out (`--overrun skip`): else one stall of the machine, of which no run knows how many it gets,
would count once for every step that it covers, and ten of 6 ms would make up the 99th percentile of six seconds. That time is caught
up with is for a run without these options to show.
"""

import statistics

from check import expect_if

LIMIT = 0.25
OPTIONS = ("--overrun", "skip")


def of(status):
    return status.lateness_p50_s, status.lateness_p99_s


def told(status):
    return " / ".join(f"{x * 1e6:.2f}" for x in of(status)) + f" us ({status.given_up_s * 1e3:.0f} ms lost)"


def expect_alike(quiet, without, disturbed):
    """Medians over the runs: neither median nor 99th percentile moves by a quarter."""
    for k, name in enumerate(("median", "p99")):
        before, after = (statistics.median(of(status)[k] for status in runs) for runs in (without, disturbed))
        moved = after / before - 1
        expect_if(quiet, f"{name} lateness moves by less than {LIMIT:.0%}", moved < LIMIT, f"{before * 1e6:.2f} -> {after * 1e6:.2f} us, {moved:+.0%}")
