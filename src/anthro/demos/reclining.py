"""Write while the chair reclines and rises continuously, without retraining (Nakada 2018, Sec. 8.6, Fig. 27)."""

from __future__ import annotations

import sys

import numpy as np

from anthro import cli
from anthro.demos.draw import SHAPES, TEXT, run
from anthro.demos.session import parser

RECLINED = np.deg2rad(35.0)  # at most
PERIOD = 10.0  # s, down and up again


def chair_angle(time):
    """How far the chair leans back, rad, at a time in s, scalar or (T,): upright at first."""
    return 0.5 * RECLINED * (1.0 - np.cos(2.0 * np.pi * np.asarray(time) / PERIOD))


def main(argv=None) -> int:
    args = parser("reclining", __doc__, limb=None).parse_args(argv)
    item = f"Fig. 27, {TEXT} written on a reclining chair"
    run(args, "reclining", SHAPES["writing"], item, "Sec. 8.6", chair_angle, prop="chair")
    return 0


if __name__ == "__main__":
    sys.exit(cli.run(main))
