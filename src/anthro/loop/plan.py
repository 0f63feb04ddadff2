"""The keys of ``config/loop.yaml``, as a run's ``specs/loop.json`` holds them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from anthro.errors import UserError
from anthro.files import read_json


@dataclass(frozen=True)
class GazePlan:
    """Gains of the direction that eyes follow, and the angle from which on it jumps."""

    position_gain: float
    velocity_gain: float
    jump_deg: float


@dataclass(frozen=True)
class HeadPlan:
    """Azimuths and elevations from the trunk, degrees, to which the head is led."""

    azimuth_deg: tuple[float, float]
    elevation_deg: tuple[float, float]


@dataclass(frozen=True)
class ReachPlan:
    """Share of each new estimate of where a target is."""

    gain: float


@dataclass(frozen=True)
class FlightPlan:
    """How well a ball is seen, degrees, m and shares; how fast it may fly, m/s; what a bounce is told by, and does."""

    direction_sd_deg: float
    near_sd: float
    far_sd: float
    convergence_sd_deg: float
    speed_sd: float
    bounce_sd: float
    bounce_looks: int
    rebound: float
    rebound_sd: float


@dataclass(frozen=True)
class MeetingPlan:
    """How far ahead meetings are looked for, s."""

    ahead: float


@dataclass(frozen=True)
class LoopPlan:
    """Rates of the three parts, in steps of the simulation, and what each consumer of sight is asked for.

    Attributes
    ----------
    sight_steps, control_steps : from one look to the next, from one activation to the next.
    red_receptors : of an eye, the fewest that tell of a target.
    foveated_deg : the target's angle from the gaze up to which limb vision is heeded.
    gaze, head, reach, flight, meeting : see the classes.
    """

    sight_steps: int
    control_steps: int
    red_receptors: int
    foveated_deg: float
    gaze: GazePlan
    head: HeadPlan
    reach: ReachPlan
    flight: FlightPlan
    meeting: MeetingPlan

    def __post_init__(self):
        if self.sight_steps < 1 or self.control_steps < 1:
            raise UserError(f"loop: looks and activations are 1 step apart at least, not {self.sight_steps} and so on")


PARTS = {"gaze": GazePlan, "head": HeadPlan, "reach": ReachPlan, "flight": FlightPlan, "meeting": MeetingPlan}


def loop_plan(content: dict) -> LoopPlan:
    """The plan in a spec; UserError for keys that are missing or unknown."""
    try:
        return LoopPlan(**content | {name: kind(**content[name]) for name, kind in PARTS.items()})
    except KeyError as error:
        raise UserError(f"loop: {error.args[0]} is missing") from None
    except TypeError as error:
        raise UserError(f"loop: {error}") from None


def read_loop_plan(run: Path) -> LoopPlan:
    """The plan of a run; UserError where it is not there."""
    return loop_plan(read_json(Path(run) / "specs" / "loop.json"))
