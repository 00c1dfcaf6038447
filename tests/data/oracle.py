"""Writes oracle.json: costs and gradients of the whitened disagreement, and gas temperatures, to fifty digits, by mpmath.

Written from the definitions in docs/src/theory.md, with dense matrices; none of the program's code is used. Costs: u = f1 - f2, the two gas
temperatures that the readings imply, V the covariance of u by the noise of the readings that each row of it uses, and the cost u' V^-1 u.
Gas temperatures: the mean and the standard deviation of first-order noise at each instant, given all readings of two lags with white noise.

    python3 -m pip install mpmath==1.4.1 && python3 tests/data/oracle.py > tests/data/oracle.json

Run by hand: what it writes is in the repository, and `tests/tests/oracle.rs` reads it.
"""

import json
import math
import random

from mpmath import diag, exp, expm, eye, matrix, mp, mpf, sqrt

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


def conditioned(time, y, taus, noise, std, rate):
    """Mean and standard deviation of the gas about its level at each instant, given all readings.

    The state (gas, body 1, body 2) follows dz/dt = A z + white noise. Its covariance at t after one that it had is F P F' + S - F S F',
    with F = exp(A t) and the stationary S of A S + S A' + D = 0. At the first reading the gas is stationary, and each body as far from the
    level as twice the gas.
    """
    count = len(time)
    a = matrix([[-rate, 0, 0], [1 / taus[0], -1 / taus[0], 0], [1 / taus[1], 0, -1 / taus[1]]])
    # A S + S A' = -D, row by row of S.
    system, right = matrix(9, 9), matrix(9, 1)
    right[0] = -2 * rate * std**2
    for i in range(3):
        for j in range(3):
            for k in range(3):
                system[3 * i + j, 3 * k + j] += a[i, k]
                system[3 * i + j, 3 * i + k] += a[j, k]
    solved = mp.lu_solve(system, right)
    stationary = matrix([[solved[3 * i + j] for j in range(3)] for i in range(3)])
    at = [diag([std**2, 4 * std**2, 4 * std**2])]
    moves = []
    for k in range(1, count):
        f = expm(a * (time[k] - time[k - 1]))
        moves.append(f)
        at.append(f * (at[-1] - stationary) * f.T + stationary)
    # Covariance of the state at j with that at k >= j: P_j F'.
    between = {}
    for j in range(count):
        move = eye(3)
        for k in range(j, count):
            between[j, k] = at[j] * move.T
            if k + 1 < count:
                move = moves[k] * move

    def covariance(j, p, k, q):
        return between[j, k][p, q] if j <= k else between[k, j][q, p]

    known = [(k, i) for k in range(count) for i in (0, 1)]
    of_readings = matrix(len(known), len(known))
    for row, (j, p) in enumerate(known):
        for column, (k, q) in enumerate(known):
            of_readings[row, column] = covariance(j, p + 1, k, q + 1) + (noise[p] ** 2 if row == column else 0)
    readings = matrix([y[i][k] for k, i in known])
    weights = mp.lu_solve(of_readings, readings)
    out = []
    for k in range(count):
        of_gas = matrix([covariance(k, 0, j, i + 1) for j, i in known])
        left = std**2 - (of_gas.T * mp.lu_solve(of_readings, of_gas))[0]
        out.append(((of_gas.T * weights)[0], sqrt(left)))
    return out


def gas_case(generator, name, count=16, period=0.002, even=True, taus=(11.9, 58.4), noise=(0.1, 0.2), std=5.0, periods=40.0):
    """`taus` in sample periods, and the correlation time of the gas in `periods`."""
    time = [0.0]
    for _ in range(count - 1):
        time.append(time[-1] + period * (1.0 if even else generator.uniform(0.5, 1.5)))
    first, second = record(generator, count, 0.0, 0.2 * std)
    y = [[300.0 + v for v in values] for values in (first, second)]
    taus = [tau * period for tau in taus]
    corner = 1.0 / (2.0 * math.pi * periods * period)
    exact = [[mpf(v) for v in values] for values in (time, taus, noise)]
    about = [[mpf(v) - 300 for v in values] for values in y]
    gas = conditioned(exact[0], about, exact[1], exact[2], mpf(std), 2 * mp.pi * mpf(corner))
    return {
        "name": name, "time_s": time, "y1": y[0], "y2": y[1], "tau_s": taus, "noise_std_k": list(noise), "gas_std_k": std,
        "corner_hz": corner, "gas_k": [float(mean) for mean, _ in gas], "std_k": [float(left) for _, left in gas],
    }


def gas_cases():
    generator = random.Random(20)
    for ratio in (1e-2, 1.0, 1e2, 1e4, 1e6):
        for even in (True, False):
            yield gas_case(generator, f"tau {ratio:g} periods", taus=(ratio, 4.9 * ratio), even=even)
    yield gas_case(generator, "4 samples", count=4)
    for ratio in (1e-6, 1e-3, 1e3, 1e6):
        yield gas_case(generator, f"noise ratio {ratio:g}", noise=(0.1, 0.1 * ratio))
    yield gas_case(generator, "equal time constants", taus=(30.0, 30.0))
    for periods in (1e-3, 1e5):
        yield gas_case(generator, f"a gas of {periods:g} periods", periods=periods)
    yield gas_case(generator, "a period of 1e-9 s", period=1e-9)
    yield gas_case(generator, "a period of 1e9 s", period=1e9)


if __name__ == "__main__":
    print(json.dumps({"cases": list(cases()), "gas": list(gas_cases())}, indent=1))
