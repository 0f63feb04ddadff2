"""How well the vision DNNs see: their errors on held-out scenes, which come from a stream of their own.

``python -m anthro.eyes.measure --run results/laptop --body results/laptop/body/nakada2018 --out DIR``

Scenes are drawn as those of the data sets: for foveation with the ball evenly within 40 degrees of the gaze, none of
them near the fovea by intent; for limbs with the ball within reach and foveated by the trained DNNs. A limb is told the
mean of both eyes' answers, so this mean is what is judged.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from anthro import cli, registry
from anthro.body import Body
from anthro.errors import UserError
from anthro.eyes.synthesize import Foveation, LimbVision, synthesize
from anthro.eyes.vision import Vision
from anthro.eyes.witness import Witness
from anthro.files import read_json, write_json, write_shard
from anthro.motor.senses import direction
from anthro.runcard import RunCard
from anthro.streams import stream

BARS = {  # project's bars, and what is said of the paper's nets
    "foveation": (("median", 0.5, "deg"), ("95_percentile", 2.0, "deg")),
    "vision": (("median", 0.03, "m"), ("90_percentile", 0.08, "m")),
}
WEIGHTS = {"foveation": (11.5e6, "Sec. 6.2.1"), "vision": (24.2e6, "Sec. 6.2.2")}  # of the paper's nets
TOLERANCE = 0.01  # with which the weights are met
RATE = 400.0  # pairs/s a core, at least, for foveation


def angle_between(told: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Angles (n,), rad, between directions given by theta and phi (n, 2), rad."""
    told, true = (direction(*np.asarray(angles, float).T) for angles in (told, true))
    chord = np.linalg.norm(told - true, axis=0)
    return 2 * np.arcsin(np.clip(chord / 2, 0, 1))


class Judge:
    """Measures the eyes of one retina on scenes of their own.

    Parameters
    ----------
    run : Path
        ``results/<run>``; its nets and the specs of its data sets.
    body : Body
        The seated one.
    eyes : str
        "" for the paper's retina, `anthro.registry.UNIFORM` for the other one.
    limbs : sequence of str
        Those that it leads.
    scenes : int
        Of each pair of eyes.

    Attributes
    ----------
    columns : dict of str to ndarray (scenes, ...)
        Errors and what they may depend on, rad or m.
    rows : list of dict
        Of the scorecard.
    """

    def __init__(self, run: Path, body: Body, eyes: str, limbs: Sequence[str], scenes: int):
        self.run, self.body, self.eyes, self.scenes = run, body, eyes, scenes
        self.vision = Vision.load(run, limbs, eyes.rstrip("_"))
        self.columns: dict[str, np.ndarray] = {}
        self.rows: list[dict] = []
        self._foveation()
        for limb in limbs:
            self._limb(limb)

    def _witness(self, dataset: str) -> tuple[dict, Witness, np.random.Generator]:
        spec = read_json(self.run / "specs" / "data" / f"{dataset}.json")
        witness = Witness(self.body, spec["limbs"], spec["retina"], spec["seed"])
        return spec, witness, stream(spec["seed"], f"{dataset}.held_out")

    def _foveation(self) -> None:
        spec, witness, rng = self._witness(f"{self.eyes}eyes_foveation")
        source = Foveation(witness, spec | {"near_share": 0.0}, rng)
        limit = np.deg2rad(spec["field_deg"])

        def draw():
            labels = source.draw()
            return None if labels is None or np.abs(labels).max() > limit else labels

        synthesize(source.draw, witness, source.label, 1)  # what is compiled on the way
        started = time.process_time()
        columns, report = synthesize(draw, witness, source.label, self.scenes)
        rate = self.scenes / (time.process_time() - started)
        for side, network in zip(registry.SIDES, self.vision.foveation, strict=True):
            name, true = f"{self.eyes}foveation_{side}", columns[f"{side}_{source.label}"]
            error = angle_between(network.predict(columns[side]), true)
            self.columns |= {f"{name}_error": error, f"{name}_{source.label}": true}
            self._judge(name, "foveation", np.rad2deg(error), network.weights)
        if not self.eyes:
            self._row("foveation pairs, one core", "pairs_per_s", rate, "1/s", RATE, "min")
        self._row(f"{self.eyes}foveation", "scenes_refused", 1 - self.scenes / report["scenes_drawn"], "ratio")

    def _limb(self, limb: str) -> None:
        dataset = f"{self.eyes}{limb}_vision"
        spec, witness, rng = self._witness(dataset)
        source = LimbVision(witness, spec | {"far_share": 0.0}, rng, self.vision)
        told, true, distance, eccentricity = [], [], [], []

        def draw():
            labels = source.draw()
            if labels is not None:
                answers = self.vision.offsets(limb, witness.look())
                turns = [eye.rotation(at) for eye, at in zip(witness.eyes.eyes, witness.eyes.angles, strict=True)]
                told.append([turn @ answer for turn, answer in zip(turns, answers, strict=True)])
                true.append(turns[0] @ labels[0])
                eye, effector = witness.eyes.eyes[0], witness.data.site_xpos[source.limb.site]
                distance.append(np.linalg.norm(witness.in_head(witness.ball.centre) - eye.centre))
                away = (witness.in_head(effector) - eye.centre) @ turns[0]
                eccentricity.append(np.arccos(away[0] / np.linalg.norm(away)))
            return labels

        synthesize(draw, witness, source.label, self.scenes)
        told, true = np.array(told), np.array(true)
        for k, (side, network) in enumerate(zip(registry.SIDES, self.vision.limbs[limb], strict=True)):
            error = np.linalg.norm(told[:, k] - true, axis=1)
            self.columns[f"{dataset}_{side}_error"] = error
            self._judge(f"{dataset}_{side}", "", error, network.weights)
        mean = np.linalg.norm(told.mean(axis=1) - true, axis=1)
        self.columns |= {
            f"{dataset}_mean_error": mean,
            f"{self.eyes}{limb}_offset": true,
            f"{self.eyes}{limb}_distance": np.array(distance),
            f"{self.eyes}{limb}_eccentricity": np.array(eccentricity),
        }
        self._judge(f"{dataset}, mean of both eyes", "vision", mean)
        self._row(f"{dataset}, mean of both eyes", "offset_median", np.median(np.linalg.norm(true, axis=1)), "m")

    def _judge(self, item: str, role: str, error: np.ndarray, weights: int | None = None) -> None:
        """Rows of one net's, or of both eyes' errors (n,), in deg or m."""
        kind = "foveation" if "foveation" in item else "vision"
        for (metric, bar, unit), percent in zip(BARS[kind], (50, 95 if kind == "foveation" else 90), strict=True):
            is_judged = role and not self.eyes
            value = np.percentile(error, percent)
            self._row(item, f"error_{metric}_{unit}", value, unit, *((bar, "max") if is_judged else ()))
        if weights and not self.eyes:
            theirs, source = WEIGHTS[kind]
            self._row(item, "weights_over_paper_minus_1", abs(weights / theirs - 1), "1", TOLERANCE, "max", source)

    def _row(self, item, metric, value, unit, target=None, sense="info", source="project") -> None:
        told = {"item": item, "metric": metric, "value": float(value), "unit": unit, "target": target}
        self.rows.append({"paper": "nakada2018", **told, "sense": sense, "source": source})


def main(argv: Sequence[str] | None = None) -> int:
    """Measure all vision DNNs of a run."""
    parser = argparse.ArgumentParser(prog="anthro.eyes.measure", description=__doc__.partition("\n")[0])
    parser.add_argument("--run", type=Path, required=True, help="folder of the run, results/<run>")
    parser.add_argument("--body", type=Path, required=True, help="folder of the built body")
    parser.add_argument("--scenes", type=int, default=1000, help="scenes of each pair of eyes (default 1000)")
    parser.add_argument("--out", type=Path, required=True, help="folder for errors.h5, rows.json and run card")
    args = parser.parse_args(argv)
    if args.scenes < 1:
        raise UserError(f"--scenes: {args.scenes} is not a positive number")
    body = Body.load(args.body)
    with RunCard(args.out / "run_card.json", {"measure": "vision", "scenes": args.scenes}, None) as card:
        judges = [
            Judge(args.run, body, eyes, limbs, args.scenes)
            for eyes, limbs in (("", registry.SIGHTED), (registry.UNIFORM, registry.UNIFORM_LIMBS))
        ]
        columns = {name: values.astype(np.float32) for judge in judges for name, values in judge.columns.items()}
        rows = [row for judge in judges for row in judge.rows]
        write_shard(args.out / "errors.h5", columns, {})
        write_json(args.out / "rows.json", rows)
        card.note(metrics={f"{row['item']}: {row['metric']}": row["value"] for row in rows})
    return 0


if __name__ == "__main__":
    sys.exit(cli.run(main))
