#!/usr/bin/env python3
"""What a user would otherwise write: Kalman's filter and the smoother of Rauch, Tung and Striebel in NumPy.

usage: rts_baseline.py FILE.csv TAU1 TAU2 NOISE1 NOISE2 LEVEL STD CORNER_HZ     (needs numpy, scipy)
Smooths one two-channel record (time_s,T1,T2): gas that is first-order noise about a level, and two first-order lags in it.
Prints the seconds that the smoothing takes, and the mean and the last gas temperature.
"""
import sys
import time

import numpy as np
from scipy.linalg import expm


def discrete(rates, drive, step):
    """The transition of a step and the covariance that it adds (Van Loan 1978)."""
    n = len(rates)
    both = expm(np.block([[-rates, drive], [np.zeros((n, n)), rates.T]]) * step)
    transition = both[n:, n:].T
    return transition, transition @ both[:n, n:]


def smooth(y, transition, added, reads, noise, before):
    n, d = len(y), len(transition)
    mean, cov = np.zeros(d), before
    predicted = np.empty((n, d)), np.empty((n, d, d))
    filtered = np.empty((n, d)), np.empty((n, d, d))
    for k in range(n):
        if k > 0:
            mean, cov = transition @ mean, transition @ cov @ transition.T + added
        predicted[0][k], predicted[1][k] = mean, cov
        gain = np.linalg.solve(reads @ cov @ reads.T + noise, reads @ cov).T
        mean, cov = mean + gain @ (y[k] - reads @ mean), cov - gain @ reads @ cov
        filtered[0][k], filtered[1][k] = mean, cov
    out = np.empty((n, 2))
    for k in range(n - 1, -1, -1):
        if k < n - 1:
            gain = np.linalg.solve(predicted[1][k + 1], transition @ filtered[1][k]).T
            mean = filtered[0][k] + gain @ (mean - predicted[0][k + 1])
            cov = filtered[1][k] + gain @ (cov - predicted[1][k + 1]) @ gain.T
        out[k] = mean[0], np.sqrt(cov[0, 0])
    return out


def main():
    data = np.loadtxt(sys.argv[1], delimiter=",", skiprows=1)
    tau1, tau2, noise1, noise2, level, std, corner_hz = map(float, sys.argv[2:9])
    rate = 2 * np.pi * corner_hz
    rates = np.array([[-rate, 0, 0], [1 / tau1, -1 / tau1, 0], [1 / tau2, 0, -1 / tau2]])
    transition, added = discrete(rates, np.diag([2 * rate * std**2, 0, 0]), data[1, 0] - data[0, 0])
    reads, noise = np.array([[0.0, 1, 0], [0, 0, 1]]), np.diag([noise1**2, noise2**2])
    start = time.perf_counter()
    out = smooth(data[:, 1:3] - level, transition, added, reads, noise, np.diag([1.0, 4, 4]) * std**2)
    seconds = time.perf_counter() - start
    print(f"{seconds:.6f} s, mean {level + out[:, 0].mean():.9f} C, last {level + out[-1, 0]:.9f} C")


if __name__ == "__main__":
    main()
