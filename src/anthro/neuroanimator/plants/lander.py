"""The lunar lander: a rigid body under gravity with a main rocket thruster and three attitude jets."""

from __future__ import annotations

import numpy as np

from anthro.neuroanimator.frames import FRAMES, localise
from anthro.neuroanimator.plants.plant import STEP, Group, RigidPlant, TypicalControl

GRAVITY = 1.62  # m/s^2, of the Moon
MASS = 2000.0  # kg
INERTIA = 2000.0  # kg m^2
THRUST = 2.0 * MASS * GRAVITY  # N, main rocket, along the body's z
JET = 600.0  # N m, each attitude jet: about the body's x, y and z
GYRO = 2000.0  # N m s, its gyroscopes' resistance to spin; without them 20 s of open control are hopeless
SIDE = 2.0  # m, half its width
HEIGHT = 2.0  # m, of the centre of mass above its feet

XML = (
    f'<mujoco><option timestep="{STEP}" integrator="implicitfast" gravity="0 0 {-GRAVITY}"/><worldbody>'
    f'<body name="lander"><freejoint/><inertial pos="0 0 0" mass="{MASS}" diaginertia="{INERTIA} {INERTIA} {INERTIA}"/>'
    '<site name="centre"/></body></worldbody><actuator>'
    f'<motor site="centre" gear="0 0 {THRUST} 0 0 0"/><motor site="centre" gear="0 0 0 {JET} 0 0"/>'
    f'<motor site="centre" gear="0 0 0 0 {JET} 0"/><motor site="centre" gear="0 0 0 0 0 {JET}"/>'
    "</actuator></mujoco>"
)


class _Piloted(TypicalControl):
    """Random jets, held in bounds: a pilot who tilts against a drift, and lets no descent run away."""

    DRIFT, TILT, SPIN, DESCENT = 0.1, 0.7, 1.0, 0.2  # gains: rad s/m, and shares of the limits by rad, rad/s, m/s

    def at(self, time: float, state: np.ndarray) -> np.ndarray:
        """See `TypicalControl`."""
        local, drawn = np.empty(len(state)), super().at(time, state)
        localise(FRAMES["heading"], np.asarray(state, float), np.zeros(len(state)), local)
        tilt = 2.0 * local[4:6] - self.DRIFT * np.array([local[8], -local[7]])
        drawn[0] -= self.DESCENT * local[9]
        drawn[1:3] -= self.TILT * tilt
        drawn[1:] -= self.SPIN * local[10:13]
        return np.clip(drawn, self._low, self._high)


class Lander(RigidPlant):
    """Position, quaternion (w first), velocity in the world, angular velocity in the body; 13 variables.

    The surface is where its flights end, and no part of the dynamics: nothing is told of a contact, and 13
    state inputs leave no room for one.
    """

    name = "lander"
    state = (
        Group("place", ("x", "y", "z"), "m"),
        Group("attitude", ("qw", "qx", "qy", "qz"), "1"),
        Group("velocity", ("velocity x", "velocity y", "velocity z"), "m/s"),
        Group("spin", ("spin x", "spin y", "spin z"), "rad/s"),
    )
    control = (Group("rocket", ("rocket",), "1"), Group("jets", ("jet x", "jet y", "jet z"), "1"))
    low, high = np.array([0.0, -1.0, -1.0, -1.0]), np.ones(4)
    frame = "heading"

    def __init__(self):
        super().__init__(XML)
        self.model.dof_damping[3:] = GYRO

    @property
    def rest(self) -> np.ndarray:
        """Upright at the origin."""
        state = np.zeros(self.n_state)
        state[3] = 1.0
        return state

    def start(self, generator: np.random.Generator) -> np.ndarray:
        """Aloft, tilted and moving at random, with any heading."""
        tilt = np.array([1.0, *generator.uniform(-0.2, 0.2, 2), 0.0])
        turn = generator.uniform(-np.pi, np.pi) / 2
        w, x, y, _ = tilt / np.linalg.norm(tilt)
        c, s = np.cos(turn), np.sin(turn)
        quaternion = [c * w, c * x - s * y, c * y + s * x, s * w]
        place, velocity = generator.uniform(-20, 20, 3), generator.uniform(-2, 2, 3)
        return np.array([*place, *quaternion, *velocity, *generator.uniform(-0.2, 0.2, 3)])

    def typical(self, generator: np.random.Generator) -> TypicalControl:
        """Jets fired at random by a pilot who stays upright."""
        return _Piloted(generator, self.low, self.high)
