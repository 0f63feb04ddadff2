"""Draw a butterfly or write with the index finger along a given trajectory (Nakada 2018, Sec. 8.5, Fig. 26).

The discrepancy that the arm's controller is told is that of the finger tip, though its networks were trained with the
hand's. The neck's controller turns the head to the pen: its target is the direction from the skull's joint to the tip.
All other limbs are kept at rest by theirs.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from anthro import cli
from anthro.body.simulator import DEFAULT_STEP, Simulator
from anthro.demos.leaning import Leaning
from anthro.demos.session import Recorder, Session, advance, finish, parser
from anthro.demos.staying import carried, staying
from anthro.demos.task import SEATED, card_of, rows_of
from anthro.motor.system import MotorSystem
from anthro.registry import SEATED as LIMBS
from anthro.world.path_error import path_error
from anthro.world.strokes import Stroke, butterfly, writing
from anthro.world.trajectory import Plane, Trajectory

HEAD = "neck_seated"
TEXT = "SIGGRAPH 2018"
APPROACH_SECONDS, REST_SECONDS = 2.0, 0.5  # at the path's start before the pen is put down, and at its end
PAUSE_SECONDS = 0.4  # before the pen is put down again: three times the controller's lag, an eighth of a second
ALLOWED_ERROR = 0.01  # m
READER = {"right": (0.0, -1.0, 0.0), "up": (0.0, 0.0, 1.0)}  # of an upright plane before a body that faces +x


@dataclass(frozen=True)
class Shape:
    """What is drawn, by which limb and finger, and where.

    Attributes
    ----------
    strokes : function without arguments that gives the strokes.
    origin : (3,) m, of the plane, around the upright body.
    speed : m/s along a straight line.
    """

    name: str
    limb: str
    effector: str
    strokes: Callable[[], list[Stroke]]
    origin: tuple[float, float, float]
    speed: float

    def trajectory(self) -> Trajectory:
        """When the finger is to be where, around the upright body."""
        return Trajectory(self.strokes(), Plane(self.origin, **READER), self.speed, pause=PAUSE_SECONDS)


SHAPES = {
    "butterfly": Shape("butterfly", "left_arm", "finger_l", lambda: butterfly(0.3), (0.40, 0.24, 1.05), 0.10),
    "writing": Shape("writing", "right_arm", "finger_r", lambda: writing(TEXT, 0.05), (0.40, -0.25, 1.05), 0.10),
}


def upright(time):
    """No lean (rad) at any time."""
    return np.zeros_like(time)


@dataclass
class Lesson:
    """What is to be drawn on a session's body.

    Parameters
    ----------
    session : of a movable body; the shape's limb is led by its finger from now on.
    angle : function of time in s, scalar or (T,): how far the body and the plane lean back, rad; at first not at all.
    """

    session: Session
    shape: Shape
    angle: Callable = upright

    def __post_init__(self):
        self.trajectory = self.shape.trajectory()
        steps = round((APPROACH_SECONDS + self.trajectory.duration + REST_SECONDS) / DEFAULT_STEP)
        self.time = np.arange(steps) * DEFAULT_STEP
        self._at = self.time - APPROACH_SECONDS
        self._path = self.trajectory.position(self._at)
        self._leaning = Leaning(self.session.body)
        self._limb = self.session.lead(self.shape.limb, self.shape.effector)
        self._neck = self.session.limb(HEAD)

    def draw(self, system: MotorSystem) -> tuple[dict, dict, Recorder]:
        """Columns of the rollout that a system makes, metrics, and who recorded it."""
        self._leaning.put(0.0)
        simulator = self.session.begin(system)
        kept = staying(self.session, simulator, but=(self.shape.limb, HEAD))
        recorder = Recorder(simulator, [self._limb, self._neck])

        def targets(s: Simulator) -> dict:
            """The pen's place, where the head should point, and the other limbs' places."""
            lean = self.angle(s.time)
            pen = self._leaning.carry(self._path[round(s.time / DEFAULT_STEP)], lean)
            gaze = s.data.site_xpos[self._limb.site] - s.data.site_xpos[self._neck.site]
            led = {self.shape.limb: pen, HEAD: gaze / np.linalg.norm(gaze)}
            return led | carried(self.session, kept, self._leaning, lean)

        def lean(s: Simulator) -> None:
            self._leaning.put(self.angle(s.time + DEFAULT_STEP))

        seconds = len(self.time) * DEFAULT_STEP
        distances = advance(simulator, system, targets, seconds, recorder, before_step=lean)
        columns = self._columns(recorder.columns())
        return columns, self._metrics(columns, distances[HEAD]), recorder

    def _columns(self, columns: dict) -> dict:
        """The rollout with what the finger drew, in the world and in the plane."""
        lean = self.angle(columns["time"])
        pen = columns["effector"][:, 0]
        columns["target"][:, 1] = np.nan  # the head's target is the pen
        return columns | {
            "base": self._leaning.pose(lean),
            "pen": pen,
            "ink": self.trajectory.plane.locate(self._leaning.raised(pen, lean)),
            "reference": self.trajectory.reference(self._at),
            "pen_down": self.trajectory.pen_down(self._at).astype(np.uint8),
        }

    def _metrics(self, columns: dict, gaze_error: np.ndarray) -> dict:
        down = columns["pen_down"] > 0
        error = path_error(columns["ink"], columns["reference"], down)
        behind = np.linalg.norm(columns["ink"] - columns["reference"], axis=1)[down]
        return {
            "rms_error_m": error.rms,
            "coverage_rms_m": error.coverage_rms,
            "rms_tracking_m": float(np.sqrt(np.mean(behind**2))),
            "mean_gaze_error_deg": float(np.rad2deg(gaze_error[down].mean())),
            "duration_s": float(self.trajectory.duration),
        }


def run(args, name: str, shape: Shape, item: str, source: str, angle: Callable = upright, prop: str = "stool") -> None:
    """Draw by the networks of a run and write the demo's files."""
    session = Session.open(args.run, SEATED, movable=True)
    inputs = session.chosen_inputs(shape.limb, args.inputs)
    with card_of(args, name, shape=shape.name, inputs=inputs) as card:
        columns, metrics, recorder = Lesson(session, shape, angle).draw(session.system(list(LIMBS), args.inputs))
        metrics |= {"inputs": inputs, "limb": shape.limb}
        bars = {"rms_error_m": (ALLOWED_ERROR, "max")}
        rows = rows_of(metrics, f"{item}, {inputs} inputs", "nakada2018", source, bars)
        finish(args, name, columns, recorder.attrs(args.seed, prop), metrics, rows, card)


def main(argv=None) -> int:
    arguments = parser("draw", __doc__, limb=None)
    arguments.add_argument("--shape", choices=SHAPES, default="butterfly", help="what is drawn (default butterfly)")
    args = arguments.parse_args(argv)
    item = {"butterfly": "Fig. 26, butterfly, left finger", "writing": f"Fig. 26, {TEXT}, right finger"}[args.shape]
    run(args, "draw", SHAPES[args.shape], item, "Sec. 8.5")
    return 0


if __name__ == "__main__":
    sys.exit(cli.run(main))
