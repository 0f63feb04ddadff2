"""Build a body from its tables: ``python -m anthro.body.build --body right_arm --out DIR``."""

from __future__ import annotations

import argparse
import csv
import sys
from pathlib import Path

import mujoco
import numpy as np

from anthro import cli
from anthro.body.builder import compose
from anthro.body.fit import FiberFit, fit_fibers, path_lengths, sample_postures
from anthro.body.parts import body_plan, load_part
from anthro.errors import UserError
from anthro.files import atomic, write_json
from anthro.runcard import RunCard
from anthro.streams import stream

SAMPLES = 8000


def build(name: str, tables: Path, out: Path, seed: int) -> FiberFit:
    """Compose the named body, fit its fibers and write model, tables and fit report to ``out``."""
    plan = body_plan(name)
    parts = [load_part(part, tables) for part in plan.parts]
    joints = [joint for part in parts for joint in part.joints]
    muscles = [muscle for part in parts for muscle in part.muscles]
    with RunCard(out / "run_card.json", spec={"body": name, "samples": SAMPLES}, seed=seed) as card:
        model = compose(plan, parts)
        postures = sample_postures(model.jnt_range, SAMPLES, stream(seed, f"body.fit.{name}"))
        optimal = np.array([muscle.optimal_fiber_length_m for muscle in muscles])
        fit = fit_fibers(path_lengths(model, postures), optimal)
        out.mkdir(parents=True, exist_ok=True)
        with atomic(out / "model.mjb") as path:
            mujoco.mj_saveModel(model, str(path))
        _write_rows(out / "joints.csv", map(_joint_row, joints))
        _write_rows(out / "muscles.csv", [_muscle_row(m, fit, i) for i, m in enumerate(muscles)])
        write_json(out / "fit.json", _report(muscles, fit))
        card.note(muscles=len(muscles), dof=len(joints), fibers_outside=int(fit.outside.sum()))
    return fit


def _joint_row(joint) -> dict:
    low, high, rest = np.deg2rad([joint.min_deg, joint.max_deg, joint.rest_deg])
    return {
        "joint": joint.joint,
        "min": repr(float(low)),
        "max": repr(float(high)),
        "rest": repr(float(rest)),
        "damping": repr(joint.damping_Nms_rad),
    }


def _muscle_row(muscle, fit: FiberFit, index: int) -> dict:
    return {
        "muscle": muscle.muscle,
        "group": muscle.group,
        "max_force": repr(muscle.max_force_N),
        "slack_length": repr(float(fit.slack_length[index])),
        "tendon_length": repr(float(fit.tendon_length[index])),
    }


def _write_rows(path: Path, rows) -> None:
    rows = list(rows)
    with atomic(path) as temporary, temporary.open("w", newline="") as target:
        writer = csv.DictWriter(target, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def _report(muscles, fit: FiberFit) -> dict:
    outside = [muscles[i].muscle for i in np.flatnonzero(fit.outside)]
    lengthened = {
        muscle.muscle: round(float(fit.slack_length[i] / muscle.optimal_fiber_length_m), 3)
        for i, muscle in enumerate(muscles)
        if abs(fit.slack_length[i] / muscle.optimal_fiber_length_m - 1.0) > 1e-9
    }
    return {
        "fibers_outside_0.5_to_1.6": outside,
        "slack_length_over_source": lengthened,
        "shortest": {m.muscle: round(float(fit.shortest[i]), 4) for i, m in enumerate(muscles)},
        "longest": {m.muscle: round(float(fit.longest[i]), 4) for i, m in enumerate(muscles)},
    }


def main(argv=None) -> int:
    parser = argparse.ArgumentParser(prog="anthro.body.build", description=__doc__)
    parser.add_argument("--body", required=True, help="body to build, e.g. right_arm")
    parser.add_argument("--tables", type=Path, default=Path("config/body"), help="anatomy tables")
    parser.add_argument("--seed", type=int, default=1, help="seed of the sampled postures")
    parser.add_argument("--out", type=Path, required=True, help="folder to write")
    args = parser.parse_args(argv)
    if not args.tables.is_dir():
        raise UserError(f"{args.tables}: no such folder of anatomy tables")
    fit = build(args.body, args.tables, args.out, args.seed)
    print(f"{args.out}: built; {int(fit.outside.sum())} fibers leave 0.5 to 1.6 of slack length")
    return 0


if __name__ == "__main__":
    sys.exit(cli.run(main))
