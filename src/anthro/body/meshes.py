"""Bone surfaces in the assembly frame: placed, split, mirrored.

A bone's ``mesh`` cell reads ``name`` (a whole file of ``meshes.csv``), ``name#k`` (its k-th
connected component, most faces first) or either of these with ``@region`` (the faces nearest to
that region's seeds in ``regions.csv``, see :mod:`anthro.body.regions`). ``tube:name`` is lofted
from ``tubes.csv``.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import myo_sim
import numpy as np
import trimesh

from anthro.body.regions import Region, Tube, faces_of, loft
from anthro.body.tables import read_table
from anthro.errors import UserError

# OpenSim's axes (x forward, y up, z right) in ours (x forward, y left, z up).
OPENSIM = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
MIRROR = np.array([1.0, -1.0, 1.0])


@dataclass(frozen=True)
class Placement:
    """Where a mesh file of myo-sim stands in the assembly frame.

    point = turn(pitch about y) OPENSIM (scale file point) + (x, y, z).
    """

    mesh: str
    file: str
    x_m: float
    y_m: float
    z_m: float
    pitch_deg: float
    scale: float
    quality: str
    source: str

    def place(self, vertices: np.ndarray) -> np.ndarray:
        """File vertices (n, 3) in the assembly frame, m."""
        c, s = np.cos(np.deg2rad(self.pitch_deg)), np.sin(np.deg2rad(self.pitch_deg))
        turn = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
        return self.scale * vertices @ (turn @ OPENSIM).T + (self.x_m, self.y_m, self.z_m)


def mirrored(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """The left twin of a right bone: y changes sign, faces keep looking outward."""
    return trimesh.Trimesh(mesh.vertices * MIRROR, mesh.faces[:, ::-1], process=False)


class MeshLibrary:
    """All bone surfaces that the tables in ``tables`` name, in the assembly frame."""

    def __init__(self, tables: Path):
        self._tables = Path(tables)
        self._placements = {p.mesh: p for p in read_table(self._tables / "meshes.csv", Placement)}
        self._whole, self._parts = {}, {}

    def get(self, cell: str) -> trimesh.Trimesh:
        """The surface that a bone's ``mesh`` cell names.

        Raises
        ------
        UserError
            Unknown mesh, component or region, or a file that myo-sim does not have.
        """
        if cell.startswith("tube:"):
            return loft(self._tubes, cell.removeprefix("tube:"))
        name, _, region = cell.partition("@")
        if region:
            return faces_of(self._load(name), name, region, self._regions)
        name, _, component = cell.partition("#")
        if component:
            parts = self._components(name)
            if not component.isdigit() or int(component) >= len(parts):
                raise UserError(f"mesh {cell!r}: {name} has components 0 to {len(parts) - 1}")
            return parts[int(component)]
        return self._load(name)

    @cached_property
    def _regions(self) -> list[Region]:
        return read_table(self._tables / "regions.csv", Region)

    @cached_property
    def _tubes(self) -> list[Tube]:
        return read_table(self._tables / "tubes.csv", Tube)

    def _load(self, name: str) -> trimesh.Trimesh:
        if "#" in name:
            return self.get(name)
        if name not in self._whole:
            if name not in self._placements:
                raise UserError(f"mesh {name!r} is not in {self._tables / 'meshes.csv'}")
            placement = self._placements[name]
            path = Path(myo_sim.__file__).parent / "models" / "meshes" / placement.file
            if not path.is_file():
                raise UserError(f"myo-sim has no mesh {placement.file}")
            mesh = trimesh.load(path, force="mesh")
            mesh.merge_vertices()
            self._whole[name] = trimesh.Trimesh(placement.place(mesh.vertices), mesh.faces, process=False)
        return self._whole[name]

    def _components(self, name: str) -> list[trimesh.Trimesh]:
        if name not in self._parts:
            parts = self._load(name).split(only_watertight=False)
            self._parts[name] = sorted(parts, key=lambda part: (-len(part.faces), *part.bounds[0].round(6)))
        return self._parts[name]
