"""Meet balls that a cannon shoots at arms and legs in turn, by the networks alone (Nakada 2018, Sec. 8.3, Fig. 23).

Balls fly for 0.8 to 1.4 s to a point that the limb reaches. The body is told which limb is meant; where the ball is and
will be it makes out of what its eyes see. A trial is a success when the limb touches the ball.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np

from anthro import cli
from anthro.body.simulator import DEFAULT_STEP
from anthro.demos.session import finish
from anthro.demos.sighted import RECORDED, Setting, Sighted, SightRecorder, opened
from anthro.demos.task import arguments, card_of, rows_of
from anthro.errors import UserError
from anthro.progress import progress
from anthro.registry import REACHING as LIMBS
from anthro.streams import stream
from anthro.world.cannon import Cannon, Shot
from anthro.world.reach import Reach

AFTER_SECONDS = 0.4  # after the ball was to arrive, and after it was touched
BAR = 0.7


@dataclass(frozen=True)
class Outcome:
    """What became of one ball.

    Attributes
    ----------
    limb : that was meant.
    touched : whether it touched the ball.  first : whether nothing else of the body did before.
    nearest : m, least distance between the effector and the ball's middle before any touch.
    aim_error : m, of the limb's goal from the ball's path when the ball was nearest; NaN where nothing was seen.
    turned : rad, between the ball's velocities before and after the touch; NaN without one.
    failed : why the simulation broke off; "" where it did not.
    """

    limb: str
    touched: bool
    first: bool
    nearest: float
    aim_error: float
    turned: float
    failed: str = ""


class Watch:
    """Looks at a ball and a limb, step by step."""

    def __init__(self, sighted: Sighted, limb: str):
        self.sighted, self.limb = sighted, limb
        self._site = sighted.session.limb(limb).site
        self.nearest, self.aim_error, self.turned = np.inf, np.nan, np.nan
        self._before = sighted.balls.velocity[0].copy()
        self._left: int | None = None

    def done(self) -> bool:
        """One step has passed; whether that is all, some time after the touch."""
        sighted = self.sighted
        hits = [hit for hit in sighted.balls.hits if hit.bone]
        velocity = sighted.balls.velocity[0].copy()
        if not hits:
            away = np.linalg.norm(sighted.simulator.data.site_xpos[self._site] - sighted.ball())
            self.nearest = min(self.nearest, away)
            goal = sighted.cycle.goals.get(self.limb)
            if goal is not None:
                self.aim_error = np.fmin(self.aim_error, np.linalg.norm(goal - sighted.ball()))
        elif np.isnan(self.turned):
            lengths = np.linalg.norm(velocity) * np.linalg.norm(self._before)
            self.turned = float(np.arccos(np.clip(velocity @ self._before / lengths, -1.0, 1.0)))
        self._before = velocity
        if self._left is None and any(hit.limb == self.limb for hit in hits):
            self._left = round(AFTER_SECONDS / DEFAULT_STEP)
        if self._left is not None:
            self._left -= 1
        return self._left == 0

    def outcome(self, failed: str = "") -> Outcome:
        """What became of the ball."""
        met = [hit.limb for hit in self.sighted.balls.hits if hit.bone]
        touched = self.limb in met and not failed
        first = touched and met[0] == self.limb
        return Outcome(
            self.limb, touched, first, float(self.nearest), float(self.aim_error), float(self.turned), failed
        )


def shoot(sighted: Sighted, shot: Shot, before=None) -> Outcome:
    """One shot, from the present on; a simulation that diverges ends it, and counts as missed."""
    sighted.balls.throw(0, shot.muzzle, shot.velocity)
    watch = Watch(sighted, shot.limb)
    try:
        sighted.run(shot.flight + AFTER_SECONDS, before=before, until=watch.done)
    except UserError as error:
        return watch.outcome(str(error))
    return watch.outcome()


def shots(sighted: Sighted, limbs, count: int, seed: int, name: str) -> list[Shot]:
    """Held-out shots at some limbs in turn; their targets are drawn apart from what the body knows of its reach."""
    reaches = {limb: Reach(sighted.session.limb(limb), stream(seed, f"demos.{name}.{limb}.targets")) for limb in limbs}
    cannons = {limb: Cannon(limb, reaches[limb].draw, stream(seed, f"demos.{name}.{limb}")) for limb in limbs}
    return [cannons[limbs[k % len(limbs)]].shoot() for k in range(count)]


def summary(outcomes: list[Outcome], prefix: str = "") -> dict:
    """Metrics of some outcomes."""
    touched = np.array([one.touched for one in outcomes])
    turned = [one.turned for one in outcomes if one.touched and np.isfinite(one.turned)]
    errors = [one.aim_error for one in outcomes if np.isfinite(one.aim_error)]
    nearest = [one.nearest for one in outcomes if np.isfinite(one.nearest)]
    found = {
        "touched": float(touched.mean()),
        "touched_first": float(np.mean([one.first for one in outcomes])),
        "median_nearest_m": float(np.median(nearest)) if nearest else None,
        "median_aim_error_m": float(np.median(errors)) if errors else None,
        "median_deflection_deg": float(np.rad2deg(np.median(turned))) if turned else None,
    }
    found |= {f"{limb}_touched": _rate(outcomes, limb) for limb in dict.fromkeys(one.limb for one in outcomes)}
    return {f"{prefix}{name}": value for name, value in found.items()}


def _rate(outcomes: list[Outcome], limb: str) -> float:
    return float(np.mean([one.touched for one in outcomes if one.limb == limb]))


def meet(sighted: Sighted, trials: list[Shot]) -> tuple[list[Outcome], SightRecorder]:
    """All shots, each begun at rest, and the rollout of the first ones."""
    recorder, outcomes = SightRecorder(sighted, LIMBS), []
    for index, shot in enumerate(progress(trials, len(trials), "shots")):
        sighted.restart([shot.limb])
        recorder.trial = index
        sighted.recorder = recorder if index < RECORDED else None
        outcomes.append(shoot(sighted, shot))
    return outcomes, recorder


def main(argv=None) -> int:
    args = arguments("cannon", __doc__, None, 40).parse_args(argv)
    with card_of(args, "cannon", targets=args.targets) as card:
        sighted = opened(args, Setting(dict.fromkeys(LIMBS, "meet")))
        trials = shots(sighted, LIMBS, args.targets, args.seed, "cannon")
        outcomes, recorder = meet(sighted, trials)
        metrics = {"targets": args.targets} | summary(outcomes)
        rows = rows_of(metrics, "balls of a cannon", "nakada2018", "Sec. 8.3", {"touched": (BAR, "min")})
        finish(args, "cannon", recorder.columns(), recorder.attrs(args.seed), metrics, rows, card)
    return 0


if __name__ == "__main__":
    sys.exit(cli.run(main))
