"""The three-link pendulum of Fig. 5(a): friction and motor torques at its joints, forces applied on its links."""

from __future__ import annotations

import numpy as np

from anthro.neuroanimator.plants.plant import STEP, Group, RigidPlant

LINKS = 3
LENGTH = 1.0  # m, of a link
MASS = 1.0  # kg, of a link
FRICTION = 2.0  # N m s, of a joint
TORQUES = (8.0, 4.0, 1.5)  # N m, what each motor can do at most
PUSH = 3.0  # N, largest force that is applied on a link
JOINTS = tuple(str(joint) for joint in range(1, LINKS + 1))


def _xml(friction: float) -> str:
    """Links hang below each other; angle 0 points down, and positive angles to the right (+x), seen along +y."""
    links = ""
    for joint in reversed(JOINTS):
        below = "0 0 0" if joint == "1" else f"0 0 {-LENGTH}"
        links = (
            f'<body name="link{joint}" pos="{below}"><joint name="{joint}" axis="0 -1 0" damping="{friction}"/>'
            f'<geom type="capsule" size="0.05" fromto="0 0 0 0 0 {-LENGTH}" mass="{MASS}"/>{links}</body>'
        )
    motors = "".join(f'<motor joint="{joint}"/>' for joint in JOINTS)
    return (
        f'<mujoco><option timestep="{STEP}" integrator="implicitfast"><flag contact="disable"/></option>'
        f"<worldbody>{links}</worldbody><actuator>{motors}</actuator></mujoco>"
    )


def points_of(state: np.ndarray) -> np.ndarray:
    """Ends of the links of states (..., 6), hinge first, (..., 4, 2) m: to the right and up."""
    angles = np.cumsum(state[..., :LINKS], axis=-1)
    steps = LENGTH * np.stack([np.sin(angles), -np.cos(angles)], axis=-1)
    return np.concatenate([np.zeros_like(steps[..., :1, :]), np.cumsum(steps, axis=-2)], axis=-2)


class Pendulum(RigidPlant):
    """Angles of each joint relative to the link above it, then their rates.

    Parameters
    ----------
    motors : bool
        Whether its joints have motors; without them it is passive.
    forced : bool
        Whether a horizontal force (N) is applied on the middle of each link.
    friction : float
        Viscous friction of each joint, N m s.
    """

    state = (
        Group("angle", tuple(f"angle {joint}" for joint in JOINTS), "rad"),
        Group("rate", tuple(f"rate {joint}" for joint in JOINTS), "rad/s"),
    )

    def __init__(self, motors: bool = True, forced: bool = False, friction: float = FRICTION):
        super().__init__(_xml(friction))
        self.name = "forced_pendulum" if forced else "active_pendulum" if motors else "passive_pendulum"
        if motors:
            self.control = (Group("torque", tuple(f"torque {joint}" for joint in JOINTS), "N m"),)
            self.high = np.array(TORQUES)
            self.low = -self.high
        if forced:
            self.force = (Group("push", tuple(f"push {joint}" for joint in JOINTS), "N"),)

    def enter(self, control: np.ndarray, force: np.ndarray) -> None:
        """Hand torques and forces to the simulator."""
        self.data.ctrl[:] = control if self.control else 0.0
        self.data.xfrc_applied[1:, 0] = force if self.force else 0.0

    def start(self, generator: np.random.Generator) -> np.ndarray:
        """Released at random, from as high as above the hinge."""
        reach = (2.0, 0.6, 0.6)
        return np.concatenate([generator.uniform(-1, 1, LINKS) * reach, generator.uniform(-0.5, 0.5, LINKS)])

    def push(self, generator: np.random.Generator) -> np.ndarray:
        """Each link pushed to one side or the other."""
        return generator.uniform(-PUSH, PUSH, self.n_force)
