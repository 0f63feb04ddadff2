"""What every plant offers: ``step(state, control, force)``, its variables in groups, and typical controls."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

STEP = 0.01  # s; 20 s of animation are 2,000 physical steps (Grzeszczuk 1998, Sec. 6)


@dataclass(frozen=True)
class Group:
    """Variables of one kind, which are normalised together (Grzeszczuk 1998, App. A).

    Attributes
    ----------
    name : str
        Such as "rate".
    variables : tuple of str
        Names of its variables, in the order of the vector.
    unit : str
        SI unit.
    """

    name: str
    variables: tuple[str, ...]
    unit: str

    @property
    def size(self) -> int:
        """Number of variables."""
        return len(self.variables)


class Plant:
    """A dynamical system ``s(t + dt) = Phi[s(t), u(t), f(t)]`` (Grzeszczuk 1998, Eq. 1).

    Attributes
    ----------
    name : str
    state, control, force : tuple of Group
        Its variables; a passive plant has no control, one without applied forces no force.
    low, high : ndarray, (n_control,)
        Limits of the control inputs.
    frame : str
        Of `anthro.neuroanimator.operators.FRAMES`: what the dynamics are invariant under.
    """

    name: str
    state: tuple[Group, ...]
    control: tuple[Group, ...] = ()
    force: tuple[Group, ...] = ()
    low: np.ndarray = np.zeros(0)
    high: np.ndarray = np.zeros(0)
    frame: str = "fixed"

    @property
    def n_state(self) -> int:
        """Width of a state."""
        return sum(group.size for group in self.state)

    @property
    def n_control(self) -> int:
        """Width of a control vector."""
        return sum(group.size for group in self.control)

    @property
    def n_force(self) -> int:
        """Width of a force vector."""
        return sum(group.size for group in self.force)

    @property
    def variables(self) -> tuple[str, ...]:
        """Names of the state's variables, (n_state,)."""
        return tuple(name for group in self.state for name in group.variables)

    @property
    def rest(self) -> np.ndarray:
        """State (n_state,) of rest, or the one that stands for it where gravity pulls."""
        return np.zeros(self.n_state)

    def advance(self, state: np.ndarray, control: np.ndarray, force: np.ndarray, steps: int) -> np.ndarray:
        """Return the state (n_state,) after some physical steps with the inputs held."""
        raise NotImplementedError

    def start(self, generator: np.random.Generator) -> np.ndarray:
        """Draw a state (n_state,) in which a typical animation begins."""
        raise NotImplementedError

    def typical(self, generator: np.random.Generator) -> TypicalControl:
        """Draw how an animation is typically controlled."""
        return TypicalControl(generator, self.low, self.high)

    def push(self, generator: np.random.Generator) -> np.ndarray:
        """Draw an applied force (n_force,)."""
        return np.zeros(self.n_force)

    def step(self, state, control=None, force=None, steps=1) -> np.ndarray:
        """Advance one state or many.

        Parameters
        ----------
        state : ndarray, (n_state,) or (n, n_state)
        control, force : ndarray, (n_control,), (n_force,), or n of them; None: zero
            Held over the steps.
        steps : int or ndarray of int, (n,)
            Physical steps of `STEP`, for all or for each state.

        Returns
        -------
        ndarray, as `state`
            A new array.

        Raises
        ------
        ValueError
            When a width does not fit.
        """
        states = np.atleast_2d(np.asarray(state, float))
        if states.shape[1] != self.n_state:
            raise ValueError(f"{self.name}: a state of {states.shape[1]} variables, not {self.n_state}")
        controls, forces = (
            self._rows(given, len(states), width) for given, width in ((control, self.n_control), (force, self.n_force))
        )
        counts = np.broadcast_to(steps, len(states))
        out = np.array([self.advance(*row) for row in zip(states, controls, forces, counts, strict=True)])
        return out.reshape(np.shape(state))

    def _rows(self, values, count: int, width: int) -> np.ndarray:
        if values is None:
            return np.zeros((count, width))
        values = np.asarray(values, float)
        if values.shape[-1] != width:
            raise ValueError(f"{self.name}: {values.shape[-1]} inputs where {width} are wanted")
        return np.broadcast_to(values, (count, width))


class TypicalControl:
    """Controls as they occur: half of all animations are driven by waves, half by steps of random height and length.

    Parameters
    ----------
    generator : numpy.random.Generator
    low, high : ndarray, (n_control,)
        Limits.
    phases : ndarray, (n_control,), optional
        How much each input lags behind in a wave, rad; coordinated ones of a swimmer. Drawn if not given.
    """

    FREQUENCIES = (0.03, 0.5)  # Hz; no more than half a wave in two super-steps of 0.5 s
    KEEP = 0.9  # largest share of moments at which a step goes on

    def __init__(self, generator: np.random.Generator, low, high, phases=None):
        self._generator, self._low, self._high = generator, np.asarray(low), np.asarray(high)
        size = len(self._low)
        self._wave = generator.random() < 0.5
        self._amplitude = generator.uniform(0.3, 1.0) * generator.uniform(0.5, 1.0, size)
        self._speed = 2 * np.pi * np.exp(generator.uniform(*np.log(self.FREQUENCIES)))
        drawn = generator.uniform(0, 2 * np.pi, size)
        self._phases = drawn if phases is None else phases + drawn[:1]
        self._offset = generator.uniform(-0.3, 0.3, size)
        self._held, self._keep = self._draw(), generator.uniform(0.0, self.KEEP)

    def _draw(self) -> np.ndarray:
        return self._generator.uniform(-1.0, 1.0, len(self._low)) * self._amplitude

    def at(self, time: float, state: np.ndarray) -> np.ndarray:
        """Return the inputs (n_control,) at a time (s); `state` is there for those that steer by it."""
        if self._wave:
            relative = self._amplitude * np.sin(self._speed * time - self._phases) + self._offset
        else:
            if self._generator.random() > self._keep:
                self._held = self._draw()
            relative = self._held
        middle, half = (self._high + self._low) / 2, (self._high - self._low) / 2
        return middle + half * np.clip(relative, -1.0, 1.0)


class RigidPlant(Plant):
    """A plant that MuJoCo integrates: ``state`` is its positions, then its velocities."""

    def __init__(self, xml: str):
        self.model = mujoco.MjModel.from_xml_string(xml)
        self.data = mujoco.MjData(self.model)

    def enter(self, control: np.ndarray, force: np.ndarray) -> None:
        """Hand control and force to the simulator."""
        self.data.ctrl[:] = control

    def advance(self, state: np.ndarray, control: np.ndarray, force: np.ndarray, steps: int) -> np.ndarray:
        """See `Plant.advance`."""
        data, positions = self.data, self.model.nq
        data.qpos[:], data.qvel[:] = state[:positions], state[positions:]
        self.enter(control, force)
        mujoco.mj_step(self.model, data, nstep=int(steps))
        return np.concatenate([data.qpos, data.qvel])

    def energy(self, state: np.ndarray) -> float:
        """Kinetic and potential energy of a state, J."""
        data, positions = self.data, self.model.nq
        data.qpos[:], data.qvel[:] = state[:positions], state[positions:]
        mujoco.mj_forward(self.model, data)
        mujoco.mj_energyPos(self.model, data)
        mujoco.mj_energyVel(self.model, data)
        return float(data.energy.sum())
