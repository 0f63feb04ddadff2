"""Both retinas and the activations beside a film frame."""

import numpy as np
import pytest
from PIL import Image
from render_bodies import INSTANTS, record, write_body

from anthro import cli
from anthro.errors import UserError
from anthro.eyes.layout import layout
from anthro.files import read_shard, write_shard
from anthro.render import film
from anthro.render.retinas import Retinas, nearest_receptor, retina
from anthro.render.rollout import read_rollout

SEED = 7


@pytest.fixture
def run(tmp_path):
    """A run whose rollout holds a picture on both retinas: red above the fovea, blue below it; no picture later."""
    write_body(tmp_path)
    pictures = []
    for side in ("left", "right"):
        up = layout("log_polar", side, SEED).retina_deg[:, 1] > 0
        pictures.append(np.where(up[:, None], [200, 0, 0], [0, 0, 200]).ravel())
    nerve = np.tile(np.array(pictures, np.uint8), (INSTANTS, 1, 1))
    nerve[60:] = 0
    record(tmp_path, "cannon", nerve=nerve)
    return tmp_path


def test_pixels_show_the_nearest_receptor_up_where_it_is_up():
    receptors = layout("log_polar", "left", SEED)
    index = nearest_receptor(receptors, 61)
    assert index.shape == (61, 61) and index[0, 0] == -1 and index[30, 30] >= 0
    place = receptors.retina_deg
    assert np.hypot(*place[index[30, 30]]) < 1.0
    assert place[index[5, 30], 1] > 40 and place[index[30, 55], 0] > 40


def test_a_receptors_bytes_are_shown_as_a_display_wants_them():
    picture = retina(np.array([0, 255, 55, 255, 0, 0], np.uint8), np.array([[0, 1], [-1, -1]]))
    assert picture[0].tolist() == [[0, 255, 127], [255, 0, 0]]
    assert (picture[1] == picture[1, 0]).all() and np.ptp(picture[1, 0]) == 0


def test_panels_hold_both_retinas_and_bars_that_rise_with_activation(run):
    rollout = read_rollout(run, "cannon")
    panels = Retinas(rollout, 200, 240)
    lit, dark = (panels.draw(rollout.at(np.array([time]))) for time in (1.0, 11.0))
    assert lit.shape == (240, 200, 3) and lit.dtype == np.uint8
    red = (lit[..., 0] > 180) & (lit[..., 1] < 60) & (lit[..., 2] < 60)
    blue = (lit[..., 2] > 180) & (lit[..., 0] < 60)
    halves = [one[:, half].sum() for one in (red, blue) for half in (slice(0, 100), slice(100, 200))]
    assert min(halves) > 200 and max(halves) < 1.3 * min(halves)
    assert np.nonzero(red)[0].mean() < np.nonzero(blue)[0].mean()
    assert not ((dark[:100, :, 0] > 180) & (dark[:100, :, 1] < 60)).any()
    silent = read_rollout(run, "cannon").at(np.array([5.0]))
    assert (lit[130:] != panels.draw(silent)[130:]).any(), "activations are not shown"


def test_a_film_of_what_is_seen_has_the_size_that_is_asked_for(run):
    out = run / "a.png"
    request = ["--run", str(run), "--demo", "cannon", "--width", "160", "--height", "120", "--out", str(out)]
    assert cli.run(film.main, [*request, "--at", "1"]) == 0
    assert Image.open(out).size == (160, 120)


def test_nerves_of_another_retina_are_refused(run):
    path = run / "demos" / "cannon" / "rollout.h5"
    columns, attrs = read_shard(path)
    columns["nerve"] = columns["nerve"][:, :, :30]
    write_shard(path, columns, {name: value for name, value in attrs.items() if name != "complete"})
    with pytest.raises(UserError, match="do not fit the retina"):
        Retinas(read_rollout(run, "cannon"), 100, 100)
