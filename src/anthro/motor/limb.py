"""What one neuromuscular controller moves: its muscles, its joints, and the discrepancy that it is told.

Nakada et al. 2018, Sec. 5, and Zhou et al. 2021, Sec. 5.1, control a body by independent controllers, one for each
musculoskeletal complex: arms, legs, neck, core. All are called limbs here, since code treats them alike. What differs
stands in ``config/limbs/<limb>.yaml``.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import mujoco
import numpy as np

from anthro.body import Body
from anthro.body.parts import twins
from anthro.body.postures import CHAINS, LEVELS, PASSIVE
from anthro.body.simulator import Simulator
from anthro.errors import UserError
from anthro.motor.senses import SENSES, Sense

SIDES = {"right": "_r", "left": "_l", "both": ""}
SLACK = 1e-3  # keeps the drive smooth and finite where a torque is out of reach
CHAIN_SPREAD = 0.25  # share by which the joints of a chain differ when it is bent as a whole


@dataclass(frozen=True)
class LimbPlan:
    """The keys of ``config/limbs/<limb>.yaml`` and the limb's name.

    Attributes
    ----------
    body : the body of the registry on which training data are synthesized.
    region, side : whose muscles and joints are the limb's; side is "right", "left" or "both".
    effector : what is moved, of ``config/body/effectors.csv``.
    base : bone in whose frame discrepancies are sensed.
    senses : kind of the discrepancy, one of :data:`anthro.motor.senses.SENSES`.
    yielding : beginnings of the names of those passive joints that no muscle is asked to hold (patellae).
    reluctance : factors by which joints whose names begin so bend less than their range would have them.
    lack : torque in N m that the muscles may lack at a joint to hold a target's pose.
    soft : slack of the muscle problem for joints whose names begin so: larger where torques are hard to reach.
    idle : beginnings of the names of driven joints that muscles hold where they are, and lead nowhere.
    """

    name: str
    body: str
    region: str
    side: str
    effector: str
    base: str
    senses: str
    yielding: tuple[str, ...] = ()
    reluctance: dict[str, float] = field(default_factory=dict)
    soft: dict[str, float] = field(default_factory=dict)
    idle: tuple[str, ...] = ()
    lack: float = 1.0


def limb_plan(content: dict) -> LimbPlan:
    """The plan in a spec; UserError for keys that are missing or unknown."""
    try:
        return LimbPlan(**content)
    except TypeError as error:
        raise UserError(f"limb {content.get('name')}: {error}") from None


class Limb:
    """One limb of a body.

    Attributes
    ----------
    muscles : (n,) indices among the body's muscles.
    driven : (d,) indices among the body's hinges of the joints that it commands.
    passive : (p,) indices of those that ligaments place: first the held ones, then the yielding ones.
    columns, passive_columns : (d,), (p,) the same among the body's velocities.
    torques : number t of torques that the muscles must make: on driven and on held joints.
    slack : (t,) of the muscle problem.
    rows : (nv,) place of a velocity among driven and passive joints; negative elsewhere.
    half_range : (d,) rad.
    led : (d,) bool, driven joints that are led to a target's pose; the others are held where they are.
    bending : (d,) rad, how much joints bend beside each other in canonical poses.
    twins : (n,) place of each muscle's twin on the other side, its own where there is none.
    sense : how its discrepancy is measured.

    Raises
    ------
    UserError
        The body lacks the limb's muscles, joints, effector or base, or the plan an unknown word.
    """

    def __init__(self, plan: LimbPlan, body: Body):
        if plan.side not in SIDES or plan.senses not in SENSES:
            raise UserError(f"{plan.name}: side {plan.side!r} or senses {plan.senses!r} is unknown")
        self.plan, self.body = plan, body
        self.muscles = members(body.muscle_names, body.muscle_regions, plan.region, plan.side)
        joints = members(body.dof_names, body.dof_regions, plan.region, plan.side)
        first = body.model.nv - body.dof_count
        kinds = np.array([_kind(body.dof_names[i], plan.yielding) for i in joints], int)
        self.driven, held, yielding = (joints[kinds == kind] for kind in range(3))
        self.passive = np.concatenate([held, yielding])
        self.columns, self.passive_columns = first + self.driven, first + self.passive
        self.torques = len(self.driven) + len(held)
        ordered = np.concatenate([self.driven, self.passive])
        self.rows = np.full(body.model.nv, -1)
        self.rows[first + ordered] = np.arange(len(ordered))
        self.slack = np.array([_first(body.dof_names[i], plan.soft, SLACK) for i in ordered[: self.torques]])
        self.base = mujoco.mj_name2id(body.model, mujoco.mjtObj.mjOBJ_BODY, plan.base)
        if not len(self.muscles) or not len(self.driven) or self.base < 0:
            raise UserError(f"{body.name} has no {plan.name}: muscles, joints or bone {plan.base!r} are missing")
        self.site = body.effector(plan.effector)
        self.sense: Sense = SENSES[plan.senses]
        self.low, self.high = body.q_range[self.driven].T
        self.half_range = 0.5 * (self.high - self.low)
        reluctance = [_first(body.dof_names[i], plan.reluctance, 1.0) for i in self.driven]
        self.bending = self.half_range / np.array(reluctance)
        self.led = np.array([not body.dof_names[i].startswith(tuple(plan.idle)) for i in self.driven], bool)
        self.twins = twins([body.muscle_names[i] for i in self.muscles])
        self.is_alone = len(self.muscles) == body.muscle_count
        names = [body.dof_names[i] for i in self.driven]
        self._chains = [
            np.array([k for k, n in enumerate(names) if n.endswith(ending) and n[0] in LEVELS and n[1].isdigit()], int)
            for ending in CHAINS
        ]

    name = property(lambda self: self.plan.name)
    size = property(lambda self: len(self.muscles), doc="Number of muscles.")
    width = property(lambda self: self.sense.width, doc="Number of the discrepancy's components.")

    def feature(self, data: mujoco.MjData) -> np.ndarray:
        """What the limb does, in the world: its effector's position (3,), gaze (3,) or rotation (3, 3)."""
        return self.sense.feature(data.site_xpos[self.site], data.site_xmat[self.site].reshape(3, 3))

    def offset(self, data: mujoco.MjData, target) -> np.ndarray:
        """Discrepancy (width,) in m or rad from what the limb does to ``target``, in the world; in the base's frame."""
        position, rotation = data.site_xpos[self.site], data.site_xmat[self.site].reshape(3, 3)
        return self.sense.offset(target, position, rotation, data.xmat[self.base].reshape(3, 3))

    def distance(self, data: mujoco.MjData, target) -> float:
        """How far the limb is from ``target``: m, or the angle in rad."""
        return float(np.linalg.norm(self.offset(data, target)))

    def strains(self, simulator: Simulator) -> tuple[np.ndarray, np.ndarray]:
        """Strains (n,) and strain rates (n,) 1/s of the limb's muscles."""
        strain, rate = simulator.strain, simulator.strain_rate
        return (strain, rate) if self.is_alone else (strain[self.muscles], rate[self.muscles])

    def into(self, activation: np.ndarray, own: np.ndarray) -> np.ndarray:
        """The body's activations with the limb's ``own`` (n,) among them; ``activation`` is changed."""
        activation[self.muscles] = own
        return activation

    def random_pose(self, share: float, rng: np.random.Generator) -> np.ndarray:
        """Angles (d,) rad in the middle ``share`` of each joint's range; a spine's joints bend together."""
        draws = rng.uniform(-1.0, 1.0, len(self.driven))
        for chain in self._chains:
            draws[chain] = (1.0 - CHAIN_SPREAD) * rng.uniform(-1.0, 1.0) + CHAIN_SPREAD * draws[chain]
        return 0.5 * (self.low + self.high) + share * self.half_range * draws

    def near(self, q, spread: float, rng: np.random.Generator) -> np.ndarray:
        """Angles (d,) rad around ``q``, ``spread`` of the half ranges away, within the ranges."""
        return np.clip(q + spread * self.half_range * rng.normal(size=len(q)), self.low, self.high)

    def with_angles(self, q, angles) -> np.ndarray:
        """All angles (m,) rad: those of ``q`` (m,) with the limb's (d,) set."""
        whole = np.array(q, float)
        whole[self.driven] = angles
        return whole


def _kind(joint: str, yielding) -> int:
    """0 for a driven joint, 1 for one that ligaments place and muscles hold, 2 for one that yields."""
    return int(joint.startswith(PASSIVE)) + int(joint.startswith(tuple(yielding)))


def _first(joint: str, values: dict[str, float], otherwise: float) -> float:
    """The value of the first beginning that a joint's name has."""
    return next((value for beginning, value in values.items() if joint.startswith(beginning)), otherwise)


def members(names, regions, region: str, side: str) -> np.ndarray:
    """Indices of the muscles or joints, named and each of its region, that belong to a region's side or to both."""
    named = enumerate(zip(names, regions, strict=True))
    return np.array([i for i, (name, its) in named if its == region and name.endswith(SIDES[side])], int)
