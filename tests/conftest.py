"""The right arm, built once a session; limbs of random networks; a run folder made of them."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import settings

from anthro.body import Body
from anthro.body.build import build
from anthro.files import write_json
from anthro.motor.network import FeedForward

# The same examples every time, however busy the machine.
settings.register_profile("anthro", deadline=None, derandomize=True)
settings.load_profile("anthro")

ROOT = Path(__file__).resolve().parents[1]
MUSCLES = 29


@pytest.fixture(scope="session")
def arm_folder(tmp_path_factory):
    """Folder of the built right arm."""
    folder = tmp_path_factory.mktemp("body") / "right_arm"
    build("right_arm", ROOT / "config" / "body", folder, seed=1)
    return folder


@pytest.fixture(scope="session")
def arm(arm_folder):
    """The built right arm."""
    return Body.load(arm_folder)


@pytest.fixture(scope="session")
def whole_folder(tmp_path_factory):
    """Folder of the whole body, its fibers fitted over few postures."""
    folder = tmp_path_factory.mktemp("body") / "zhou2021"
    build("zhou2021", ROOT / "config" / "body", folder, seed=1, samples=300)
    return folder


@pytest.fixture(scope="session")
def whole(whole_folder):
    """The built whole body."""
    return Body.load(whole_folder)


def random_network(n_in, n_out, hidden, seed, scale):
    """He-initialised network whose outputs are about ``scale``."""
    rng = np.random.default_rng(seed)
    sizes = [n_in, *hidden, n_out]
    layers = list(zip(sizes[:-1], sizes[1:], strict=True))
    matrices = [rng.normal(0.0, np.sqrt(2.0 / a), (b, a)) for a, b in layers]
    matrices[-1] *= scale
    return FeedForward(matrices, [np.zeros(b) for _, b in layers])


def save_networks(folder, hidden, scale=0.01):
    """Save a limb's three random networks under ``folder`` as a run does."""
    widths = {
        "right_arm_voluntary_paper": 3 + MUSCLES,
        "right_arm_voluntary_proprioceptive": 3 + 2 * MUSCLES,
        "right_arm_reflex": 2 * MUSCLES,
    }
    for seed, (name, width) in enumerate(widths.items()):
        (folder / name).mkdir(parents=True, exist_ok=True)
        random_network(width, MUSCLES, hidden, seed, scale).save(folder / name / "weights.h5")
    return folder


@pytest.fixture(scope="session")
def tiny_nets(tmp_path_factory):
    """Folder with networks of one hidden layer of eight."""
    return save_networks(tmp_path_factory.mktemp("nets"), [8])


@pytest.fixture(scope="session")
def data_spec():
    """Function of role and keys to change: the merged spec of a small data set."""

    def spec(role, **changes):
        table = yaml.safe_load((ROOT / "config" / "data" / f"right_arm_{role}.yaml").read_text())
        if role == "voluntary":
            table["postures"]["targets"] = 6
        return table | {"limb": "right_arm", "pairs": 60, "seed": 7} | changes

    return spec


@pytest.fixture
def run_folder(tmp_path, arm_folder, data_spec):
    """A run as the demos find it: body, specs, and random networks of the papers' size."""
    run = tmp_path / "run"
    (run / "body").mkdir(parents=True)
    (run / "body" / "right_arm").symlink_to(arm_folder)
    save_networks(run / "nets", [300] * 6)
    for role in ("voluntary", "reflex"):
        write_json(run / "specs" / "data" / f"right_arm_{role}.json", data_spec(role))
    return run


@pytest.fixture
def refusal(capsys):
    """Function that runs a command line, expects exit code 2 and gives its one line of error."""
    from anthro import cli

    def refused(main, arguments):
        capsys.readouterr()
        assert cli.run(main, [str(argument) for argument in arguments]) == 2
        told = capsys.readouterr().err
        lines = [line for line in told.splitlines() if not line.startswith("pairs")]
        assert len(lines) == 1 and lines[0].startswith("error: "), told
        return lines[0]

    return refused
