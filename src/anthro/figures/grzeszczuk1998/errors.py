"""Error curves of emulators (Fig. 12): what plots of several plants share."""

from pathlib import Path

import numpy as np

from anthro.files import read_json, read_shard
from anthro.neuroanimator.plants import plant_of

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


def units(plant: str) -> str:
    """Units of a plant's state, each once."""
    found = dict.fromkeys(group.unit for group in plant_of(plant).state)
    return ", ".join(unit for unit in found if unit != "1")


def panel(axes, run: Path, plant: str) -> None:
    """Draw the error of each of a plant's emulators, and what the plant makes of the errors of N50."""
    columns, metrics = read_errors(run, plant)
    for number, variant in enumerate(sorted(metrics, key=list(STYLES).index)):
        label = f"N{variant[1:]}".replace("_", ", ")
        steps, error = columns[f"{variant}_step"], columns[f"{variant}_error"]
        axes.plot(steps, error, linestyle=STYLES[variant], color=f"C{number}", label=label)
    if "n50_plant_error" in columns:
        label = "plant, given N50's single errors"
        axes.plot(columns["n50_step"], columns["n50_plant_error"], color="0.6", linewidth=1, zorder=1, label=label)
    axes.set_xlim(0, steps[-1])
    axes.set_xlabel("physical simulation step")
    axes.set_title(plant.replace("_", " "))
    axes.legend()
