"""Bones that share a mesh: the regions part it without rest; tubes are closed and symmetric."""

from pathlib import Path

import numpy as np
import pytest

from anthro.body.meshes import MeshLibrary, mirrored
from anthro.body.regions import Region, Tube, faces_of, loft
from anthro.body.tables import read_table
from anthro.errors import UserError

TABLES = Path(__file__).resolve().parents[2] / "config" / "body"
SEEDS = read_table(TABLES / "regions.csv", Region)
PARTS = {
    "hat_skull": {
        "M": ["cranium", "vomer"],
        "R": ["inferior_nasal_concha", "lacrimal", "maxilla", "nasal", "palatine", "zygomatic"],
    },
    "thorax#1": {"M": ["costal_cartilage", "sternum"], "R": []},
    "sacrum": {"M": ["coccyx", "sacrum"], "R": []},
}


@pytest.fixture(scope="module")
def library():
    return MeshLibrary(TABLES)


def corners(mesh):
    """Each face as its sorted corner points, 1 nm fine: the same face has the same key."""
    keys = np.round(mesh.triangles * 1e9).astype(np.int64)
    return [tuple(sorted(map(tuple, face))) for face in keys.tolist()]


def test_every_seed_belongs_to_a_known_region():
    assert {(s.mesh, s.side, s.region) for s in SEEDS} == {
        (mesh, side, name) for mesh, sides in PARTS.items() for side in sides for name in sides[side]
    }
    assert all(seed.y_m < 0.0 for seed in SEEDS if seed.side == "R")


@pytest.mark.parametrize("mesh", PARTS)
def test_regions_part_the_mesh(library, mesh):
    whole = library.get(mesh)
    taken = [key for name in PARTS[mesh]["M"] for key in corners(library.get(f"{mesh}@{name}"))]
    right = [key for name in PARTS[mesh]["R"] for key in corners(library.get(f"{mesh}@{name}"))]
    # The left bones take the faces which the right ones take from the mirrored mesh.
    left = [key for name in PARTS[mesh]["R"] for key in corners(mirrored(faces_of(mirrored(whole), mesh, name, SEEDS)))]
    assert sorted(taken + right + left) == sorted(corners(whole))


@pytest.mark.parametrize("name", PARTS["hat_skull"]["R"])
def test_right_bones_lie_on_the_right(library, name):
    assert (library.get(f"hat_skull@{name}").triangles_center[:, 1] < 0.0).all()


def test_bones_stand_where_they_should(library):
    middle = {
        part: library.get(part).centroid
        for part in [f"hat_skull@{n}" for side in "MR" for n in PARTS["hat_skull"][side]]
        + ["sacrum@coccyx", "sacrum@sacrum", "tube:hyoid", "hat_jaw"]
    }
    skull = {part.removeprefix("hat_skull@"): at for part, at in middle.items()}
    assert skull["nasal"][0] > skull["lacrimal"][0] > skull["palatine"][0]
    assert skull["nasal"][2] > skull["zygomatic"][2] > skull["maxilla"][2]
    assert skull["zygomatic"][1] < skull["maxilla"][1] < skull["nasal"][1]
    assert abs(skull["vomer"][1]) < 1e-3
    assert middle["sacrum@coccyx"][2] < library.get("sacrum@sacrum").bounds[0, 2] + 0.005
    assert middle["tube:hyoid"][2] < middle["hat_jaw"][2]


def test_hyoid_is_closed_and_symmetric(library):
    hyoid = library.get("tube:hyoid")
    assert hyoid.is_watertight and hyoid.is_winding_consistent
    assert 1e-6 < hyoid.volume < 4e-6
    order = [np.lexsort(v.round(7).T) for v in (hyoid.vertices, mirrored(hyoid).vertices)]
    np.testing.assert_allclose(hyoid.vertices[order[0]], mirrored(hyoid).vertices[order[1]], atol=2e-7)


def tube(*points, radius=0.01):
    return [Tube(f"t_{k}", "t", float(k), *point, radius, "estimated", "made up") for k, point in enumerate(points)]


def test_straight_tube_has_the_volume_of_its_shape():
    mesh = loft(tube((0, 0, 0), (0, 0.05, 0), (0, 0.1, 0)), "t")
    assert mesh.is_watertight
    exact = np.pi * 0.01**2 * (0.1 + 4 / 3 * 0.01)
    assert 0.9 * exact < mesh.volume < exact


@pytest.mark.parametrize(
    ("cell", "word"),
    [
        ("hat_skull@beak", "beak"),
        ("hat_jaw@chin", "chin"),
        ("thorax#1@keel", "keel"),
        ("tube:trunk", "trunk"),
    ],
)
def test_unknown_names_are_refused(library, cell, word):
    with pytest.raises(UserError, match=word) as error:
        library.get(cell)
    assert "\n" not in str(error.value)


def test_region_without_faces_is_refused(library):
    seed = SEEDS[0]
    far = Region("far", seed.mesh, "far", "M", 9.0, 9.0, 9.0, "estimated", "made up")
    with pytest.raises(UserError, match="far"):
        faces_of(library.get(seed.mesh), seed.mesh, "far", [*SEEDS, far])


@pytest.mark.parametrize("rows", [tube((0, 0, 0)), tube((0, 0, 0), (0, 0, 1), radius=0.0)])
def test_impossible_tubes_are_refused(rows):
    with pytest.raises(UserError, match="two or more points"):
        loft(rows, "t")
