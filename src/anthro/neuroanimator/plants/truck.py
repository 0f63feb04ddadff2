"""The truck: a rigid body on the ground, driven by its rear wheels, steered by its front wheels, with tyre friction."""

from __future__ import annotations

import numpy as np

from anthro.neuroanimator.plants.plant import STEP, Group, RigidPlant

MASS = 2000.0  # kg
INERTIA = 4000.0  # kg m^2, about the vertical
REAR, FRONT = -1.4, 1.6  # m, axles from the centre of mass
SIZE = (4.4, 1.8)  # m, length and width
DRIVE = 3000.0  # N, largest force of the rear wheels
STEER = 0.5  # rad, largest angle of the front wheels
ROLLING = 300.0  # N s/m, resistance of an axle along its wheels
SLIP = 12000.0  # N s/m, tyre force of an axle for each m/s that it slides sideways
GRIP = 8000.0  # N, tyre force of an axle at most: then it skids

_AXLE = (
    '<general site="{axle}" gear="1 0 0 0 0 0" gainprm="{drive}" biastype="affine" biasprm="0 0 {rolling}"/>'
    '<general site="{axle}" gear="0 1 0 0 0 0" gainprm="0" biastype="affine" biasprm="0 0 {slip}"'
    ' forcelimited="true" forcerange="{least} {most}"/>'
)


def _axle(name: str, drive: float) -> str:
    return _AXLE.format(axle=name, drive=drive, rolling=-ROLLING, slip=-SLIP, least=-GRIP, most=GRIP)


XML = (
    f'<mujoco><option timestep="{STEP}" integrator="Euler" gravity="0 0 0"><flag contact="disable"/></option>'
    '<worldbody><body name="truck"><joint name="x" type="slide" axis="1 0 0"/>'
    '<joint name="y" type="slide" axis="0 1 0"/><joint name="heading" axis="0 0 1"/>'
    f'<inertial pos="0 0 0" mass="{MASS}" diaginertia="{INERTIA} {INERTIA} {INERTIA}"/>'
    f'<site name="rear" pos="{REAR} 0 0"/><site name="front" pos="{FRONT} 0 0"/></body></worldbody>'
    f"<actuator>{_axle('rear', DRIVE)}{_axle('front', 0.0)}</actuator></mujoco>"
)


class Truck(RigidPlant):
    """Position, heading, their rates in the world; control: drive as a share of `DRIVE`, steering in rad.

    Each axle is a site with two actuators: one along its wheels (drive and rolling resistance), one across
    them (tyre friction, which saturates). Steering turns the front site.
    """

    name = "truck"
    state = (
        Group("place", ("x", "y"), "m"),
        Group("heading", ("heading",), "rad"),
        Group("velocity", ("velocity x", "velocity y"), "m/s"),
        Group("yaw_rate", ("yaw rate",), "rad/s"),
    )
    control = (Group("drive", ("drive",), "1"), Group("steer", ("steer",), "rad"))
    low, high = np.array([-1.0, -STEER]), np.array([1.0, STEER])
    frame = "planar"

    def __init__(self):
        super().__init__(XML)
        self._front = self.model.site("front").id
        self.model.site_sameframe[self._front] = 0  # MuJoCo would not look at an orientation that it was built without

    def enter(self, control: np.ndarray, force: np.ndarray) -> None:
        """Set the drive of the rear axle and turn the front one."""
        self.data.ctrl[0] = control[0]
        self.model.site_quat[self._front] = np.cos(control[1] / 2), 0.0, 0.0, np.sin(control[1] / 2)

    def start(self, generator: np.random.Generator) -> np.ndarray:
        """Rolling at random along its heading."""
        heading, speed = generator.uniform(-np.pi, np.pi), generator.uniform(-3.0, 5.0)
        place = generator.uniform(-10, 10, 2)
        return np.array([*place, heading, speed * np.cos(heading), speed * np.sin(heading), 0.0])
