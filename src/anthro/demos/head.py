"""Point the head at targets, one after the other, by the networks alone; then hold it for 20 s.

Targets are where the head points in poses drawn uniformly from the middle 60 % of each joint's range. A target is a
success when the mean angle over the last 0.25 s of its 1.5 s is under 2 degrees. Held at the gaze of the rest posture,
the head may leave the mean of its first second by 1 degree.
"""

from __future__ import annotations

import sys

from anthro import cli
from anthro.demos.task import arguments, perform


def main(argv=None) -> int:
    return perform(arguments("head", __doc__, "neck_seated", 100).parse_args(argv), "head")


if __name__ == "__main__":
    sys.exit(cli.run(main))
