"""Lateness and age in runs with a disturbance and without, in turn, each judged on the disturbed stretch alone.

Quantiles in `Status` cover the whole run. The differences of its histograms between two statuses cover the steps between them.
Deadlines that are missed are moved (`--overrun skip`). Otherwise one stall of the machine counts once for every step that it covers,
and the runs differ by the number of stalls. The time given up is compared instead.
"""

import statistics
from collections import namedtuple

from check import expect, expect_if

LIMIT = 0.25
# A stretch may give up this part of its time more than one without the disturbance.
GIVEN_UP = 1e-3
OPTIONS = ("--overrun", "skip")

Stretch = namedtuple("Stretch", "lateness_p50_s lateness_p99_s age_p50_s age_p99_s given_up_s overruns steps seconds")


def stretch(before, after):
    """Everything between two statuses of a run."""
    lateness, age = (differences(getattr(before, name), getattr(after, name)) for name in ("lateness", "sample_age"))
    return Stretch(
        *(quantile(counts, after.lateness.bins_per_doubling, of) for counts in (lateness, age) for of in (0.5, 0.99)),
        given_up_s=after.given_up_s - before.given_up_s,
        overruns=after.overruns - before.overruns,
        steps=sum(lateness),
        seconds=wall_s(after) - wall_s(before),
    )


def differences(before, after):
    counts = list(after.counts)
    for k, count in enumerate(before.counts):
        counts[k] -= count
    return counts


def quantile(counts, bins_per_doubling, of):
    """Interpolated in its bin, s; 0 without counts."""
    rest = of * sum(counts)
    for k, count in enumerate(counts):
        if count and rest <= count:
            return 2 ** ((k - 1 + rest / count) / bins_per_doubling) * 1e-9
        rest -= count
    return 0.0


def wall_s(status):
    return status.stamp.wall_time.seconds + 1e-9 * status.stamp.wall_time.nanos


def told(run):
    us = lambda *names: " / ".join(f"{getattr(run, name) * 1e6:.2f}" for name in names)
    return (f"lateness {us('lateness_p50_s', 'lateness_p99_s')} us, age {us('age_p50_s', 'age_p99_s')} us, "
            f"{run.given_up_s * 1e3:.1f} ms given up in {run.seconds:.1f} s")


def expect_alike(quiet, without, disturbed):
    """Medians over the runs: neither median nor 99th percentile of the lateness moves by a quarter, and no time is lost."""
    middle = lambda runs, name: statistics.median(getattr(run, name) for run in runs)
    expect("every stretch has steps", all(run.steps > 0 for run in [*without, *disturbed]))
    for name in ("lateness_p50_s", "lateness_p99_s"):
        before, after = (middle(runs, name) for runs in (without, disturbed))
        moved = after / before - 1
        expect_if(quiet, f"{name} moves by less than {LIMIT:.0%}", moved < LIMIT, f"{before * 1e6:.2f} -> {after * 1e6:.2f} us, {moved:+.0%}")
    for name in ("age_p50_s", "age_p99_s"):
        before, after = (middle(runs, name) for runs in (without, disturbed))
        print(f"     {name}: {before * 1e6:.2f} -> {after * 1e6:.2f} us")
    before, after = (sum(run.given_up_s for run in runs) / sum(run.seconds for run in runs) for runs in (without, disturbed))
    expect_if(quiet, f"no more than {GIVEN_UP:.1%} of the time is given up in addition", after - before < GIVEN_UP, f"{before:.3%} -> {after:.3%}")
