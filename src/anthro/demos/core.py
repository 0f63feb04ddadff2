"""Turn the chest to targets, one after the other, by the networks alone, while head, arms and legs move at random.

Targets are orientations of T1 in poses drawn from the middle 40 % of each joint's range. A target is a success when
the mean angle over the last 0.25 s of its 3 s is under 3 degrees. Then the torso is held upright for 20 s, within
2 degrees, the others still moving (Zhou et al. 2021, Sec. 4.1.1). The pelvis is fixed.
"""

from __future__ import annotations

import sys

from anthro import cli
from anthro.demos.task import arguments, perform


def main(argv=None) -> int:
    return perform(arguments("core", __doc__, "core", 50).parse_args(argv), "core")


if __name__ == "__main__":
    sys.exit(cli.run(main))
