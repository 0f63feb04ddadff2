"""Command lines, random streams, run cards and progress."""

import numpy as np
import pytest

from anthro import cli, progress
from anthro.errors import UserError
from anthro.files import digest, read_json
from anthro.runcard import RunCard
from anthro.streams import stream


@pytest.mark.parametrize("error", [UserError("no limb\n'left_tail'"), OSError(28, "No space left on device")])
def test_bad_input_is_one_line_and_exit_code_2(capsys, error):
    def main(argv):
        raise error

    assert cli.run(main, []) == 2
    told = capsys.readouterr().err
    assert told.startswith("error: ") and told.count("\n") == 1


def test_exit_codes_and_bugs_pass_through():
    assert cli.run(lambda argv: None, []) == 0
    assert cli.run(lambda argv: 3, []) == 3
    with pytest.raises(ZeroDivisionError):
        cli.run(lambda argv: 1 / 0, [])


def test_streams_repeat_and_differ():
    draws = stream(7, "voluntary", 1).random(4)
    np.testing.assert_array_equal(draws, stream(7, "voluntary", 1).random(4))
    for other in (stream(8, "voluntary", 1), stream(7, "reflex", 1), stream(7, "voluntary", 2)):
        assert not np.isin(draws, other.random(4)).any()


def test_stream_has_not_moved():
    """A change here would change every data set."""
    assert stream(7, "right_arm_voluntary", 3).integers(1_000_000, size=3).tolist() == [613095, 255268, 612605]


def test_run_card_tells_what_made_an_artefact(tmp_path):
    path = tmp_path / "run_card.json"
    with RunCard(path, spec={"pairs": 10}, seed=7) as card:
        card.note(pairs=10)
        assert not path.exists()
    content = read_json(path)
    assert content["spec_digest"] == digest({"pairs": 10})
    assert {"git_commit", "versions", "wall_seconds", "device", "seed", "pairs"} <= content.keys()
    assert content["versions"]["numpy"] == np.__version__


def test_no_run_card_of_a_failure(tmp_path):
    with pytest.raises(ValueError), RunCard(tmp_path / "run_card.json", spec={}):
        raise ValueError
    assert not list(tmp_path.iterdir())


def test_progress_tells_in_lines_when_not_on_a_terminal(capsys, monkeypatch):
    clock = iter([0, 10, 31, 31, 40, 41, 42, 43])
    monkeypatch.setattr(progress.time, "monotonic", lambda: next(clock))
    assert list(progress.progress(range(3), label="epochs")) == [0, 1, 2]
    assert capsys.readouterr().err.splitlines() == [
        "epochs: 2/3 (67 %) in 31 s",
        "epochs: 3/3 (100 %) in 41 s",
    ]
