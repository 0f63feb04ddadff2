"""What demos with sight share: a seated body, what it sees, balls that meet it, and the cycle that leads it.

The demo throws balls and judges what comes of them. The cycle is told which limb is meant, and nothing of the balls.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from anthro.demos.session import Recorder, Session
from anthro.errors import UserError
from anthro.eyes.scene import Scene, sole_height
from anthro.eyes.sight import Eyes
from anthro.eyes.vision import BALL_RADIUS, RED, Vision
from anthro.files import canonical
from anthro.loop.cycle import Cycle
from anthro.loop.leads import Lead, Reaching
from anthro.loop.meeting import Meeting
from anthro.loop.percept import Onlooker
from anthro.loop.plan import read_loop_plan
from anthro.motor.system import MotorSystem
from anthro.registry import SEATED
from anthro.render.parts import Ball as Shown
from anthro.streams import stream
from anthro.world.balls import Ball, Balls
from anthro.world.reach import Reach
from anthro.world.surfaces import Slope

BODY, NECK = "nakada2018", "neck_seated"
QUIET_SECONDS = 0.8  # before the first trial: slack limbs take up their posture
PAUSE = 0.1  # s of the record's time between two trials
RECORDED, RECORDED_EVERY = 4, 4  # trials in the rollout, and steps from one of its rows to the next
FASTEST = 500.0  # rad/s, of a joint: beyond, a simulation has diverged, though its numbers may still be finite
AWAY = (-100.0, 0.0, 0.0)  # m, where a ball is shown that is not in play: behind the body


@dataclass(frozen=True)
class Setting:
    """What a demo asks for.

    Attributes
    ----------
    leads : limbs that sight leads, and how: ``reach`` or ``meet``.
    head, one_eye : whether the neck follows the gaze; whether only the left eye looks.
    retina, movement : of `anthro.eyes.layout.LAYOUTS` and `anthro.eyes.eye.MOVERS`.
    slopes : what balls bounce on. They are clear as glass: the vision DNNs know an even background only.
    movable : whether the body's root may be moved.
    """

    leads: dict[str, str] = field(default_factory=dict)
    head: bool = True
    one_eye: bool = False
    retina: str = "log_polar"
    movement: str = "paper"
    slopes: Sequence[Slope] = ()
    movable: bool = False


class Sighted:
    """A seated body that sees one ball.

    Attributes
    ----------
    session, simulator, eyes, cycle : see their classes.
    balls : the ball as it flies and bounces.
    reaches : by led limb, what it reaches (:class:`anthro.world.reach.Reach`), drawn as its own knowledge.
    """

    def __init__(self, session: Session, system: MotorSystem, vision: Vision, setting: Setting, seed: int):
        self.session, self.setting, body = session, setting, session.body
        self.simulator = session.begin(system)
        self._shown = Shown(BALL_RADIUS, RED, AWAY)
        scene = Scene(body.model, [self._shown], floor=sole_height(body), stool=True)
        self.eyes = Eyes(body, scene, setting.retina, setting.movement, seed)
        plan = read_loop_plan(session.run)
        self.reaches = {
            limb: Reach(session.limb(limb), stream(seed, f"demos.reach.{limb}"))
            for limb, how in setting.leads.items()
            if how == "meet"
        }
        self.all_leads: dict[str, Lead] = {
            limb: Meeting(self.reaches[limb].points, plan.flight, plan.meeting)
            if how == "meet"
            else Reaching(plan.reach)
            for limb, how in setting.leads.items()
        }
        looking = (0,) if setting.one_eye else (0, 1)
        onlooker = Onlooker(self.eyes, vision, plan.red_receptors, np.deg2rad(plan.foveated_deg), looking)
        neck = NECK if setting.head else None
        self.cycle = Cycle(self.simulator, system, onlooker, plan, dict(self.all_leads), neck)
        self.balls = Balls([Ball(BALL_RADIUS)], self.simulator, setting.slopes)
        self.recorder: SightRecorder | None = None
        self._system = system
        self.run(QUIET_SECONDS)
        self._start = self.simulator.qpos.copy(), self.simulator.qvel.copy()
        self._drives = {name: policy.drive.copy() for name, policy in system.policies.items()}

    def restart(self, limbs: Sequence[str] = ()) -> None:
        """Back to the quiet posture, with no ball in play; sight leads these limbs from now on."""
        simulator = self.simulator
        simulator.reset(*self._start, time=simulator.time + PAUSE)
        self._system.reset(simulator, self._drives)
        self.cycle.leads = {limb: self.all_leads[limb] for limb in limbs}
        self.cycle.restart()
        self.balls = Balls(self.balls.balls, simulator, self.setting.slopes)
        self._shown.place(AWAY)

    def run(
        self,
        seconds: float,
        move: Callable[[float], np.ndarray] | None = None,
        before: Callable | None = None,
        until: Callable[[], bool] | None = None,
    ) -> None:
        """Let time pass.

        Parameters
        ----------
        seconds : at most.
        move : where the ball is (3,) m at a time in s from now on, for one that is carried and meets nothing.
        before : as in :meth:`anthro.loop.cycle.Cycle.step`.
        until : asked after each step whether that is all.

        Raises
        ------
        UserError
            The simulation diverges.
        """
        simulator = self.simulator
        begun = simulator.time
        for _ in range(round(seconds / simulator.step_seconds)):
            if move:
                self.balls.position[0] = move(simulator.time - begun)
            place = self.balls.position[0]
            self._shown.place(place if np.isfinite(place[0]) else AWAY)
            self.cycle.step(before)
            fastest = np.abs(simulator.qvel).max()
            if not fastest < FASTEST:
                raise UserError(
                    f"simulation diverges at {simulator.time - begun:.3f} s: a joint turns at {fastest:.3g} rad/s"
                )
            self.balls.follow()
            if self.recorder:
                self.recorder.take()
            if until and until():
                return

    def ball(self) -> np.ndarray:
        """Where the ball truly is (3,) m: for the judge, not for the cycle."""
        return self.balls.position[0]

    def gaze_errors(self) -> np.ndarray:
        """Angles (2,) rad between the lines of gaze and the ball's middle."""
        rotation, position = self.eyes.head(self.simulator.data)
        local = (self.ball() - position) @ rotation
        apart = []
        for eye, angles in zip(self.eyes.eyes, self.eyes.angles, strict=True):
            way = local - eye.centre
            apart.append(np.arccos(np.clip(way @ eye.rotation(angles)[:, 0] / np.linalg.norm(way), -1.0, 1.0)))
        return np.array(apart)


def opened(args, setting: Setting, limbs: Sequence[str] | None = None) -> Sighted:
    """A body of the run with the nets that the setting asks for; UserError for what is not there."""
    session = Session.open(args.run, BODY, setting.movable)
    retina = "" if setting.retina == "log_polar" else setting.retina
    vision = Vision.load(args.run, list(setting.leads) if limbs is None else limbs, retina)
    return seated(args, session, vision, setting)


def seated(args, session: Session, vision: Vision, setting: Setting) -> Sighted:
    """A body with the nets that were loaded, for one of several settings of theirs."""
    return Sighted(session, session.system(list(SEATED), args.inputs), vision, setting, args.seed)


class SightRecorder:
    """Records a cycle's rollout: a row every so many steps, with what the eyes see and what is made of it."""

    def __init__(self, sighted: Sighted, limbs: Sequence[str], every: int = RECORDED_EVERY):
        self.sighted, self._limbs = sighted, list(limbs)
        session = sighted.session
        self._recorder = Recorder(sighted.simulator, [session.limb(name) for name in limbs], every)
        self._head = session.body.effector("head")
        self.rows: list = []
        self.trial = 0

    def take(self) -> None:
        """Record the cycle's last step."""
        sighted, cycle = self.sighted, self.sighted.cycle
        count = len(self._recorder.rows)
        self._recorder.take(cycle.activation, cycle.goals)
        if len(self._recorder.rows) == count:
            return
        told = [lead.estimate if lead else None for lead in map(cycle.leads.get, self._limbs)]
        estimate = np.array([np.full(3, np.nan) if place is None else place for place in told])
        head = sighted.simulator.data.site_xmat[self._head].reshape(3, 3)[:, 0].copy()
        percept = cycle.percept
        row = sighted.balls.position.copy(), sighted.eyes.angles, percept.nerve, percept.discrepancy
        self.rows.append((*row, estimate, self.trial, head))

    def columns(self) -> dict[str, np.ndarray]:
        """Columns of the rollout file."""
        names = ("ball", "eyes", "nerve", "discrepancy", "estimate", "trial", "head")
        own = {name: np.array(values) for name, values in zip(names, zip(*self.rows, strict=True), strict=True)}
        return self._recorder.columns() | own | {"trial": own["trial"].astype(np.int16)}

    def attrs(self, seed: int) -> dict:
        """Attributes of the rollout file."""
        setting = self.sighted.setting
        told = {"ball_radius": BALL_RADIUS, "ball_colour": RED, "retina": setting.retina}
        if setting.slopes:
            told["slopes"] = canonical([_told(slope) for slope in setting.slopes])
        return self._recorder.attrs(seed, "stool") | told


def _told(slope: Slope) -> dict:
    return {
        "name": slope.name,
        "centre": list(slope.centre),
        "normal": list(slope.normal),
        "along": list(slope.along),
        "half_size": list(slope.half_size),
    }


def in_view(sighted: Sighted, point: np.ndarray) -> bool:
    """Whether both eyes can look at a point (3,) m without any movement of the head."""
    aims = sighted.eyes.aim(sighted.simulator.data, point)
    return all((eye.within(aim) == aim).all() for eye, aim in zip(sighted.eyes.eyes, aims, strict=True))


def draw_in_view(sighted: Sighted, draw: Callable[[], np.ndarray], tries: int = 1000) -> np.ndarray:
    """The first drawn point (3,) m that is in view; UserError where hardly any is."""
    for _ in range(tries):
        point = draw()
        if in_view(sighted, point):
            return point
    raise UserError(f"none of {tries} targets is in view")
