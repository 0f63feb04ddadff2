"""A pinhole camera in the world's frame: x forward, y left, z up, metres."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

UP = np.array([0.0, 0.0, 1.0])


def view_direction(azimuth_deg: float, elevation_deg: float) -> np.ndarray:
    """Unit vector from the camera to what it looks at.

    Parameters
    ----------
    azimuth_deg : float
        Where the camera stands, counted about z from the front of the body (+x) to its left (+y):
        0 faces the body, -90 stands at its right.
    elevation_deg : float
        Height of the camera above the horizon of its target.

    Returns
    -------
    ndarray (3,)
    """
    azimuth, elevation = np.deg2rad([azimuth_deg, elevation_deg])
    horizontal = np.cos(elevation) * np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    return -(horizontal + np.sin(elevation) * UP)


@dataclass(frozen=True)
class Camera:
    """Pinhole camera.

    Parameters
    ----------
    position, target : ndarray (3,)
        Where it stands and what is at the centre of its picture, m.
    width, height : int
        Pixels.
    fov_deg : float
        Vertical field of view.
    """

    position: np.ndarray
    target: np.ndarray
    width: int
    height: int
    fov_deg: float = 24.0

    @classmethod
    def framing(
        cls,
        points: np.ndarray,
        azimuth_deg: float,
        elevation_deg: float,
        width: int,
        height: int,
        fov_deg: float = 24.0,
        margin: float = 0.06,
    ) -> Camera:
        """The nearest camera of that direction that keeps all points inside its picture.

        Parameters
        ----------
        points : ndarray (n, 3)
            m.
        azimuth_deg, elevation_deg, fov_deg : float
            As in `view_direction` and the class.
        width, height : int
            Pixels.
        margin : float
            Share of the picture left free at every edge.

        Returns
        -------
        Camera
        """
        forward = view_direction(azimuth_deg, elevation_deg)
        right = _unit(np.cross(forward, UP))
        axes = np.stack([right, np.cross(right, forward), forward])
        across, upward, depth = axes @ np.asarray(points, float).T
        slope_up = np.tan(np.deg2rad(fov_deg) / 2) * (1 - 2 * margin)
        slope_across = slope_up * width / height
        # |x - cx| <= slope (z - cz) at both sides gives the centre and the distance of each axis.
        centre_across, back_across = _fit_axis(across, depth, slope_across)
        centre_up, back_up = _fit_axis(upward, depth, slope_up)
        start = min(back_across, back_up)
        middle = (depth.min() + depth.max()) / 2
        position = np.array([centre_across, centre_up, start]) @ axes
        target = np.array([centre_across, centre_up, middle]) @ axes
        return cls(position, target, width, height, fov_deg)

    @property
    def axes(self) -> np.ndarray:
        """Right, up and forward of the picture as rows (3, 3)."""
        forward = _unit(np.asarray(self.target, float) - self.position)
        right = _unit(np.cross(forward, UP))
        return np.stack([right, np.cross(right, forward), forward])

    @property
    def _half_height(self) -> float:
        return float(np.tan(np.deg2rad(self.fov_deg) / 2))

    def rays(self, columns: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """Unit directions through picture positions.

        Parameters
        ----------
        columns, rows : ndarray (n,)
            Pixels from the upper left corner; a pixel's centre is at half an integer.

        Returns
        -------
        ndarray (n, 3)
        """
        scale = 2 * self._half_height / self.height
        local = np.empty((len(columns), 3))
        local[:, 0] = (columns - self.width / 2) * scale
        local[:, 1] = (self.height / 2 - rows) * scale
        local[:, 2] = 1.0
        local /= np.linalg.norm(local, axis=1, keepdims=True)
        return local @ self.axes

    def project(self, points: np.ndarray) -> np.ndarray:
        """Picture positions (n, 2), columns and rows in pixels, of points (n, 3) in metres."""
        across, upward, depth = self.axes @ (np.asarray(points, float) - self.position).T
        scale = self.height / (2 * self._half_height)
        columns = self.width / 2 + scale * across / depth
        return np.stack([columns, self.height / 2 - scale * upward / depth], axis=1)


def _fit_axis(offset: np.ndarray, depth: np.ndarray, slope: float) -> tuple[float, float]:
    low = (offset - slope * depth).max()
    high = (offset + slope * depth).min()
    return (low + high) / 2, (high - low) / (2 * slope)


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.linalg.norm(vector)
