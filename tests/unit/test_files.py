"""Files are whole or absent; shards are refused unless complete."""

import resource
import subprocess
import sys

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from anthro import files
from anthro.errors import UserError


def columns():
    return {"offset": np.arange(6, dtype=np.float32).reshape(2, 3), "drive": np.ones((2, 29), np.float32)}


def test_atomic_failure_keeps_the_older_file_and_no_litter(tmp_path):
    path = tmp_path / "deep" / "out.txt"
    with files.atomic(path) as partial:
        partial.write_text("old")
    with pytest.raises(ValueError), files.atomic(path) as partial:
        partial.write_text("half")
        raise ValueError
    assert path.read_text() == "old"
    assert [found.name for found in path.parent.iterdir()] == ["out.txt"]


def test_atomic_sweeps_what_a_killed_writer_left(tmp_path):
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    leftover = tmp_path / f".partial-{ended.pid}-out.h5"
    other = tmp_path / f".partial-{ended.pid}-else.h5"
    leftover.touch()
    other.touch()
    with files.atomic(tmp_path / "out.h5") as partial:
        assert partial.suffix == ".h5"
        partial.touch()
    assert not leftover.exists() and other.exists()


def test_shard_round_trip_and_same_bytes(tmp_path):
    first, second = tmp_path / "a.h5", tmp_path / "b.h5"
    for path in (first, second):
        files.write_shard(path, columns(), {"seed": 3, "limb": "right_arm"})
    assert first.read_bytes() == second.read_bytes()
    found, attrs = files.read_shard(first, ["drive", "offset"])
    assert list(found) == ["drive", "offset"]
    np.testing.assert_array_equal(found["offset"], columns()["offset"])
    assert attrs["seed"] == 3 and attrs["limb"] == "right_arm"


@pytest.mark.parametrize("kept", [0, 100, 0.5, 0.99])
def test_truncated_shard_is_refused_by_name(tmp_path, kept):
    path = tmp_path / "shard0001.h5"
    files.write_shard(path, columns())
    whole = path.read_bytes()
    path.write_bytes(whole[: kept if isinstance(kept, int) else int(kept * len(whole))])
    with pytest.raises(UserError, match="shard0001.h5"):
        files.read_shard(path)


def test_shard_without_mark_missing_file_and_missing_column(tmp_path):
    path = tmp_path / "shard.h5"
    with h5py.File(path, "w") as file:
        file["drive"] = np.ones(3)
    with pytest.raises(UserError, match=r"shard.h5.*complete"):
        files.read_shard(path)
    with pytest.raises(UserError, match=r"none.h5: no such file"):
        files.read_shard(tmp_path / "none.h5")
    files.write_shard(path, columns())
    with pytest.raises(UserError, match=r"shard.h5.*strain"):
        files.read_shard(path, ["strain"])


def test_full_disk_is_one_line_and_loses_nothing(tmp_path):
    path = tmp_path / "shard.h5"
    files.write_shard(path, columns())
    whole = path.read_bytes()
    code = (
        "import sys, numpy as np; from anthro import cli, files\n"
        "def main(argv): files.write_shard(argv[0], {'drive': np.ones(100_000)})\n"
        "sys.exit(cli.run(main, sys.argv[1:]))"
    )
    limit = 50_000  # bytes a file may have, as a disk that is full
    told = subprocess.run(
        [sys.executable, "-c", code, str(path)],
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)),
        capture_output=True,
        text=True,
    )
    assert told.returncode == 2
    assert told.stderr.startswith("error:") and "shard.h5" in told.stderr
    assert len(told.stderr.strip().splitlines()) == 1
    assert path.read_bytes() == whole
    assert len(list(tmp_path.iterdir())) == 1


def test_json_round_trip_sorts_keys_and_names_a_bad_file(tmp_path):
    path = tmp_path / "card.json"
    files.write_json(path, {"b": np.float64(1.5), "a": np.arange(2)})
    assert path.read_text().index('"a"') < path.read_text().index('"b"')
    assert files.read_json(path) == {"a": [0, 1], "b": 1.5}
    path.write_text("{")
    with pytest.raises(UserError, match="card.json"):
        files.read_json(path)
    with pytest.raises(UserError, match="none.json"):
        files.read_json(tmp_path / "none.json")


@settings(max_examples=30, deadline=None)
@given(st.dictionaries(st.text(max_size=5), st.integers() | st.floats(allow_nan=False), max_size=5))
def test_digest_ignores_the_order_of_keys(content):
    assert files.digest(content) == files.digest(dict(reversed(content.items())))
    assert files.digest(content) != files.digest({**content, "one more": 1})
