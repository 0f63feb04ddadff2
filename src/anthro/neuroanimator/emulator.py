"""Emulators: a trained network between its operators (Grzeszczuk 1998, Fig. 4 and 6c)."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path

import numpy as np

from anthro.errors import UserError
from anthro.files import read_shard
from anthro.motor.network import FeedForward
from anthro.neuroanimator import kernels
from anthro.neuroanimator.operators import FACTORS, Chain, Frame, Inverse, Normalise, StateChange, ToLocal, ToWorld
from anthro.neuroanimator.plants.plant import Plant


class Diverged(UserError):
    """A rollout that left what its network was trained for.

    Attributes
    ----------
    states : ndarray, (steps, n_state)
        Those before.
    """

    def __init__(self, name: str, variable: str, states: np.ndarray):
        super().__init__(f"{name}: the rollout diverges at super-step {len(states) - 1}: {variable}")
        self.states = states


class Emulator:
    """A network that advances a state by one super-step (Grzeszczuk 1998, Eq. 9).

    Parameters
    ----------
    name : str
        The net's.
    network : FeedForward
        One hidden layer of sigmoids between inputs and outputs of zero mean and unit variance.
    frame : Frame
        Local coordinates of the state.
    factors : dict of str to ndarray
        `FACTORS`: mean and scale of each input and output in local coordinates.
    variables : tuple of str
        Names of the state's variables.

    Raises
    ------
    ValueError
        When the network is no such network, or a width does not fit.
    """

    def __init__(self, name: str, network: FeedForward, frame: Frame, factors: dict, variables: tuple[str, ...]):
        if network.activation != "sigmoid" or len(network.matrices) != 2:
            raise ValueError(f"{name}: an emulator has one hidden layer of sigmoids")
        if len(factors["input_mean"]) != network.n_in or len(factors["output_mean"]) != len(frame.rest):
            raise ValueError(f"{name}: operators and network do not fit together")
        self.name, self.network, self.frame, self.factors, self.variables = name, network, frame, factors, variables
        self.n_state, self.n_input = len(frame.rest), network.n_in - len(frame.rest)
        self.inputs = Chain(ToLocal(frame), Normalise(factors["input_mean"], factors["input_scale"]))
        unnormalise = Inverse(Normalise(factors["output_mean"], factors["output_scale"]))
        self.outputs = Chain(unnormalise, ToWorld(frame), StateChange(frame))

    @cached_property
    def folded(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Weights and biases of both layers with the normalisation in them, in double precision."""
        return fold(self.network, self.factors)

    @cached_property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Least and largest local state (n_state,) that still counts as near the training data."""
        n = self.n_state
        mean, reach = self.factors["input_mean"][:n], kernels.FAR * self.factors["input_scale"][:n]
        return mean - reach, mean + reach

    def step(self, state: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        """Advance many states at once by a super-step.

        Parameters
        ----------
        state : ndarray, (n, n_state)
        inputs : ndarray, (n, n_input)
            Applied forces, then controls.

        Returns
        -------
        ndarray, (n, n_state)
        """
        local = np.concatenate([self.frame.local(state), inputs], axis=1)
        changes = self.frame.turn(kernels.forward_all(self.folded, local), state)
        changes += state
        return self.frame.settle(changes)

    def rollout(self, state: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        """Emulate one trajectory, compiled.

        Parameters
        ----------
        state : ndarray, (n_state,)
        inputs : ndarray, (steps, n_input)
            Applied forces, then controls, of each super-step.

        Returns
        -------
        ndarray, (steps + 1, n_state)

        Raises
        ------
        Diverged
            Naming the super-step and the variable, when it leaves what the network was trained for, or is not finite.
        """
        states = np.empty((len(inputs) + 1, self.n_state))
        states[0] = state
        inputs = np.ascontiguousarray(inputs, float)
        step, odd = kernels.rollout(self.frame.kind, self.frame.rest, self.folded, *self.bounds, inputs, states)
        if step >= 0:
            raise Diverged(self.name, self.variables[odd], states[: step + 1])
        return states

    def slopes(self, states: np.ndarray, inputs: np.ndarray, by_states: np.ndarray) -> np.ndarray:
        """Backpropagate an objective through a rollout (Grzeszczuk 1998, Sec. 4.3).

        Parameters
        ----------
        states : ndarray, (steps + 1, n_state)
            Of `rollout`.
        inputs : ndarray, (steps, n_input)
        by_states : ndarray, (steps + 1, n_state)
            The objective's own derivative by each state.

        Returns
        -------
        ndarray, (steps, n_input)
            The derivative by each input.
        """
        inputs, by_states = np.ascontiguousarray(inputs, float), np.ascontiguousarray(by_states, float)
        return kernels.through_time(self.frame.kind, self.frame.rest, self.folded, inputs, states, by_states)


def fold(network: FeedForward, factors: dict) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return a network's weights and biases with the normalisation in them: (n_in, n_hidden), ..., (n_out,)."""
    (first, last), (bias, last_bias) = network.matrices, network.biases
    into = np.ascontiguousarray(first.T / factors["input_scale"][:, None], dtype=float)
    out_of = np.ascontiguousarray(last.T * factors["output_scale"], dtype=float)
    return (
        into,
        bias - factors["input_mean"] @ into,
        out_of,
        last_bias * factors["output_scale"] + factors["output_mean"],
    )


def load_emulator(run: Path, net: str, plant: Plant) -> Emulator:
    """Read the emulator of a plant that one network emulates.

    Raises
    ------
    UserError
        Naming the file, when one is missing or is not what it should be.
    """
    try:
        network, factors = read_parts(run, net)
        return Emulator(net, network, Frame(plant.frame, plant.rest), factors, plant.variables)
    except ValueError as error:
        raise UserError(str(error)) from None


def read_parts(run: Path, net: str) -> tuple[FeedForward, dict]:
    """Read a trained net of a run and its operators' factors.

    Raises
    ------
    UserError
        Naming the file, when one is missing or is not what it should be.
    """
    folder = Path(run) / "neuroanimator"
    factors, _ = read_shard(folder / "pairs" / net / "operators.h5", FACTORS)
    widths = len(factors["input_mean"]), len(factors["output_mean"])
    return FeedForward.load(folder / "nets" / net / "weights.h5", *widths), factors
