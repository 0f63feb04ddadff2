"""Lie on the back and reach for targets above the upper body, without retraining (Nakada 2018, Sec. 8.6).

The body of the seated training lies on the ground, so that gravity pulls along its back. Both arms reach at once, each
for targets of its own; its torso is welded, so that neither feels the other. The neck's controller points the head up;
the legs lie limp on the ground.
"""

from __future__ import annotations

import sys

import mujoco
import numpy as np

from anthro import cli
from anthro.body.contact import World
from anthro.body.simulator import ROOT, Simulator
from anthro.demos.criterion import task_of
from anthro.demos.leaning import Leaning
from anthro.demos.session import Recorder, Session, advance, finish, parser, row
from anthro.demos.task import SEATED, card_of, positive, title
from anthro.motor.system import MotorSystem
from anthro.progress import progress
from anthro.registry import INPUTS

ARMS, HEAD = ("right_arm", "left_arm"), "neck_seated"
ON_ITS_BACK = np.pi / 2
STRETCHED = {"hip_flexion": 8.0, "knee_flexion": 5.0, "ankle_flexion": -20.0}  # degrees, of both legs
SETTLE_SECONDS = 1.5  # until the legs lie on the ground
CLEARANCE, SPREAD = 0.05, 0.40  # m: of targets from the breastbone, and to either side of it
AIMED_AT = 0.7


class Bed:
    """A session's body lying on the ground.

    Parameters
    ----------
    session : of a movable body, which lies from now on.
    """

    def __init__(self, session: Session):
        self.session, self.leaning = session, Leaning(session.body)
        upright, contacts = session.simulator(), session.body.contacts
        self._front = upright.data.site_xpos[contacts.sites[contacts.names.index("sternum_front")], 0]
        self._low, self._top = upright.data.xpos[ROOT, 2], upright.effector_position("head")[2]
        self.leaning.put(ON_ITS_BACK)
        self.leaning.rise(-self._lowest())
        self.leaning.put(ON_ITS_BACK)

    def _lowest(self) -> float:
        """Height in m of the lowest contact sphere of the welded torso."""
        body, data = self.session.body, self.session.simulator().data
        spheres = zip(body.contacts.sites, body.contacts.radius, strict=True)
        return min(data.site_xpos[site, 2] - radius for site, radius in spheres if _is_welded(body.model, site))

    def simulator(self) -> Simulator:
        """A simulator of the lying body, its legs stretched out."""
        body = self.session.body
        simulator = body.simulator(world=World())
        q = body.q_rest.copy()
        for index, name in enumerate(body.dof_names):
            if name[:-2] in STRETCHED:
                q[index] = np.deg2rad(STRETCHED[name[:-2]])
        simulator.reset(q)
        return simulator

    def targets(self, limb: str, count: int, seed: int) -> list[np.ndarray]:
        """Held-out targets in the world that lie over the upper body and that the arm can hold, gravity as it is."""
        share = task_of(self.session.limb(limb)).share
        drawn = self.session.drawer(limb, share, seed, "supine")
        found: list[np.ndarray] = []
        while len(found) < count:
            target = drawn.draw()[0]
            if self._is_above(self.leaning.raised(target, ON_ITS_BACK)):
                found.append(target)
        return found

    def _is_above(self, point) -> bool:
        """Whether a point (3,) m before the upright body is over chest or belly when it lies."""
        ahead, aside, height = point[0] - self._front, abs(point[1]), point[2]
        return bool(ahead > CLEARANCE and aside < SPREAD and self._low < height < self._top)


def _is_welded(model: mujoco.MjModel, site: int) -> bool:
    return model.body_weldid[model.site_bodyid[site]] == 0


def reach(bed: Bed, system: MotorSystem, targets: dict[str, list], label: str) -> tuple[dict, Recorder]:
    """Distances (n, steps) m of each arm, each target begun where the last one ended, and the rollout."""
    session, simulator = bed.session, bed.simulator()
    up = {HEAD: np.array([0.0, 0.0, 1.0])}
    system.reset(simulator)
    advance(simulator, system, up, SETTLE_SECONDS)
    simulator.data.time = 0.0
    for arm in ARMS:
        system.policies[arm].reset(simulator)
    recorder = Recorder(simulator, [session.limb(arm) for arm in ARMS])
    seconds = task_of(session.limb(ARMS[0])).seconds
    runs: dict[str, list] = {arm: [] for arm in ARMS}
    pairs = list(zip(*(targets[arm] for arm in ARMS), strict=True))
    for pair in progress(pairs, len(pairs), label):
        distance = advance(simulator, system, up | dict(zip(ARMS, pair, strict=True)), seconds, recorder)
        for arm in ARMS:
            runs[arm].append(distance[arm])
    return {arm: np.array(values) for arm, values in runs.items()}, recorder


def main(argv=None) -> int:
    arguments = parser("supine", __doc__, limb=None)
    arguments.add_argument("--targets", type=positive, default=40, help="targets of each arm (default 40)")
    args = arguments.parse_args(argv)
    bed = Bed(Session.open(args.run, SEATED, movable=True))
    session, variants = bed.session, [args.inputs] if args.inputs else list(INPUTS)
    shown = session.chosen_inputs(ARMS[0], args.inputs)
    with card_of(args, "supine", targets=args.targets, inputs=variants) as card:
        targets = {arm: bed.targets(arm, args.targets, args.seed) for arm in ARMS}
        metrics: dict = {"targets": args.targets, "inputs": shown}
        rows = []
        for inputs in variants:
            distance, recorder = reach(bed, session.system([*ARMS, HEAD], inputs), targets, inputs)
            for arm in ARMS:
                found = task_of(session.limb(arm)).summary(distance[arm])
                metrics |= {f"{arm}_{inputs}_{name}": value for name, value in found.items()}
                item = f"{title(arm, 'reaches up supine')}, {inputs} inputs"
                bar = (AIMED_AT, "min") if inputs == session.chosen_inputs(arm, args.inputs) else (None, "info")
                rows.append(row(item, "success_rate", found["success_rate"], "1", *bar, "Sec. 8.6"))
                rows.append(row(item, "median_error_m", found["median_error_m"], "m", source="Sec. 8.6"))
            if inputs == shown:
                columns, attrs = recorder.columns(), recorder.attrs(args.seed, "floor")
                columns["base"] = np.tile(bed.leaning.pose(ON_ITS_BACK), (len(columns["time"]), 1))
        finish(args, "supine", columns, attrs, metrics, rows, card)
    return 0


if __name__ == "__main__":
    sys.exit(cli.run(main))
