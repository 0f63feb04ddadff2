"""Bodies and limbs, built once a session with the whole body's fibers; random networks; a run folder made of them."""

import shutil
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import settings

from anthro import config
from anthro.body import Body
from anthro.body.build import build
from anthro.body.parts import BODIES
from anthro.files import write_json
from anthro.motor.limb import Limb, limb_plan
from anthro.motor.network import FeedForward

# The same examples every time, however busy the machine.
settings.register_profile("anthro", deadline=None, derandomize=True)
settings.load_profile("anthro")

ROOT = Path(__file__).resolve().parents[1]
TABLES = ROOT / "config" / "body"
FIT_SAMPLES, REPORT_SAMPLES = 300, 10  # postures of the fit, and of bodies whose fibers are given
# What each limb is told of its target, components, and its muscles.
LIMB_WIDTHS = {
    "right_arm": (3, 29),
    "left_arm": (3, 29),
    "right_leg": (3, 39),
    "left_leg": (3, 39),
    "neck_seated": (2, 216),
    "neck": (2, 244),
    "core": (3, 443),
}


@pytest.fixture(scope="session")
def body_folder(tmp_path_factory):
    """Function of a body's name: its folder, built once a session."""
    root = tmp_path_factory.mktemp("bodies")

    @cache
    def folder(name):
        parent = BODIES[name].fibers_of
        fibers = None if parent is None else folder(parent)
        build(name, TABLES, root / name, 1, REPORT_SAMPLES if fibers else FIT_SAMPLES, fibers)
        return root / name

    return folder


@pytest.fixture(scope="session")
def load_body(body_folder):
    """Function of a body's name: the body, loaded once a session."""
    return cache(lambda name: Body.load(body_folder(name)))


@pytest.fixture(scope="session")
def limb_keys():
    """Function of a limb's name: the keys of its plan."""
    return lambda name: yaml.safe_load((ROOT / "config" / "limbs" / f"{name}.yaml").read_text()) | {"name": name}


@pytest.fixture(scope="session")
def limb(load_body, limb_keys):
    """Function of a limb's name: the limb on its own training body, or on another one."""

    @cache
    def on(name, body=None):
        plan = limb_plan(limb_keys(name))
        return Limb(plan, load_body(body or plan.body))

    return on


@pytest.fixture(scope="session")
def arm_folder(body_folder):
    """Folder of the built right arm."""
    return body_folder("right_arm")


@pytest.fixture(scope="session")
def arm(load_body):
    """The built right arm."""
    return load_body("right_arm")


@pytest.fixture(scope="session")
def whole_folder(body_folder):
    """Folder of the whole body, its fibers fitted over few postures."""
    return body_folder("zhou2021")


@pytest.fixture(scope="session")
def whole(load_body):
    """The built whole body."""
    return load_body("zhou2021")


def random_network(n_in, n_out, hidden, seed, scale):
    """He-initialised network whose outputs are about ``scale``."""
    rng = np.random.default_rng(seed)
    sizes = [n_in, *hidden, n_out]
    layers = list(zip(sizes[:-1], sizes[1:], strict=True))
    matrices = [rng.normal(0.0, np.sqrt(2.0 / a), (b, a)) for a, b in layers]
    matrices[-1] *= scale
    return FeedForward(matrices, [np.zeros(b) for _, b in layers])


def save_networks(folder, hidden, limbs=LIMB_WIDTHS, scale=0.01):
    """Save the three random networks of each limb under ``folder`` as a run does."""
    for limb in limbs:
        width, muscles = LIMB_WIDTHS[limb]
        roles = {
            "voluntary_paper": width + muscles,
            "voluntary_proprioceptive": width + 2 * muscles,
            "reflex": 2 * muscles,
        }
        for seed, (role, n_in) in enumerate(roles.items()):
            target = folder / f"{limb}_{role}"
            target.mkdir(parents=True, exist_ok=True)
            random_network(n_in, muscles, hidden, seed, scale).save(target / "weights.h5")
    return folder


@pytest.fixture(scope="session")
def tiny_nets(tmp_path_factory):
    """Folder with networks of one hidden layer of eight, of all limbs."""
    return save_networks(tmp_path_factory.mktemp("nets"), [8])


@pytest.fixture(scope="session")
def data_spec(limb_keys):
    """Function of role, limb and keys to change: the merged spec of a small data set."""

    def spec(role, limb="right_arm", **changes):
        table = yaml.safe_load((ROOT / "config" / "data" / f"{limb}_{role}.yaml").read_text())
        if role == "voluntary":
            table["postures"]["targets"] = 6
        return table | {"limb": limb_keys(limb), "pairs": 60, "seed": 7} | changes

    return spec


@pytest.fixture
def run_folder(tmp_path, body_folder, tiny_nets, data_spec):
    """A run as the demos find it: bodies, specs, and random networks of all limbs."""
    run = tmp_path / "run"
    (run / "body").mkdir(parents=True)
    for name in BODIES:
        (run / "body" / name).symlink_to(body_folder(name))
    shutil.copytree(tiny_nets, run / "nets")
    for limb in LIMB_WIDTHS:
        for role in ("voluntary", "reflex"):
            write_json(run / "specs" / "data" / f"{limb}_{role}.json", data_spec(role, limb))
    write_json(run / "specs" / "feedback.json", config.load({"scale": "smoke"}, ROOT)["feedback"])
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
