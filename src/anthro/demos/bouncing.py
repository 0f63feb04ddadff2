"""Meet balls that come bouncing down sloped planes, with the right arm, by the networks alone (Nakada 2018, Sec. 8.4).

Balls are dropped over three slopes (Fig. 25) and come into the arm's reach within 0.8 to 2 s. The body is told nothing
of the slopes, and they are clear as glass; that a ball has bounced it notices when the ball leaves the flight that it
expects. A trial is a success when the arm touches the ball.
"""

from __future__ import annotations

import sys

import numpy as np

from anthro import cli
from anthro.demos.cannon import AFTER_SECONDS, Outcome, Watch, summary
from anthro.demos.session import finish
from anthro.demos.sighted import RECORDED, Setting, Sighted, SightRecorder, opened
from anthro.demos.task import arguments, card_of, rows_of
from anthro.eyes.vision import BALL_RADIUS
from anthro.progress import progress
from anthro.streams import stream
from anthro.world.balls import Ball
from anthro.world.reach import Reach
from anthro.world.slopes import Drop, Drops, staircase

LIMB = "right_arm"
BAR = 0.7


def drops(sighted: Sighted, count: int, seed: int) -> list[Drop]:
    """Held-out drops; what counts as within reach is drawn apart from what the body knows of its reach."""
    reach = Reach(sighted.session.limb(LIMB), stream(seed, "demos.bouncing.targets"))
    drawn = Drops(sighted.setting.slopes, Ball(BALL_RADIUS), reach.contains, stream(seed, "demos.bouncing"))
    return [drawn.draw() for _ in range(count)]


def drop(sighted: Sighted, one: Drop) -> Outcome:
    """One drop, from the present on."""
    sighted.balls.throw(0, one.position, one.velocity)
    watch = Watch(sighted, LIMB)
    sighted.run(one.arrival + 2.0 * AFTER_SECONDS, until=watch.done)
    return watch.outcome()


def main(argv=None) -> int:
    args = arguments("bouncing", __doc__, None, 40).parse_args(argv)
    with card_of(args, "bouncing", targets=args.targets) as card:
        sighted = opened(args, Setting({LIMB: "meet"}, slopes=staircase()))
        trials = drops(sighted, args.targets, args.seed)
        recorder, outcomes = SightRecorder(sighted, [LIMB]), []
        for index, one in enumerate(progress(trials, len(trials), "drops")):
            sighted.restart([LIMB])
            recorder.trial = index
            sighted.recorder = recorder if index < RECORDED else None
            outcomes.append(drop(sighted, one))
        metrics = {"targets": args.targets, "bounces": float(np.mean([one.bounces for one in trials]))}
        metrics |= summary(outcomes)
        rows = rows_of(metrics, "balls bouncing on slopes", "nakada2018", "Sec. 8.4", {"touched": (BAR, "min")})
        finish(args, "bouncing", recorder.columns(), recorder.attrs(args.seed), metrics, rows, card)
    return 0


if __name__ == "__main__":
    sys.exit(cli.run(main))
