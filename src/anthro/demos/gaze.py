"""How eyes and head look, led by the foveation DNNs: saccades, gaze shifts, pursuit (Nakada 2018, Sec. 6.2.1).

* Peak speed of saccades of 5, 15 and 30 degrees to either side, the head at rest, by the papers' eye and by one with a
  main sequence, beside people's (Hopf et al. 2018, PLoS ONE 13:e0204008).
* Shares of eye and head in a gaze shift of 40 degrees: when the gaze arrives, and after 1.5 s.
* Gain of smooth pursuit, the head at rest: slope of the gaze's speed over the target's, which swings by 15 degrees to
  either side within 4 s.
* Time until both lines of gaze are within 1 degree of a target that appears in the field, and stay there for 0.1 s.

With a single target, saccades and shifts go to the left alone.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

import numpy as np

from anthro import cli
from anthro.body.simulator import DEFAULT_STEP
from anthro.demos.perception import FOVEATED, IN_SECONDS, time_to_foveate
from anthro.demos.session import Session, finish, row
from anthro.demos.sighted import BODY, Setting, Sighted, SightRecorder, seated
from anthro.demos.task import arguments, card_of, rows_of
from anthro.eyes.eye import MOVERS
from anthro.eyes.vision import Vision
from anthro.motor.senses import angles, direction
from anthro.progress import progress
from anthro.streams import stream

PEOPLE = {5: (213.0, 29.0), 15: (352.0, 50.0), 30: (455.0, 67.0)}  # peak deg/s by amplitude in deg, mean and sd
DISTANCE = 1.0  # m
SIDES = (1.0, -1.0)  # left and right
FIXATION_SECONDS, SACCADE_SECONDS = 0.5, 0.5
SHIFT_DEG, SHIFT_SECONDS = 40.0, 1.5
SWING_DEG, PERIOD, PURSUIT_SECONDS, CATCHING_SECONDS = 15.0, 4.0, 5.0, 1.0
FIELD_DEG, DISTANCES, LOOK_SECONDS = (40.0, 25.0), (0.5, 3.0), 1.0  # to either side and up or down; m


class Watch:
    """Gazes of both eyes, in the head and in the world, and where the head points, at first and after each step."""

    def __init__(self, sighted: Sighted):
        self.sighted = sighted
        self.in_head, self.in_world, self.head, self.errors = [], [], [], []
        self()

    def __call__(self) -> bool:
        sighted, eyes = self.sighted, self.sighted.eyes
        rotation, _ = eyes.head(sighted.simulator.data)
        gazes = np.array([eye.rotation(pair)[:, 0] for eye, pair in zip(eyes.eyes, eyes.angles, strict=True)])
        self.in_head.append(gazes)
        self.in_world.append(gazes @ rotation.T)
        self.head.append(rotation[:, 0].copy())
        self.errors.append(sighted.gaze_errors())
        return False


def speeds(gazes: np.ndarray) -> np.ndarray:
    """Angular speeds (steps - 1, eyes) rad/s of unit directions (steps, eyes, 3)."""
    turned = np.einsum("tek,tek->te", gazes[1:], gazes[:-1])
    return np.arccos(np.clip(turned, -1.0, 1.0)) / DEFAULT_STEP


def place(sighted: Sighted, azimuth: float, elevation: float = 0.0, distance: float = DISTANCE) -> np.ndarray:
    """A point (3,) m at angles in degrees from where the eyes of the resting head look."""
    rotation, position = sighted.eyes.head(sighted.simulator.data)
    between = np.mean([eye.centre for eye in sighted.eyes.eyes], axis=0)
    return position + rotation @ (between + distance * direction(*np.deg2rad([azimuth, elevation])))


def saccades(sighted: Sighted, amplitude: float, sides: Sequence[float] = SIDES) -> float:
    """Mean peak speed in deg/s of saccades of an amplitude in degrees, to some of `SIDES`."""
    peaks = []
    for side in sides:
        sighted.restart()
        # half to either side of straight ahead, within reach of both eyes
        start, end = (place(sighted, turn * side * amplitude / 2) for turn in (-1.0, 1.0))
        sighted.run(FIXATION_SECONDS, lambda _, start=start: start)
        watch = Watch(sighted)
        sighted.run(SACCADE_SECONDS, lambda _, end=end: end, until=watch)
        peaks.append(speeds(np.array(watch.in_head)).max(axis=0).mean())
    return float(np.rad2deg(np.mean(peaks)))


def shift(sighted: Sighted, sides: Sequence[float] = SIDES) -> dict:
    """Shares of eye and head in gaze shifts of 40 degrees to some of `SIDES`, when the gaze arrives and at the end."""
    shares = []
    for side in sides:
        sighted.restart()
        ahead, aside = place(sighted, 0.0), place(sighted, side * SHIFT_DEG)
        sighted.run(FIXATION_SECONDS, lambda _, ahead=ahead: ahead)
        watch = Watch(sighted)
        sighted.run(SHIFT_SECONDS, lambda _, aside=aside: aside, until=watch)
        eye = np.array([np.mean([angles(gaze)[0] for gaze in both]) for both in watch.in_head])
        head = np.array([angles(one)[0] for one in watch.head])
        arrived = np.flatnonzero((np.array(watch.errors[1:]) < FOVEATED).all(axis=1))
        first = int(arrived[0]) + 1 if len(arrived) else len(eye) - 1
        both = eye + head - head[0]
        shares.append([eye[first] / both[first], eye[-1] / both[-1], first * DEFAULT_STEP])
    arriving, late, seconds = np.mean(shares, axis=0)
    return {
        "eye_share_arriving": float(arriving),
        "head_share_arriving": float(1.0 - arriving),
        "eye_share_at_the_end": float(late),
        "head_share_at_the_end": float(1.0 - late),
        "shift_time_s": float(seconds),
    }


def pursuit(sighted: Sighted) -> dict:
    """Gain of smooth pursuit and the median angle left."""
    sighted.restart()

    def swing(time: float) -> np.ndarray:
        return points(SWING_DEG * np.sin(2.0 * np.pi * time / PERIOD))

    rotation, position = (part.copy() for part in sighted.eyes.head(sighted.simulator.data))
    middle = position + rotation @ np.mean([eye.centre for eye in sighted.eyes.eyes], axis=0)

    def points(azimuth: float) -> np.ndarray:
        return middle + DISTANCE * rotation @ direction(np.deg2rad(azimuth), 0.0)

    watch = Watch(sighted)
    sighted.run(PURSUIT_SECONDS, swing, until=watch)  # its first row is of time 0, as the swing is
    skipped = round(CATCHING_SECONDS / DEFAULT_STEP)
    gaze = np.array([np.mean([angles(one)[0] for one in both]) for both in watch.in_world])[skipped:]
    times = DEFAULT_STEP * np.arange(skipped, skipped + len(gaze))
    target = np.deg2rad(SWING_DEG) * np.sin(2.0 * np.pi * times / PERIOD)
    # over 0.1 s, as the steps of a gaze that is corrected at each look are no speed
    far = round(0.1 / DEFAULT_STEP)
    moved, wanted = gaze[far:] - gaze[:-far], target[far:] - target[:-far]
    errors = np.array(watch.errors)[skipped:]
    return {
        "pursuit_gain": float(moved @ wanted / (wanted @ wanted)),
        "pursuit_error_deg": float(np.rad2deg(np.median(errors))),
    }


def looks(sighted: Sighted, count: int, seed: int) -> dict:
    """Times to foveate targets that appear anywhere in the field."""
    rng, times = stream(seed, "demos.gaze.targets"), []
    for _ in progress(range(count), count, "targets"):
        sighted.restart()
        distance = float(np.exp(rng.uniform(*np.log(DISTANCES))))
        point = place(sighted, *(rng.uniform(-side, side) for side in FIELD_DEG), distance)
        watch = Watch(sighted)
        sighted.run(LOOK_SECONDS, lambda _, point=point: point, until=watch)
        times.append(time_to_foveate(np.array(watch.errors[1:])))
    median = float(np.median(times))
    return {
        "median_time_to_foveate_s": median if np.isfinite(median) else None,
        "foveated": float((np.array(times) <= IN_SECONDS).mean()),
    }


def main(argv=None) -> int:
    args = arguments("gaze", __doc__, None, 40).parse_args(argv)
    session, vision = Session.open(args.run, BODY), Vision.load(args.run)
    with card_of(args, "gaze", targets=args.targets) as card:
        metrics, rows, sides = {"targets": args.targets}, [], SIDES[: args.targets]
        for movement in MOVERS:
            sighted = seated(args, session, vision, Setting(head=False, movement=movement))
            words = movement.replace("_", " ")
            for amplitude, (people, _) in PEOPLE.items():
                name = f"peak_{amplitude}_deg_saccade"
                found = saccades(sighted, amplitude, sides)
                metrics[f"{movement}_{name}"] = found
                rows.append(
                    row(f"saccades, {words} eye", name, found, "deg/s", people, "info", "Hopf et al. 2018, people")
                )
            found = pursuit(sighted)
            metrics |= {f"{movement}_{name}": value for name, value in found.items()}
            rows += rows_of(found, f"smooth pursuit, {words} eye", "nakada2018", "Sec. 6.2.1", {})
        sighted = seated(args, session, vision, Setting())
        sighted.recorder = recorder = SightRecorder(sighted, [])
        found = shift(sighted, sides)
        sighted.recorder = None
        found |= looks(sighted, args.targets, args.seed)
        metrics |= found
        rows += rows_of(found, "gaze, eyes and head", "nakada2018", "Sec. 6.2.1", {})
        finish(args, "gaze", recorder.columns(), recorder.attrs(args.seed), metrics, rows, card)
    return 0


if __name__ == "__main__":
    sys.exit(cli.run(main))
