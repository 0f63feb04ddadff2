"""Film a learned motion, plant and emulator overlaid: ``python -m anthro.neuroanimator.film --run DIR --task NAME``.

Between super-steps the emulator's states lie on a line (Grzeszczuk 1998, Sec. 3).
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from anthro import cli
from anthro.errors import UserError
from anthro.files import read_shard
from anthro.neuroanimator import draw
from anthro.neuroanimator.plants import plant_of
from anthro.neuroanimator.tasks import TASKS, task_of
from anthro.progress import progress
from anthro.render.film import write_video
from anthro.runcard import RunCard

DPI = 100
DRIVEN = {"truck": {"steer": 1}, "lander": {"rocket": 0}}  # inputs that show


def read_motion(run: Path, task: str) -> dict[str, np.ndarray]:
    """Read what a task's controls did; see `anthro.neuroanimator.synthesize.motions`.

    Raises
    ------
    UserError
        Naming the file that is missing, or the task that is unknown.
    """
    if task not in TASKS:
        raise UserError(f"unknown task {task!r}; known: {', '.join(TASKS)}")
    return read_shard(Path(run) / "neuroanimator" / "control" / task / "rollout.h5")[0]


def between(times: np.ndarray, states: np.ndarray, at: float) -> np.ndarray:
    """State (n,) at a time, on the line between its neighbours."""
    after = int(np.clip(np.searchsorted(times, at), 1, len(times) - 1))
    share = np.clip((at - times[after - 1]) / (times[after] - times[after - 1]), 0.0, 1.0)
    return (1 - share) * states[after - 1] + share * states[after]


def goal_state(name: str) -> np.ndarray | None:
    """State that a task shall end in, in the plant's variables; None where there is none."""
    return None if name == "dolphin" else task_of(name).desired


def show(axes, name: str, motion: dict[str, np.ndarray], at: float) -> None:
    """Draw one instant: the goal, the plant, and the emulator over it."""
    paint, plant, goal = draw.DRAWN[name], plant_of(task_of(name).plant), goal_state(name)
    if goal is not None:
        paint(axes, plant, goal, draw.GOAL, 0.35)
    step = min(int(at / motion["emulated_time"][1]), len(motion["inputs"]) - 1)
    driven = {key: motion["inputs"][step, column] for key, column in DRIVEN.get(name, {}).items()}
    paint(axes, plant, between(motion["time"], motion["plant"], at), draw.PLANT, **driven)
    paint(axes, plant, between(motion["emulated_time"], motion["emulated"], at), draw.EMULATOR, 0.5, **driven)


def frames(name: str, motion: dict[str, np.ndarray], times, width: int, height: int) -> Iterator[np.ndarray]:
    """Yield a picture (height, width, 3) uint8 for each time."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    size = height / 400  # of letters, as a share of those in a picture 400 pixels high
    figure = plt.figure(figsize=(width / DPI, height / DPI), dpi=DPI)
    axes = figure.add_axes((0, 0, 1, 0.92))
    every = np.concatenate([motion["plant"], motion["emulated"]])
    for at in times:
        axes.clear()
        draw.scene(axes, name, every, width / (0.92 * height))
        show(axes, name, motion, at)
        text = {"fontsize": 10 * size, "transform": figure.transFigure, "va": "top"}
        axes.text(0.02, 0.98, f"{at:.1f} s", color=draw.INK, **text)
        axes.text(0.5, 0.98, "plant", color=draw.PLANT, **text)
        axes.text(0.66, 0.98, "emulator", color=draw.EMULATOR, **text)
        if goal_state(name) is not None:
            axes.text(0.88, 0.98, "goal", color=draw.GOAL, **text)
        figure.canvas.draw()
        yield np.asarray(figure.canvas.buffer_rgba())[..., :3].copy()
    plt.close(figure)


def main(argv: Sequence[str] | None = None) -> None:
    """Film one task."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--run", required=True, type=Path, metavar="DIR", help="the run's folder, results/<run>")
    parser.add_argument("--task", required=True, help=f"one of {', '.join(TASKS)}")
    parser.add_argument("--width", type=int, default=480, help="pixels")
    parser.add_argument("--height", type=int, default=400, help="pixels")
    parser.add_argument("--fps", type=int, default=15, help="frames a second")
    parser.add_argument("--out", required=True, type=Path, metavar="FILE", help=".mp4")
    given = parser.parse_args(argv)
    if min(given.width, given.height) < 16 or given.fps < 1:
        raise UserError(f"{given.width} x {given.height} pixels at {given.fps} fps: too small to film")
    motion = read_motion(given.run, given.task)
    times = np.arange(0.0, motion["time"][-1], 1 / given.fps)
    spec = {"task": given.task, "width": given.width, "height": given.height, "fps": given.fps}
    with RunCard(given.out.with_suffix(".run_card.json"), spec):
        pictures = progress(
            frames(given.task, motion, times, given.width, given.height), len(times), f"{given.task} frames"
        )
        write_video(given.out, pictures, (given.width, given.height), given.fps)


if __name__ == "__main__":
    sys.exit(cli.run(main))
