"""Writes oracle.json: costs and gradients of the whitened disagreement to fifty digits, by mpmath.

Written from the definition in docs/src/theory.md, with dense matrices: u = f1 - f2, the two gas temperatures that the readings imply,
V the covariance of u by the noise of the readings that each row of it uses, and the cost u' V^-1 u. None of the program's code is used.

    python3 -m pip install mpmath==1.4.1 && python3 tests/data/oracle.py > tests/data/oracle.json

Run by hand: what it writes is in the repository, and `tests/tests/oracle.rs` reads it.
"""

import json
import random

from mpmath import exp, matrix, mp, mpf

mp.dps = 50


def inferred(y, steps, tau, hold):
    """Rows of weights of the readings in the gas temperature that they imply, one for each step."""
    rows = []
    for k, step in enumerate(steps):
        row = [mpf(0)] * len(y)
        if hold == "zero-order-hold":
            a = exp(-step / tau)
            b = 1 - a
        else:
            # The trapezoidal rule of the differential equation, for the mean of the gas over the step.
            a = (2 * tau - step) / (2 * tau + step)
            b = 2 * step / (2 * tau + step)
        row[k], row[k + 1] = -a / b, 1 / b
        rows.append(row)
    return matrix(rows)


def cost(y1, y2, steps, taus, noise, hold):
    f1, f2 = (inferred(y, steps, tau, hold) for y, tau in zip((y1, y2), taus))
    u = f1 * matrix(y1) - f2 * matrix(y2)
    v = noise[0] ** 2 * f1 * f1.T + noise[1] ** 2 * f2 * f2.T
    return (u.T * mp.lu_solve(v, u))[0]


def gradient(y1, y2, steps, taus, noise, hold):
    """Central differences; at fifty digits a step of 1e-15 leaves thirty of them."""
    out = []
    for i in (0, 1):
        h = taus[i] * mpf(10) ** -15
        ends = []
        for sign in (1, -1):
            moved = list(taus)
            moved[i] += sign * h
            ends.append(cost(y1, y2, steps, moved, noise, hold))
        out.append((ends[0] - ends[1]) / (2 * h))
    return out


def record(generator, count, level, scale):
    """Two walks of readings that resemble each other; numbers as doubles have them."""
    first, second = level, level
    y1, y2 = [], []
    for _ in range(count):
        move = scale * generator.gauss(0, 1)
        first += move + 0.1 * scale * generator.gauss(0, 1)
        second += 0.7 * move + 0.1 * scale * generator.gauss(0, 1)
        y1.append(first)
        y2.append(second)
    return y1, y2


def case(generator, name, count=20, period=0.002, even=True, taus=(11.9, 58.4), noise=(0.1, 0.2), hold="zero-order-hold", level=300.0, scale=1.0):
    """`taus` in sample periods."""
    y1, y2 = record(generator, count, level, scale)
    steps = [period] * (count - 1) if even else [period * generator.uniform(0.5, 1.5) for _ in range(count - 1)]
    taus = [tau * period for tau in taus]
    exact = [[mpf(v) for v in values] for values in (y1, y2, steps, taus, noise)]
    value = cost(*exact[:4], exact[4], hold)
    slopes = gradient(*exact[:4], exact[4], hold)
    return {
        "name": name, "hold": hold, "even": even, "steps_s": steps if not even else steps[:1], "y1": y1, "y2": y2, "tau_s": taus,
        "noise_std_k": list(noise), "value": float(value), "gradient": [float(slope) for slope in slopes],
    }


def cases():
    generator = random.Random(19)
    for ratio in (1e-2, 1e-1, 1.0, 1e2, 1e4, 1e6, 1e8):
        for even in (True, False):
            yield case(generator, f"tau {ratio:g} periods", taus=(ratio, 4.9 * ratio), even=even)
    yield case(generator, "tau 1e8 and 0.01 periods", taus=(1e8, 1e-2))
    for count in (4, 5, 60):
        yield case(generator, f"{count} samples", count=count)
    for ratio in (1e-6, 1e-3, 1e3, 1e6):
        yield case(generator, f"noise ratio {ratio:g}", noise=(0.1, 0.1 * ratio))
    yield case(generator, "equal to 1e-9", taus=(30.0, 30.0 * (1 + 1e-9)))
    yield case(generator, "bilinear", hold="bilinear")
    yield case(generator, "readings of 1e-70", level=3e-68, scale=1e-70, noise=(1e-71, 2e-71))
    yield case(generator, "3000 °C and a swing of 1 mK", level=3000.0, scale=1e-3, noise=(1e-4, 2e-4))
    yield case(generator, "a period of 1e-9 s", period=1e-9)
    yield case(generator, "a period of 1e9 s", period=1e9)


if __name__ == "__main__":
    print(json.dumps({"cases": list(cases())}, indent=1))
