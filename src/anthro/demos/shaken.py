"""Meet balls of a cannon while the stool is shaken (Nakada 2018, Sec. 8.6), by the networks alone.

The stool is displaced by a sinusoid, up and down in one trial and to and fro in the next, by 10 cm at 3.75 Hz and by
70 cm at 6 Hz. The shaking has its whole amplitude when the ball is shot. The body feels how its root moves, as it knows
its own posture; no network was trained with it. A simulation that diverges ends its trial, which counts as missed.
"""

from __future__ import annotations

import sys

import numpy as np

from anthro import cli
from anthro.demos.cannon import Outcome, shoot, shots, summary
from anthro.demos.session import finish
from anthro.demos.sighted import RECORDED, Setting, Sighted, SightRecorder, opened
from anthro.demos.task import arguments, card_of, rows_of
from anthro.errors import UserError
from anthro.progress import progress
from anthro.registry import REACHING as LIMBS
from anthro.world.cannon import Shot
from anthro.world.stool import EASE_SECONDS, HORIZONTAL, PAPER, VERTICAL, Shaking, Stool

BARS = dict(zip(PAPER, (0.5, None), strict=True))  # least share that is touched
DIRECTIONS = VERTICAL, HORIZONTAL


class RootRecorder(SightRecorder):
    """Records where the shaken root is, too."""

    def __init__(self, sighted: Sighted, limbs):
        super().__init__(sighted, limbs)
        self.stool: Stool | None = None
        self.base: list[np.ndarray] = []

    def take(self) -> None:
        before = len(self.rows)
        super().take()
        if len(self.rows) > before:
            self.base.append(self.stool.pose(self.sighted.simulator.time))

    def columns(self) -> dict[str, np.ndarray]:
        return super().columns() | {"base": np.array(self.base)}


def shake(sighted: Sighted, shaking: Shaking, shot: Shot, recorder: RootRecorder) -> Outcome:
    """One shot at a shaken body."""
    sighted.restart([shot.limb])
    recorder.stool = stool = Stool(sighted.simulator, shaking)

    def carry(simulator) -> None:
        stool.shake()

    try:
        sighted.run(EASE_SECONDS, before=carry)
    except UserError as error:
        return Outcome(shot.limb, False, False, np.nan, np.nan, np.nan, str(error))
    return shoot(sighted, shot, carry)


def main(argv=None) -> int:
    args = arguments("shaken", __doc__, None, 40).parse_args(argv)
    with card_of(args, "shaken", targets=args.targets) as card:
        sighted = opened(args, Setting(dict.fromkeys(LIMBS, "meet"), movable=True))
        trials = shots(sighted, LIMBS, args.targets, args.seed, "shaken")
        recorder, metrics, rows = RootRecorder(sighted, LIMBS), {"targets": args.targets}, []
        for number, (name, (amplitude, frequency)) in enumerate(PAPER.items()):
            outcomes = []
            for index, shot in enumerate(progress(trials, len(trials), name)):
                recorder.trial = number * len(trials) + index
                sighted.recorder = recorder if number == 0 and index < RECORDED else None
                direction = DIRECTIONS[index // len(LIMBS) % 2]
                outcomes.append(shake(sighted, Shaking(amplitude, frequency, direction), shot, recorder))
                if outcomes[-1].failed:
                    print(f"shaken: {name}, trial {index + 1}: {outcomes[-1].failed}", file=sys.stderr)
            found = summary(outcomes) | {"diverged": float(np.mean([bool(one.failed) for one in outcomes]))}
            bars = {"touched": (BARS[name], "min")} if BARS[name] else {}
            rows += rows_of(found, f"stool shaken, {name}", "nakada2018", "Sec. 8.6", bars)
            metrics[name] = found
        finish(args, "shaken", recorder.columns(), recorder.attrs(args.seed), metrics, rows, card)
    return 0


if __name__ == "__main__":
    sys.exit(cli.run(main))
