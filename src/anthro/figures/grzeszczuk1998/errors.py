"""Error curves of emulators (Fig. 12): what plots of several plants share."""

from pathlib import Path

import numpy as np

from anthro.files import read_json, read_shard

STYLES = {"n25": "-", "n50": "--", "n100": "-.", "n50_regularised": ":"}


def read_errors(run: Path, plant: str) -> tuple[dict[str, np.ndarray], dict]:
    """Read the curves and metrics of one plant's emulators.

    Raises
    ------
    UserError
        Naming the file that is missing.
    """
    folder = Path(run) / "neuroanimator" / "accuracy" / plant
    return read_shard(folder / "rollout.h5")[0], read_json(folder / "metrics.json")


def panel(axes, run: Path, plant: str) -> None:
    """Draw the error of each of a plant's emulators against the physical step."""
    columns, metrics = read_errors(run, plant)
    for number, variant in enumerate(sorted(metrics, key=list(STYLES).index)):
        label = f"N{variant[1:]}".replace("_", ", ")
        steps, error = columns[f"{variant}_step"], columns[f"{variant}_error"]
        axes.plot(steps, error, linestyle=STYLES[variant], color=f"C{number}", label=label)
    axes.set_xlim(0, steps[-1])
    axes.set_ylim(0, None)
    axes.set_xlabel("physical simulation step")
    axes.set_title(plant.replace("_", " "))
    axes.legend()
