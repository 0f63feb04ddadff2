"""Build a body from its tables: ``python -m anthro.body.build --body zhou2021 --out DIR``."""

from __future__ import annotations

import argparse
import csv
import sys
from pathlib import Path

import mujoco
import numpy as np

from anthro import cli
from anthro.body.builder import Builder, compose
from anthro.body.fit import FiberFit, fit_fibers, given_fibers, twins_share
from anthro.body.meshes import MeshLibrary
from anthro.body.model import Body
from anthro.body.parts import BODIES, absent_muscles, body_plan, load_effectors, load_parts, twin_name
from anthro.body.postures import PostureSampler
from anthro.errors import UserError
from anthro.files import atomic, write_json
from anthro.runcard import RunCard
from anthro.streams import stream

SAMPLES = 8000
# N/m^2, one for all muscles. Printed ones run from 35 (neck) to 100 N/cm^2 (trunk); with 80 the isometric
# torques of the joints lie closest to the published ones as a whole (anthro.body.check, strength).
SPECIFIC_TENSION = 80e4
CM2 = 1e-4


def assemble(name: str, tables: Path) -> tuple[Builder, mujoco.MjModel, list]:
    """Compose and compile the named body; returns the builder, the model and its joints' rows with their regions."""
    plan = body_plan(name)
    absent, parts = absent_muscles(plan, tables), load_parts(plan, tables)
    known = {muscle.muscle for part in parts for muscle in part.muscles}
    if absent - known:
        raise UserError(f"{tables / plan.absent}: {max(absent - known)} is no muscle")
    builder = compose(plan, parts, MeshLibrary(tables), absent, load_effectors(plan, tables))
    model = builder.compile()
    rows = {joint.joint: (joint, part.name) for part in parts for joint in part.joints}
    hinges = np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE)
    return builder, model, [rows[model.joint(int(j)).name] for j in hinges]


def build(
    name: str, tables: Path, out: Path, seed: int, samples: int = SAMPLES, fibers: Path | None = None
) -> FiberFit:
    """Compose the named body and write all of it to ``out``.

    Its fibers are fitted over ``samples`` postures or, where ``fibers`` is the folder of a built body, are that one's.
    """
    tables, out = Path(tables), Path(out)
    with RunCard(out / "run_card.json", spec={"body": name, "samples": samples}, seed=seed) as card:
        builder, model, joints = assemble(name, tables)
        muscles, plan = builder.muscles, builder.plan
        sampler = PostureSampler(model)
        postures = sampler.draw(samples, stream(seed, f"body.fit.{name}"))
        lengths = np.array([sampler.lengths(posture)[: len(muscles)] for posture in postures])
        twins = twins_share(lengths, [muscle.muscle for muscle in muscles])
        neutral = sampler.lengths(np.zeros(len(joints)))[: len(muscles)]
        if fibers is None:
            fit = fit_fibers(twins, np.array([muscle.optimal_fiber_length_m for muscle in muscles]), neutral)
        else:
            fit = given_fibers(twins, *_lengths_of(muscles, fibers))
        out.mkdir(parents=True, exist_ok=True)
        with atomic(out / "model.mjb") as path:
            mujoco.mj_saveModel(model, str(path))
        _write_rows(out / "joints.csv", [_joint_row(joint, region, plan.rest_deg) for joint, region in joints])
        _write_rows(
            out / "muscles.csv",
            [
                _muscle_row(m, region, fit, i)
                for i, (m, region) in enumerate(zip(muscles, builder.muscle_regions, strict=True))
            ],
        )
        _write_rows(
            out / "ligaments.csv", _ligament_rows(builder, model), "ligament,stiffness,damping,slack_low,slack_high"
        )
        _write_rows(
            out / "contacts.csv",
            [{"contact": c.contact, "radius": repr(c.radius_m), "surfaces": c.surfaces} for c in builder.contacts],
            "contact,radius,surfaces",
        )
        write_json(out / "fit.json", _report(muscles, fit))
        card.note(muscles=len(muscles), dof=len(joints), fibers_outside=int(fit.outside.sum()))
    return fit


def _lengths_of(muscles, folder: Path) -> np.ndarray:
    """Slack and tendon lengths (2, n) m that the muscles have in a built body."""
    other = Body.load(folder)
    place = {name: i for i, name in enumerate(other.muscle_names)}
    missing = [muscle.muscle for muscle in muscles if muscle.muscle not in place]
    if missing:
        raise UserError(f"{folder}: has no muscle {missing[0]}")
    rows = [place[muscle.muscle] for muscle in muscles]
    return np.stack([other.slack_length[rows], other.tendon_length[rows]])


def _joint_row(joint, region: str, rest_deg: dict) -> dict:
    right = twin_name(joint.joint) if joint.joint.endswith("_l") else joint.joint
    rest = rest_deg.get(right, joint.rest_deg)
    low, high, rest = np.deg2rad([joint.min_deg, joint.max_deg, rest])
    return {
        "joint": joint.joint,
        "region": region,
        "min": repr(float(low)),
        "max": repr(float(high)),
        "rest": repr(float(rest)),
        "stiffness": repr(joint.stiffness_Nm_rad),
        "damping": repr(joint.damping_Nms_rad),
    }


def _area(muscle, slack_length: float) -> float:
    """Cross-section in m^2: the muscle's volume over its fiber length (Zhou et al. 2021, Appendix B).

    The volume is the source's; where the fit lengthens the fibers, the section shrinks.
    """
    return muscle.pcsa_cm2 * CM2 * min(1.0, muscle.optimal_fiber_length_m / slack_length)


def _muscle_row(muscle, region: str, fit: FiberFit, index: int) -> dict:
    return {
        "muscle": muscle.muscle,
        "region": region,
        "group": muscle.group,
        "max_force": repr(float(_area(muscle, fit.slack_length[index]) * SPECIFIC_TENSION)),
        "slack_length": repr(float(fit.slack_length[index])),
        "tendon_length": repr(float(fit.tendon_length[index])),
    }


def _ligament_rows(builder: Builder, model: mujoco.MjModel) -> list[dict]:
    spans = model.tendon_lengthspring[len(builder.muscles) :]
    return [
        {
            "ligament": row.ligament,
            "stiffness": repr(row.stiffness_N_m),
            "damping": repr(row.damping_Ns_m),
            "slack_low": repr(float(low)),
            "slack_high": repr(float(high)),
        }
        for row, (low, high) in zip(builder.ligaments, spans, strict=True)
    ]


def _write_rows(path: Path, rows: list[dict], header: str = "") -> None:
    names = list(rows[0]) if rows else header.split(",")
    with atomic(path) as temporary, temporary.open("w", newline="") as target:
        writer = csv.DictWriter(target, names, lineterminator="\n")
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
    parser.add_argument("--body", required=True, help=f"body to build: {', '.join(BODIES)}")
    parser.add_argument("--tables", type=Path, default=Path("config/body"), help="anatomy tables")
    parser.add_argument("--seed", type=int, default=1, help="seed of the sampled postures")
    parser.add_argument(
        "--samples", type=int, default=SAMPLES, help=f"postures over which fibers are fitted (default {SAMPLES})"
    )
    parser.add_argument(
        "--fibers", type=Path, help="built body whose fibers it has (default: fitted to its own ranges)"
    )
    parser.add_argument("--out", type=Path, required=True, help="folder to write")
    args = parser.parse_args(argv)
    if not args.tables.is_dir():
        raise UserError(f"{args.tables}: no such folder of anatomy tables")
    if args.samples < 1:
        raise UserError(f"--samples: {args.samples} is not a positive number")
    fit = build(args.body, args.tables, args.out, args.seed, args.samples, args.fibers)
    print(f"{args.out}: built; {int(fit.outside.sum())} fibers leave 0.5 to 1.6 of slack length")
    return 0


if __name__ == "__main__":
    sys.exit(cli.run(main))
