"""Mean and rise of torque pulses over a step, from their antiderivatives in 200-digit arithmetic: writes pulses.csv.

Needs mpmath (1.3.0). Usage: python tests/data/pulses.py > tests/data/pulses.csv

Every time is a multiple of one power of two within 53 bits of it, so that differences of times are exact in doubles: what a
program has wrong is its closed form and not the subtraction. Results are rounded once, to the nearest double.
"""

import itertools
import math
import random
from fractions import Fraction

from mpmath import cos, mp, mpf, pi, sin

mp.dps = 200
TORQUE_NM = 5.0
DURATIONS_S = [1e-9, 1e-6, 1e-4, 1e-2, 1 / 3, 100.0, 3600.0, 1e5, 1e7, 1e9]
STEPS_S = [1e-9, 1e-7, 1e-5, 1e-3, 0.1, 10.0]
STARTS_S = [0.0, 0.75, 1024.5]
# Where a step begins after the pulse has begun: so much of the duration and so many steps.
PLACES = [
    (0, -0.5), (0, -0.001), (0, 0), (0, 1), (0, 17.3), (1e-4, 0), (0.1, 0), (0.25, -0.5), (0.25, 0), (0.4999, 0), (0.5, -1),
    (0.5, -0.5), (0.5, -0.49), (0.5, 0.3), (0.75, 0), (0.8, 0), (0.9999, 0), (1, -17.3), (1, -2), (1, -1), (1, -0.999), (1, -0.5),
    (1, -1e-3),
]


def exact(number):
    """A double as it is."""
    number = Fraction(number)
    return mpf(number.numerator) / number.denominator


def double(number):
    """The nearest double."""
    return float(Fraction(int(mp.nint(number * 2**400)), 2**400))


def impulse(shape, duration, u):
    """Integral of the pulse of 1 N·m from its beginning to u, and the integral of that."""
    if shape == "rectangular":
        return u, u * u / 2
    turn = 2 * pi / duration
    return u - sin(turn * u) / turn, u * u / 2 + (cos(turn * u) - 1) / turn**2


def mean_and_rise(shape, start, duration, first, last):
    """By parts, about the step's middle; a rectangle is said not to rise."""
    start, duration, first, last = map(exact, (start, duration, first, last))
    step, middle = last - first, (first + last) / 2 - start
    a, b = max(first - start, mpf(0)), min(last - start, duration)
    if b <= a:
        return mpf(0), mpf(0)
    (at_a, twice_a), (at_b, twice_b) = impulse(shape, duration, a), impulse(shape, duration, b)
    moment = (b - middle) * at_b - (a - middle) * at_a - (twice_b - twice_a)
    torque = exact(TORQUE_NM)
    return torque * (at_b - at_a) / step, mpf(0) if shape == "rectangular" else torque * 12 * moment / step**3


def grid(start, elapsed, step):
    """Ends of a step on a common power of two that leaves their differences exact; None if the step would be lost on it."""
    most = max(abs(start), abs(start + elapsed), abs(start + elapsed + step))
    quantum = 2.0 ** (math.frexp(most)[1] - 52)
    counts = round(elapsed / quantum), max(round(step / quantum), 0)
    if counts[1] < 64 or start % quantum:
        return None
    first = start + counts[0] * quantum
    return None if first < 0 else (first, first + counts[1] * quantum)


def main():
    random.seed(13)
    print("shape,start_s,duration_s,torque_nm,from_s,to_s,mean_nm,rise_nm_per_s")
    for duration, step in itertools.product(DURATIONS_S, STEPS_S):
        for share, steps in random.sample(PLACES, 9):
            start = random.choice(STARTS_S)
            ends = grid(start, share * duration + steps * step, step) or grid(0.0, share * duration + steps * step, step)
            if ends is None:
                continue
            start = start if grid(start, share * duration + steps * step, step) else 0.0
            shape = "rectangular" if random.random() < 0.08 else "raised-cosine"
            mean, rise = mean_and_rise(shape, start, duration, *ends)
            print(shape, start, duration, TORQUE_NM, *ends, double(mean), double(rise), sep=",")


if __name__ == "__main__":
    main()
