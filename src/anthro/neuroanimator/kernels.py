"""Compiled emulation of one trajectory: the network's forward pass, rollouts, and backpropagation through time."""

from __future__ import annotations

import numpy as np
from numba import njit

from anthro.neuroanimator.frames import localise, localise_back, settle, settle_back, turn_out, turn_out_back

FAR = 40.0  # standard deviations of the training data beyond which a rollout counts as diverged


@njit(cache=True, fastmath={"contract", "reassoc"}, error_model="numpy")
def forward(into, bias, out_of, out_bias, x, hidden, y):
    """One hidden layer of sigmoids (Grzeszczuk 1998, App. C): weights (n_in, n_hidden) and (n_hidden, n_out)."""
    hidden[:] = bias
    for k in range(len(x)):
        row, value = into[k], x[k]
        for j in range(len(hidden)):
            hidden[j] += value * row[j]
    y[:] = out_bias
    for j in range(len(hidden)):
        hidden[j] = 1.0 / (1.0 + np.exp(-hidden[j]))
        row, value = out_of[j], hidden[j]
        for i in range(len(y)):
            y[i] += value * row[i]


def forward_all(net, x: np.ndarray) -> np.ndarray:
    """The same pass for many inputs (n, n_in) at once: outputs (n, n_out)."""
    into, bias, out_of, out_bias = net
    hidden = x @ into
    hidden += bias
    np.negative(hidden, out=hidden)
    np.exp(hidden, out=hidden)
    hidden += 1.0
    np.reciprocal(hidden, out=hidden)
    y = hidden @ out_of
    y += out_bias
    return y


@njit(cache=True, fastmath={"contract", "reassoc"})
def backward(into, out_of, hidden, by_y, by_x):
    """Write the derivative by the inputs (n_in,), given that by the outputs (n_out,)."""
    slope = np.empty(len(hidden))
    for j in range(len(hidden)):
        row, total = out_of[j], 0.0
        for i in range(len(by_y)):
            total += row[i] * by_y[i]
        slope[j] = total * hidden[j] * (1.0 - hidden[j])
    for k in range(len(by_x)):
        row, total = into[k], 0.0
        for j in range(len(hidden)):
            total += row[j] * slope[j]
        by_x[k] = total


@njit(cache=True)
def outside(x, low, high):
    """Index of the first input that is not finite or far from the training data; -1 if all are near."""
    for k in range(len(low)):
        if not (low[k] <= x[k] <= high[k]):
            return k
    return -1


@njit(cache=True)
def rollout(kind, rest, net, low, high, inputs, states):
    """Emulate: fill ``states`` (T + 1, n), the first given, from ``inputs`` (T, forces and controls).

    Returns step and variable at which it diverged, or (-1, -1).
    """
    into, bias, out_of, out_bias = net
    n = states.shape[1]
    x, hidden, y, change = np.empty(len(into)), np.empty(len(bias)), np.empty(len(out_bias)), np.empty(n)
    for t in range(len(inputs)):
        localise(kind, states[t], rest, x)
        odd = outside(x, low, high)
        if odd >= 0:
            return t, odd
        x[n:] = inputs[t]
        forward(into, bias, out_of, out_bias, x, hidden, y)
        turn_out(kind, states[t], y, change)
        for i in range(n):
            states[t + 1, i] = states[t, i] + change[i]
        settle(kind, states[t + 1])
    localise(kind, states[-1], rest, x)
    odd = outside(x, low, high)
    return (len(inputs), odd) if odd >= 0 else (-1, -1)


@njit(cache=True)
def through_time(kind, rest, net, inputs, states, by_states):
    """Derivative (T, forces and controls) by the inputs of a rollout (Grzeszczuk 1998, Sec. 4.3 and Fig. 11).

    ``by_states`` (T + 1, n) is the objective's own derivative by each state.
    """
    into, bias, out_of, out_bias = net
    n = states.shape[1]
    x, hidden, y, change = np.empty(len(into)), np.empty(len(bias)), np.empty(len(out_bias)), np.empty(n)
    by_x, by_y, by_state, slope = np.empty(len(into)), np.empty(len(out_bias)), np.empty(n), by_states[-1].copy()
    by_inputs = np.empty(inputs.shape)
    for t in range(len(inputs) - 1, -1, -1):
        localise(kind, states[t], rest, x)
        x[n:] = inputs[t]
        forward(into, bias, out_of, out_bias, x, hidden, y)
        turn_out(kind, states[t], y, change)
        for i in range(n):
            change[i] += states[t, i]
        settle_back(kind, change, slope)
        by_state[:] = slope
        by_y[:] = 0.0
        turn_out_back(kind, states[t], y, slope, by_state, by_y)
        backward(into, out_of, hidden, by_y, by_x)
        localise_back(kind, states[t], by_x, by_state)
        by_inputs[t] = by_x[n:]
        for i in range(n):
            slope[i] = by_state[i] + by_states[t, i]
    return by_inputs
