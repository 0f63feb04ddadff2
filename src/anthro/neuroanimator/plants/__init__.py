"""Physics-based models to emulate, by name; a new plant is a class here and a row of `PLANTS`."""

from functools import cache

from anthro.errors import UserError
from anthro.neuroanimator.plants.dolphin import Dolphin
from anthro.neuroanimator.plants.lander import Lander
from anthro.neuroanimator.plants.pendulum import Pendulum
from anthro.neuroanimator.plants.plant import Plant
from anthro.neuroanimator.plants.truck import Truck

PLANTS = {
    "passive_pendulum": lambda: Pendulum(motors=False),
    "active_pendulum": Pendulum,
    "forced_pendulum": lambda: Pendulum(forced=True),
    "truck": Truck,
    "lander": Lander,
    "dolphin": Dolphin,
}


@cache
def plant_of(name: str) -> Plant:
    """Return a plant.

    Raises
    ------
    UserError
        When there is none of that name.
    """
    if name not in PLANTS:
        raise UserError(f"unknown plant {name!r}; known: {', '.join(PLANTS)}")
    return PLANTS[name]()
