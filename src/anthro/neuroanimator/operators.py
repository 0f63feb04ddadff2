"""The operators around an emulator's network (Grzeszczuk 1998, Fig. 6 and 9, App. A): invertible, and composed.

Each has ``apply(values, state)`` and ``invert(values, state)``, one undoing the other; `state` (n, n_state) is the
state at time t that fixes the frame. Figure 6(c) is ``inputs.apply``, the network, ``outputs.apply``; Figure 9, which
makes training pairs, is ``inputs.apply`` and ``outputs.invert``.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numba import njit

from anthro.neuroanimator import frames

FACTORS = ("input_mean", "input_scale", "output_mean", "output_scale")  # of a network's operators
CONSTANT = 1e-9  # standard deviation under which a group does not vary


@njit(cache=True)
def _localise(kind, states, rest, out):
    for i in range(len(states)):
        frames.localise(kind, states[i], rest, out[i])


@njit(cache=True)
def _turn(kind, states, changes, inward, out):
    for i in range(len(states)):
        if inward:
            frames.turn_in(kind, states[i], changes[i], out[i])
        else:
            frames.turn_out(kind, states[i], changes[i], out[i])


@njit(cache=True)
def _settle(kind, states):
    for i in range(len(states)):
        frames.settle(kind, states[i])


class Frame:
    """The local coordinate system of a kind of state.

    Parameters
    ----------
    name : str
        Of `frames.FRAMES`.
    rest : ndarray, (n_state,)
        The state at rest; local states are differences from its local state.
    """

    def __init__(self, name: str, rest: np.ndarray):
        self.kind, width = frames.FRAMES[name], len(rest)
        self.rest = np.zeros(width)
        self.rest = self.local(np.asarray(rest, float)[None])[0]

    def local(self, states: np.ndarray) -> np.ndarray:
        """Return states (n, n_state) in local coordinates."""
        out = np.empty(states.shape)
        _localise(self.kind, np.ascontiguousarray(states, float), self.rest, out)
        return out

    def turn(self, changes: np.ndarray, states: np.ndarray, inward: bool = False) -> np.ndarray:
        """Return changes (n, n_state) of states from local to world coordinates, or back if `inward`."""
        out = np.empty(states.shape)
        changes, states = (np.ascontiguousarray(values, float) for values in (changes, states))
        _turn(self.kind, states, changes, inward, out)
        return out

    def settle(self, states: np.ndarray) -> np.ndarray:
        """Return states (n, n_state) whose quaternions have unit length."""
        states = np.array(states, float, order="C")
        _settle(self.kind, states)
        return states


class ToLocal:
    """``T'_x``: the state at the head of inputs (n, n_state + n_force + n_control) becomes local; the rest stays."""

    def __init__(self, frame: Frame):
        self.frame = frame

    def apply(self, values: np.ndarray, state: np.ndarray) -> np.ndarray:
        """World to local."""
        width = state.shape[1]
        return np.concatenate([self.frame.local(values[:, :width]), values[:, width:]], axis=1)

    def invert(self, values: np.ndarray, state: np.ndarray) -> np.ndarray:
        """Local to world: the pose that is lost locally is that of `state`."""
        width = state.shape[1]
        gap = values[:, :width] - self.frame.local(state)
        return np.concatenate([state + self.frame.turn(gap, state), values[:, width:]], axis=1)


class ToWorld:
    """``T'_y``: local changes of state (n, n_state) become world changes."""

    def __init__(self, frame: Frame):
        self.frame = frame

    def apply(self, values: np.ndarray, state: np.ndarray) -> np.ndarray:
        """Local to world."""
        return self.frame.turn(values, state)

    def invert(self, values: np.ndarray, state: np.ndarray) -> np.ndarray:
        """World to local."""
        return self.frame.turn(values, state, inward=True)


class StateChange:
    """``T^Delta_y``: a change of state becomes the next state, ``s + ds``; its quaternions get unit length."""

    def __init__(self, frame: Frame):
        self.frame = frame

    def apply(self, values: np.ndarray, state: np.ndarray) -> np.ndarray:
        """From change to next state."""
        return self.frame.settle(state + values)

    def invert(self, values: np.ndarray, state: np.ndarray) -> np.ndarray:
        """From next state to change."""
        return values - state


class Normalise:
    """``T^sigma_x``: groups of variables get zero mean and unit variance (Grzeszczuk 1998, Eq. 16 to 19).

    All variables of a group share one mean and one standard deviation. Equation 18 as printed divides by
    ``(N - 1)(K - 1)``, which is no unit variance, as the text wants, and is nothing for a group of one
    variable; here the variance is over all N K values, and its root divides.

    Parameters
    ----------
    mean, scale : ndarray, (n_variables,)
        Of each variable, equal within a group.
    """

    def __init__(self, mean: np.ndarray, scale: np.ndarray):
        self.mean, self.scale = np.asarray(mean, float), np.asarray(scale, float)

    @classmethod
    def fit(cls, values: np.ndarray, sizes: Sequence[int]) -> Normalise:
        """Measure groups of `sizes` variables of examples (n, width); one that does not vary keeps its scale.

        Raises
        ------
        ValueError
            When the sizes do not add up to the width.
        """
        if sum(sizes) != values.shape[1]:
            raise ValueError(f"groups of {list(sizes)} variables for {values.shape[1]} columns")
        parts = np.split(values, np.cumsum(sizes)[:-1], axis=1)
        mean = [float(part.mean()) for part in parts]
        scale = [float(part.std()) for part in parts]
        scale = [1.0 if value < CONSTANT else value for value in scale]
        return cls(np.repeat(mean, sizes), np.repeat(scale, sizes))

    def apply(self, values: np.ndarray, state: np.ndarray | None = None) -> np.ndarray:
        """To zero mean and unit variance."""
        return (values - self.mean) / self.scale

    def invert(self, values: np.ndarray, state: np.ndarray | None = None) -> np.ndarray:
        """Back to physical units."""
        return values * self.scale + self.mean


class Inverse:
    """Another operator the other way round, such as ``T^sigma_y``, which unnormalises."""

    def __init__(self, operator):
        self.apply, self.invert = operator.invert, operator.apply


class Chain:
    """Operators one after the other; inverted, the last comes first."""

    def __init__(self, *operators):
        self.operators = operators

    def apply(self, values: np.ndarray, state: np.ndarray) -> np.ndarray:
        """First to last."""
        for operator in self.operators:
            values = operator.apply(values, state)
        return values

    def invert(self, values: np.ndarray, state: np.ndarray) -> np.ndarray:
        """Last to first."""
        for operator in reversed(self.operators):
            values = operator.invert(values, state)
        return values
