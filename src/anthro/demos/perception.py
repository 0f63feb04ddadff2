"""Look at a ball, follow it with eyes and head, and reach for it (Nakada 2018, Sec. 8.2, Fig. 17, 18, 22).

The ball appears where the right hand reaches, in view of both eyes; in every other trial it swings slowly to and fro.
A trial counts as foveated when both lines of gaze have been within 1 degree of the ball's middle for 0.1 s by 0.5 s; as
reached when the hand's mean distance from the ball's middle over the last 0.5 s is under 6 cm. The ball is carried, and
meets nothing.
"""

from __future__ import annotations

import sys
from collections.abc import Callable

import numpy as np

from anthro import cli
from anthro.body.simulator import DEFAULT_STEP
from anthro.demos.session import finish
from anthro.demos.sighted import RECORDED, Setting, Sighted, SightRecorder, draw_in_view, opened
from anthro.demos.task import arguments, card_of, rows_of
from anthro.progress import progress
from anthro.streams import stream
from anthro.world.reach import Reach

LIMB = "right_arm"
SECONDS, LAST_SECONDS = 3.0, 0.5  # of a trial, and of its end, over which the hand's distance is averaged
FOVEATED, KEPT_SECONDS, IN_SECONDS = np.deg2rad(1.0), 0.1, 0.5
TOUCHED = 0.06  # m
SWING, PERIOD = 0.08, 4.0  # m to either side, s: 0.13 m/s at most
BARS = {"foveated": (0.9, "min"), "reached": (0.8, "min")}


def swinging(centre: np.ndarray, along: np.ndarray) -> Callable[[float], np.ndarray]:
    """Places (3,) m of a ball that swings about a centre (3,) m along a direction (3,)."""
    return lambda time: centre + SWING * np.sin(2.0 * np.pi * time / PERIOD) * along


def paths(sighted: Sighted, count: int, seed: int, name: str) -> list[Callable[[float], np.ndarray]]:
    """Held-out ways of the ball: still, swinging, still, ..."""
    reach = Reach(sighted.session.limb(LIMB), stream(seed, f"demos.{name}.targets"))
    rng, found = stream(seed, f"demos.{name}.swings"), []
    for index in range(count):
        along = rng.normal(size=3)
        along *= (index % 2) / np.linalg.norm(along)
        found.append(swinging(draw_in_view(sighted, reach.draw), along))
    return found


def time_to_foveate(errors: np.ndarray) -> float:
    """Seconds after which angles (steps, 2) rad of both gazes first stay below 1 degree for 0.1 s; inf if never."""
    inside, length = (errors < FOVEATED).all(axis=1), round(KEPT_SECONDS / DEFAULT_STEP)
    whole = np.convolve(inside, np.ones(length), "valid") > length - 0.5
    return float((np.argmax(whole) + 1) * DEFAULT_STEP) if whole.any() else float("inf")


def trial(sighted: Sighted, path: Callable[[float], np.ndarray]) -> dict[str, np.ndarray]:
    """Angles (steps, 2) rad of the gazes from the ball, and distances (steps,) m of the hand, after each step."""
    site, errors, distance = sighted.session.limb(LIMB).site, [], []

    def watch() -> bool:
        errors.append(sighted.gaze_errors())
        distance.append(np.linalg.norm(sighted.simulator.data.site_xpos[site] - sighted.ball()))
        return False

    sighted.restart([LIMB])
    sighted.run(SECONDS, path, until=watch)
    return {"gaze": np.array(errors), "hand": np.array(distance)}


def summary(found: list[dict[str, np.ndarray]]) -> dict:
    """Metrics of trials, still and swinging ones apart as well."""
    times = np.array([time_to_foveate(one["gaze"]) for one in found])
    late = round(IN_SECONDS / DEFAULT_STEP)
    last = [one["hand"][-round(LAST_SECONDS / DEFAULT_STEP) :].mean() for one in found]
    errors = np.array([np.median(one["gaze"][late:]) for one in found])
    metrics = _shares(times, np.array(last))
    metrics |= {
        "median_time_to_foveate_s": float(np.median(times)) if np.isfinite(np.median(times)) else None,
        "time_on_fovea": float(np.mean([(one["gaze"][late:] < FOVEATED).all(axis=1).mean() for one in found])),
        "median_gaze_error_deg": float(np.rad2deg(np.median(errors))),
        "median_hand_distance_m": float(np.median(last)),
        "p90_hand_distance_m": float(np.quantile(last, 0.9)),
    }
    for name, group in (("still", slice(0, None, 2)), ("swinging", slice(1, None, 2))):
        if len(times[group]):
            metrics |= {f"{name}_{key}": value for key, value in _shares(times[group], np.array(last[group])).items()}
    return metrics


def _shares(times: np.ndarray, last: np.ndarray) -> dict:
    return {"foveated": float((times <= IN_SECONDS).mean()), "reached": float((last < TOUCHED).mean())}


def setting_of(args) -> Setting:
    """The world and the eyes that the command line asks for."""
    return Setting({LIMB: "reach"}, head=not args.no_head, one_eye=args.one_eye, retina=args.retina)


def label(args) -> str:
    """What is left out, in words."""
    words = ["without head movement"] * args.no_head + ["one eye"] * args.one_eye
    words += [f"{args.retina} retina"] * (args.retina != "log_polar")
    return ", ".join(["perception", *words])


def main(argv=None) -> int:
    asked = arguments("perception", __doc__, None, 40)
    asked.add_argument("--no-head", action="store_true", help="ablation: the head stays at rest")
    asked.add_argument("--one-eye", action="store_true", help="ablation: the right eye is shut")
    asked.add_argument(
        "--retina", choices=("log_polar", "uniform"), default="log_polar", help="ablation: where the receptors lie"
    )
    args = asked.parse_args(argv)
    item = label(args)
    with card_of(args, item, targets=args.targets) as card:
        sighted = opened(args, setting_of(args))
        recorder, found = SightRecorder(sighted, [LIMB]), []
        ways = paths(sighted, args.targets, args.seed, "perception")
        for index, path in enumerate(progress(ways, len(ways), "trials")):
            recorder.trial = index
            sighted.recorder = recorder if index < RECORDED else None
            found.append(trial(sighted, path))
        metrics = {"targets": args.targets} | summary(found)
        columns = recorder.columns() | {f"errors_{key}": np.array([one[key] for one in found]) for key in found[0]}
        bars = BARS if item == "perception" else {}
        rows = rows_of(metrics, item, "nakada2018", "Sec. 8.2", bars)
        finish(args, "perception", columns, recorder.attrs(args.seed), metrics, rows, card)
    return 0


if __name__ == "__main__":
    sys.exit(cli.run(main))
