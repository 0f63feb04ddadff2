"""The figure of times."""

import pytest

from anthro import cli, registry
from anthro.demos import timing as demo
from anthro.figures.nakada2018 import timing
from anthro.files import write_json


@pytest.fixture
def metrics():
    """Times as the demo tells them, 0.1 ms each, those of the papers from the demo's own table."""
    senses = {"right_arm": "position", "right_leg": "position", "core": "orientation"}
    return {limb: demo.compared(senses.get(limb, "gaze"), dict.fromkeys(timing.PARTS, 1e-4)) for limb in timing.LIMBS}


def test_times_of_all_limbs_are_drawn(tmp_path, metrics):
    write_json(tmp_path / "demos" / "timing" / "metrics.json", metrics)
    for name in ("a.png", "b.png"):
        assert cli.run(timing.main, ["--run", str(tmp_path), "--out", str(tmp_path / name)]) == 0
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert tuple(timing.LIMBS) == registry.DEMOS["timing"].limbs == demo.LIMBS


def test_a_missing_limb_is_named_in_one_line(tmp_path, metrics, capsys):
    del metrics["core"]["reflex_pair"]
    write_json(tmp_path / "demos" / "timing" / "metrics.json", metrics)
    assert cli.run(timing.main, ["--run", str(tmp_path), "--out", str(tmp_path / "a.png")]) == 2
    told = capsys.readouterr().err
    assert told.count("\n") == 1 and "core: no 'reflex_pair'" in told
