"""How fast a body is simulated, beside MyoFullBody of myo-sim, on one core, in turns.

``python -m anthro.body.benchmark --body results/laptop/body/zhou2021 --out DIR``

Both are driven by noise of one kind in all their muscles and start in their own default posture on their own ground:
ours with steps of 5 and 7 ms of its own integrator, MyoFullBody as shipped with its own step by ``mj_step``. Time is
processor time, which is clock time for one thread on an idle core, and is disturbed less by other work on the machine.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
import warnings
from functools import partial
from pathlib import Path

import mujoco
import myo_sim
import numpy as np

from anthro import cli
from anthro.body.contact import World
from anthro.body.model import Body
from anthro.body.simulator import Simulator
from anthro.errors import UserError
from anthro.files import write_json
from anthro.runcard import RunCard
from anthro.streams import stream

STEPS = (0.005, 0.007)  # s; Zhou et al. 2021, Appendix B: about 7 ms
PEER = "myofullbody"
CUTOFF = 4.0  # Hz, the noise's highest frequency
TARGET = 4.0  # x real time
STAGE_STEPS = 200
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


def one_core(module: str) -> None:
    """Start a module's program again on one core, its libraries with one thread each, if it is not so already.

    Libraries count their threads when they are imported, so setting the variables here would be too late.
    """
    if any(os.environ.get(name) != "1" for name in THREADS):
        os.environ.update(dict.fromkeys(THREADS, "1"))
        os.execv(sys.executable, [sys.executable, "-m", module, *sys.argv[1:]])
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})


def noise(count: int, width: int, step: float, rng: np.random.Generator) -> np.ndarray:
    """Activations (count, width) in [0, 1]: noise below 4 Hz, 0.2 on average, sampled every ``step`` s."""
    frequency = np.fft.rfftfreq(count, step)
    spectrum = rng.normal(size=(2, len(frequency), width))
    spectrum[:, (frequency > CUTOFF) | (frequency == 0.0)] = 0.0
    signal = np.fft.irfft(spectrum[0] + 1j * spectrum[1], n=count, axis=0)
    return np.clip(0.2 + 0.15 * signal / max(signal.std(), 1e-12), 0.0, 1.0)


def ours(body: Body, step: float, activation: np.ndarray) -> float:
    """Processor time in s of a rollout of ``body`` on level ground under ``activation`` (steps, n)."""
    simulator = Simulator(body, step, World())
    started = time.process_time()
    for row in activation:
        simulator.step(row)
    return time.process_time() - started


def peers(model: mujoco.MjModel, control: np.ndarray) -> float:
    """Processor time in s of ``mj_step`` under ``control`` (steps, n)."""
    data = mujoco.MjData(model)
    started = time.process_time()
    for row in control:
        data.ctrl[:] = row
        mujoco.mj_step(model, data)
    return time.process_time() - started


def peer_model() -> mujoco.MjModel:
    """MyoFullBody as myo-sim ships it."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return myo_sim.load_spec(PEER).compile()


def measure(body: Body, seconds: float, repeats: int, seed: int) -> dict[str, list[float]]:
    """Real-time factors of each round: simulated over processor time, by candidate, taking turns."""
    peer = peer_model()
    calls = {f"ours_{1e3 * step:g}ms": (partial(ours, body, step), step, body.muscle_count) for step in STEPS}
    calls[PEER] = (partial(peers, peer), peer.opt.timestep, peer.nu)
    for call, step, width in calls.values():
        call(noise(20, width, step, stream(seed, "body.benchmark.warm")))
    factors = {name: [] for name in calls}
    for turn in range(repeats):
        rng = stream(seed, f"body.benchmark.{turn}")
        for name, (call, step, width) in calls.items():
            count = max(round(seconds / step), 1)
            factors[name].append(count * step / call(noise(count, width, step, rng)))
    return factors


def stages(body: Body, step: float, seed: int) -> dict[str, float]:
    """Median processor time in s of the parts of one step, and of the whole step, along a rollout."""
    simulator = Simulator(body, step, World())
    model, data, paths = simulator.model, simulator.data, simulator._paths
    activation = noise(STAGE_STEPS, body.muscle_count, step, stream(seed, "body.benchmark.stages"))
    parts = {
        "kinematics": lambda row: (mujoco.mj_kinematics(model, data), mujoco.mj_comPos(model, data)),
        "tendons": lambda row: (paths.refresh_positions(), paths.refresh_velocities(data.qvel)),
        "mass matrix": lambda row: mujoco.mj_makeM(model, data),
        "bias": lambda row: (mujoco.mj_comVel(model, data), mujoco.mj_rne(model, data, 0, data.qfrc_bias)),
        "contact": lambda row: simulator._meet(),
        "assembly": simulator._assemble,
        "solve": lambda row: simulator._solve(),
        "whole step": simulator.step,
    }
    times = {name: [] for name in parts}
    for row in activation:
        for name, call in parts.items():  # all but the last leave the state as it is
            started = time.process_time()
            call(row)
            times[name].append(time.process_time() - started)
    medians = {name: float(np.median(values[STAGE_STEPS // 10 :])) for name, values in times.items()}
    whole = medians.pop("whole step")
    return medians | {"rest": max(whole - sum(medians.values()), 0.0), "whole step": whole}


def summarize(factors: dict[str, list[float]]) -> dict[str, float]:
    """Median real-time factors, and the median over the rounds of ours over the peer's."""
    result = {f"{name}_real_time": float(np.median(values)) for name, values in factors.items()}
    for name in factors:
        if name != PEER:
            result[f"{name}_over_{PEER}"] = float(np.median(np.divide(factors[name], factors[PEER])))
    return result


def rows_of(body: Body, medians: dict[str, float]) -> list[dict]:
    """Scorecard rows: ours against real time and against MyoFullBody."""
    rows = []
    for metric, value in medians.items():
        against_peer = metric.endswith(f"_over_{PEER}")
        target = 1.0 if against_peer else None if metric.startswith(PEER) else TARGET
        rows.append(
            {
                "paper": "zhou2021",
                "item": f"{body.name} simulator, one core",
                "metric": metric,
                "value": value,
                "unit": "ratio" if against_peer else "x real time",
                "target": target,
                "sense": "info" if target is None else "min",
                "source": "myo-sim 0.2.4, same run" if PEER in metric else "Zhou 2021, Appendix B",
            }
        )
    return rows


def _tell(factors: dict, medians: dict, parts: dict) -> None:
    print(" ".join(f"{name:>14}" for name in ("round", *factors)))
    for turn, values in enumerate(zip(*factors.values(), strict=True), start=1):
        print(" ".join([f"{turn:14d}", *(f"{value:13.2f}x" for value in values)]))
    print("\n".join(f"{name} = {value:.2f}" for name, value in medians.items()))
    whole = parts["whole step"]
    for name, seconds in parts.items():
        print(f"{name:>14} {1e3 * seconds:8.3f} ms {100.0 * seconds / whole:5.1f} %")


def main(argv=None) -> int:
    """Measure, print and write rows, metrics and run card."""
    parser = argparse.ArgumentParser(prog="anthro.body.benchmark", description=__doc__.partition("\n")[0])
    parser.add_argument("--body", type=Path, required=True, help="folder of the built body")
    parser.add_argument("--seconds", type=float, default=5.0, help="simulated time of a round (default 5)")
    parser.add_argument("--repeats", type=int, default=5, help="rounds (default 5)")
    parser.add_argument("--seed", type=int, default=1, help="seed of the noise (default 1)")
    parser.add_argument("--json", action="store_true", help="print the metrics as JSON")
    parser.add_argument("--out", type=Path, required=True, help="folder to write")
    args = parser.parse_args(argv)
    if not args.seconds > 0.0 or args.repeats < 1:
        raise UserError("--seconds and --repeats must be positive")
    body = Body.load(args.body)
    spec = {"benchmark": body.name, "seconds": args.seconds, "repeats": args.repeats}
    with RunCard(args.out / "run_card.json", spec, args.seed) as card:
        factors = measure(body, args.seconds, args.repeats, args.seed)
        medians, parts = summarize(factors), stages(body, STEPS[0], args.seed)
        write_json(args.out / "metrics.json", {"rounds": factors, "medians": medians, "stages_s": parts})
        write_json(args.out / "rows.json", rows_of(body, medians))
        card.note(metrics=medians)
    if args.json:
        print(json.dumps({"rounds": factors, "medians": medians, "stages_s": parts}, indent=1, sort_keys=True))
    else:
        _tell(factors, medians, parts)
    return 0


if __name__ == "__main__":
    one_core("anthro.body.benchmark")
    sys.exit(cli.run(main))
