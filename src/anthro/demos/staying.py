"""The limbs that a demo does not ask anything of: their own controllers keep them where they rest."""

from __future__ import annotations

from anthro.body.simulator import Simulator
from anthro.demos.leaning import Leaning
from anthro.demos.session import Session
from anthro.registry import SEATED


def staying(session: Session, simulator: Simulator, but: tuple[str, ...] = ()) -> dict:
    """Targets of the seated body's limbs, without those of ``but``, that keep them where the simulator has them now."""
    return {name: session.limb(name).feature(simulator.data) for name in SEATED if name not in but}


def carried(session: Session, targets: dict, leaning: Leaning, angle: float) -> dict:
    """Targets around the upright body, where they are when it leans by an angle in rad."""
    by_sense = {"position": leaning.carry, "gaze": leaning.turn}
    return {name: by_sense[session.limb(name).plan.senses](target, angle) for name, target in targets.items()}
