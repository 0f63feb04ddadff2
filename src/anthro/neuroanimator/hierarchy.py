"""The dolphin's emulator: one global net for the six segments' frames, six local nets for the masses in them.

Grzeszczuk 1998, Sec. 3.3 and Table 1. A local net is told its masses' state in the frame of their segment, where all
segments' centres are and how they move in it, and the muscles' activation. Its state stays hierarchical from step to
step; masses are put together from it when they are wanted, or when they are regularised (Sec. 5.3).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numba import njit

from anthro.errors import UserError
from anthro.neuroanimator import segments
from anthro.neuroanimator.emulator import Diverged, Emulator, fold, read_parts
from anthro.neuroanimator.frames import localise, settle, turn_out
from anthro.neuroanimator.kernels import forward, forward_all, outside
from anthro.neuroanimator.operators import Frame
from anthro.neuroanimator.plants import plant_of
from anthro.neuroanimator.plants.dolphin import CONTRACTION, NODES, Dolphin, spring_forces
from anthro.neuroanimator.plants.plant import STEP
from anthro.neuroanimator.segments import Segments

REGULARISATIONS = 5  # explicit Euler steps after each super-step
SOFTER = 0.1  # of the plant's stiffness, so that an explicit step is stable
DAMPING = 30.0  # N s/m, less than the plant's, with which an explicit step is not stable


@njit(cache=True)
def _regularise(x, v, contraction, mass, pairs, owner, rest, stiffness, count):
    """Regularise places and velocities (23, 3) by explicit Euler steps of springs and dampers, in place.

    Springs pull places back from rest, dampers slow how masses move against each other. Forces of springs do
    not stay in the velocities, and the motion as a whole is left to the emulator, which has made both already.
    """
    force, back, slack = np.empty((NODES, 3)), np.zeros((NODES, 3)), np.zeros(len(pairs))
    for _ in range(count):
        force[:] = 0.0
        spring_forces(x, back, contraction, pairs, owner, rest, stiffness, DAMPING, force)
        for i in range(NODES):
            for a in range(3):
                back[i, a] += STEP * force[i, a] / mass[i]
                x[i, a] += STEP * back[i, a]
        force[:] = 0.0
        spring_forces(x, v, contraction, pairs, owner, rest, slack, DAMPING, force)
        for i in range(NODES):
            for a in range(3):
                v[i, a] += STEP * force[i, a] / mass[i]


@njit(cache=True)
def _rollout(rest, net, low, high, local_nets, layout, springs, spacing, count, controls, frames, locals_):
    """Fill ``frames`` (T + 1, 78) and ``locals_`` (T + 1, n_local), the first given; returns as `kernels.rollout`."""
    into, bias, out_of, out_bias = net
    l_into, l_bias, l_out_of, l_out_bias = local_nets
    mass, members, counts, along, across, shape, shared = layout
    pairs, owner, lengths, stiffness = springs
    n = frames.shape[1]
    x, hidden, y, change = np.empty(len(into)), np.empty(len(bias)), np.empty(n), np.empty(n)
    told, felt, moved = np.empty(l_into.shape[1]), np.empty(l_into.shape[2]), np.empty(l_out_of.shape[2])
    state = np.empty(6 * NODES)
    for t in range(len(controls)):
        localise(3, frames[t], rest, x)
        odd = outside(x, low, high)
        if odd >= 0:
            return t, odd
        x[n:] = controls[t]
        forward(into, bias, out_of, out_bias, x, hidden, y)
        turn_out(3, frames[t], y, change)
        for i in range(n):
            frames[t + 1, i] = frames[t, i] + change[i]
        settle(3, frames[t + 1])
        place = 0
        for j in range(segments.COUNT):
            width = segments.LOCAL * counts[j]
            wide = width + segments.CENTRES
            told[:width] = locals_[t, place : place + width]
            segments.centres(frames[t], j, spacing[j], told[width:wide])
            told[wide : wide + controls.shape[1]] = controls[t]
            wide += controls.shape[1]
            forward(
                l_into[j, :wide],
                l_bias[j],
                l_out_of[j, :, :width],
                l_out_bias[j, :width],
                told[:wide],
                felt,
                moved[:width],
            )
            for i in range(width):
                locals_[t + 1, place + i] = locals_[t, place + i] + moved[i]
            place += width
        if count:
            segments.assemble(frames[t + 1], locals_[t + 1], members, counts, shape, shared, state)
            positions, speeds = state[: 3 * NODES].reshape(NODES, 3), state[3 * NODES :].reshape(NODES, 3)
            shortening = CONTRACTION * np.minimum(np.maximum(controls[t], 0.0), 1.0)
            _regularise(positions, speeds, shortening, mass, pairs, owner, lengths, stiffness, count)
            like = frames[t + 1].copy()
            segments.split(state, like, mass, members, counts, along, across, shape, frames[t + 1], locals_[t + 1])
    localise(3, frames[-1], rest, x)
    odd = outside(x, low, high)
    return (len(controls), odd) if odd >= 0 else (-1, -1)


def load_dolphin(run: Path, steps: int) -> HierarchicalEmulator:
    """Read the dolphin's seven networks of a run.

    Raises
    ------
    UserError
        Naming the file, when one is missing or is not what it should be.
    """
    plant = plant_of("dolphin")
    try:
        parts = [read_parts(run, f"dolphin_local{j}_n{steps}") for j in range(1, segments.COUNT + 1)]
        return HierarchicalEmulator(plant, load_global(run, steps), parts)
    except ValueError as error:
        raise UserError(str(error)) from None


def load_global(run: Path, steps: int) -> Emulator:
    """Read the emulator of the frames alone, which suffices to learn swimming (Grzeszczuk 1998, Sec. 6)."""
    name, parts = f"dolphin_global_n{steps}", Segments(plant_of("dolphin"))
    network, factors = read_parts(run, name)
    variables = tuple(variable for group in parts.groups for variable in group.variables)
    return Emulator(name, network, Frame("body", parts.rest), factors, variables)


class HierarchicalEmulator:
    """The whole dolphin's emulator.

    Parameters
    ----------
    plant : Dolphin
    whole : Emulator
        Of the frames.
    parts : sequence of (FeedForward, dict)
        Net and factors of each segment, head to tail.
    """

    def __init__(self, plant: Dolphin, whole: Emulator, parts):
        self.plant, self.whole = plant, whole
        self.segments = Segments(plant)
        self._nets = [fold(*part) for part in parts]
        self._local = self._padded()

    def _padded(self) -> tuple[np.ndarray, ...]:
        """All local nets in arrays of the widest one's size."""
        nets = self._nets
        wide, deep = max(len(net[0]) for net in nets), max(len(net[3]) for net in nets)
        count, units = len(nets), len(nets[0][1])
        into, bias = np.zeros((count, wide, units)), np.zeros((count, units))
        out_of, out_bias = np.zeros((count, units, deep)), np.zeros((count, deep))
        for j, net in enumerate(nets):
            into[j, : len(net[0])], bias[j] = net[0], net[1]
            out_of[j, :, : len(net[3])], out_bias[j, : len(net[3])] = net[2], net[3]
        return into, bias, out_of, out_bias

    def emulate(self, state: np.ndarray, controls: np.ndarray, regularisations: int = 0):
        """Emulate hierarchically: frames (steps + 1, 78) and local states (steps + 1, n_local).

        Raises
        ------
        Diverged
            Naming the super-step and the variable.
        """
        parts, plant = self.segments, self.plant
        first = parts.split(np.asarray(state, float)[None])
        frames, local = (np.concatenate([f, np.empty((len(controls), f.shape[1]))]) for f in first)
        layout = parts.mass, parts.members, parts.counts, parts.along, parts.across, parts.shape, parts.shared
        springs = plant.pairs, plant.owner, plant.lengths, SOFTER * plant.stiffness
        whole = self.whole
        step, odd = _rollout(
            whole.frame.rest,
            whole.folded,
            *whole.bounds,
            self._local,
            layout,
            springs,
            parts.spacing,
            regularisations,
            np.ascontiguousarray(controls, float),
            frames,
            local,
        )
        if step >= 0:
            reached = parts.assemble(frames[: step + 1], local[: step + 1])
            raise Diverged(whole.name, whole.variables[odd], reached)
        return frames, local

    def rollout(self, state: np.ndarray, controls: np.ndarray, regularisations: int = 0) -> np.ndarray:
        """Emulate one trajectory of masses, (steps + 1, 138), with so many regularisations after each super-step.

        Raises
        ------
        Diverged
            As `emulate`.
        """
        return self.segments.assemble(*self.emulate(state, controls, regularisations))

    def step(self, frames: np.ndarray, local: np.ndarray, controls: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Advance many hierarchical states, (n, 78) and (n, n_local), at once by a super-step."""
        after = np.empty_like(local)
        for j, (net, place) in enumerate(zip(self._nets, self.segments.places, strict=True)):
            told = np.concatenate([self.segments.local_inputs(frames, local, j), controls], axis=1)
            after[:, place] = local[:, place] + forward_all(net, told)
        return self.whole.step(frames, controls), after
