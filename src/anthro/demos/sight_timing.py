"""Time of the sensorimotor cycle and of its parts, in one process.

The whole loop is timed in its heaviest form: all ten vision DNNs are asked at every look, all five motor controllers at
every step, and a ball is in view. Its time for a second of simulation is beside the sum of its parts.
"""

from __future__ import annotations

import sys
import time

import numpy as np

from anthro import cli
from anthro.demos.session import finish, parser, row
from anthro.demos.sighted import NECK, Setting, Sighted, opened
from anthro.demos.task import card_of
from anthro.demos.timing import median_seconds
from anthro.eyes.sight import as_bytes
from anthro.loop.plan import read_loop_plan
from anthro.registry import REACHING as LIMBS

SECONDS, ROUNDS, REPEATS = 2.0, 3, 100
PLACE = (0.45, -0.05, 0.95)  # m, of the ball, within reach of both hands
BARS = {"real_time_factor": (0.5, "min"), "all_ten_vision_nets_s": (30e-3, "max"), "both_eyes_see_s": (5e-3, "max")}


def whole(sighted: Sighted, limbs) -> float:
    """Simulated seconds a second of wall time, with the vision DNNs of some limbs asked at each look."""
    factors = []
    for _ in range(ROUNDS):
        sighted.restart(limbs)
        started = time.perf_counter()
        sighted.run(SECONDS, lambda _: np.array(PLACE))
        factors.append(SECONDS / (time.perf_counter() - started))
    return float(np.median(factors))


def parts(sighted: Sighted) -> dict:
    """Seconds of each part, where the whole loop has left body and eyes."""
    simulator, eyes, cycle = sighted.simulator, sighted.eyes, sighted.cycle
    vision, data = cycle.onlooker.vision, simulator.data
    nerve = as_bytes(eyes.see(data))
    limbs = {limb: median_seconds(lambda limb=limb: vision.offsets(limb, nerve), REPEATS) for limb in LIMBS}
    found = {
        "both_eyes_see_s": median_seconds(lambda: eyes.see(data), REPEATS),
        "foveation_nets_s": median_seconds(lambda: vision.discrepancy(nerve), REPEATS),
        "one_limb_vision_nets_s": float(np.mean(list(limbs.values()))),
    }
    found["all_ten_vision_nets_s"] = found["foveation_nets_s"] + sum(limbs.values())
    aims = {limb: sighted.session.limb(limb).feature(data) for limb in (*LIMBS, NECK)}
    activation = sighted.cycle.system.activation(simulator, aims).copy()
    command = eyes.angles
    found |= {
        "five_motor_controllers_s": median_seconds(lambda: cycle.system.activation(simulator, aims), REPEATS),
        "eye_movement_s": median_seconds(lambda: eyes.turn(command, simulator.step_seconds), REPEATS),
        "simulation_step_s": median_seconds(lambda: simulator.step(activation), REPEATS),
    }
    return found


def measure(sighted: Sighted) -> dict:
    """Real-time factors, seconds of each part, and their share of a second of simulation."""
    plan = read_loop_plan(sighted.session.run)
    found: dict = {"real_time_factor": whole(sighted, LIMBS), "real_time_factor_one_limb": whole(sighted, LIMBS[:1])}
    found |= parts(sighted)
    steps = 1.0 / sighted.simulator.step_seconds
    looks, controls = steps / plan.sight_steps, steps / plan.control_steps
    table = {
        "sight": looks * found["both_eyes_see_s"],
        "vision_nets": looks * found["all_ten_vision_nets_s"],
        "motor_controllers": controls * found["five_motor_controllers_s"],
        "eye_movement": steps * found["eye_movement_s"],
        "simulation": steps * found["simulation_step_s"],
    }
    table["rest"] = 1.0 / found["real_time_factor"] - sum(table.values())
    return found | {f"{name}_of_a_second_s": value for name, value in table.items()}


def main(argv=None) -> int:
    args = parser("sight_timing", __doc__, limb=None).parse_args(argv)
    with card_of(args, "sight_timing") as card:
        metrics = measure(opened(args, Setting(dict.fromkeys(LIMBS, "meet"))))
        rows = [
            row("sensorimotor cycle", name, value, "s" if name.endswith("_s") else "1", *BARS.get(name, (None, "info")))
            | {"source": "project"}
            for name, value in metrics.items()
        ]
        finish(args, "sight_timing", {}, {}, metrics, rows, card)
    return 0


if __name__ == "__main__":
    sys.exit(cli.run(main))
