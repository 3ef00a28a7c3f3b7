"""Fit of a damped cosine to a swing, whose period and decrement tests compare."""

from types import SimpleNamespace

import numpy as np
from scipy.optimize import least_squares


def fit_swing(times, displacements):
    """Period [s] and logarithmic decrement of ``exp(-a t) (A cos w t + B sin w t) + C`` by least squares."""
    t, x = times - times[0], (displacements - displacements.mean()) / np.std(displacements)

    def left(guess):
        wave = np.exp((1j * guess[1] - guess[0]) * t)
        basis = np.stack([wave.real, wave.imag, np.ones_like(t)], axis=1)
        return x - basis @ np.linalg.lstsq(basis, x, rcond=None)[0]

    even = np.interp(np.linspace(0, t[-1], len(t)), t, x)
    start = 2 * np.pi * max(1, int(np.abs(np.fft.rfft(even, 8 * len(t))).argmax())) / (8 * t[-1])
    found = least_squares(left, (0.05 * start, start), bounds=([-5 / t[-1], 0], np.inf), x_scale=start, xtol=1e-12)
    decay, frequency = found.x
    return SimpleNamespace(period=2 * np.pi / frequency, decrement=2 * np.pi * decay / frequency)
