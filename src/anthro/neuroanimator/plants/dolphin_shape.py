"""The dolphin's anatomy: 23 point masses in a nose, five square sections and two flukes, 91 springs, 42 faces.

The paper gives the numbers of masses, segments and muscles, and the simulator as that of Tu & Terzopoulos (1994),
whose fish has 23 masses and 91 springs. Where they lie, their sizes and their stiffness are chosen here.
"""

from __future__ import annotations

import numpy as np

SECTIONS = (  # x, half width, half height of each square section, head to tail, m
    (0.70, 0.12, 0.12),
    (0.35, 0.20, 0.20),
    (0.00, 0.22, 0.22),
    (-0.35, 0.17, 0.17),
    (-0.70, 0.08, 0.09),
)
NOSE = (1.0, 0.0, 0.0)
FLUKES = ((-1.0, 0.28, 0.0), (-1.0, -0.28, 0.0))  # left, right
DENSITY_MASS = 100.0  # kg, of the whole
CORNERS = ((1, 1), (-1, 1), (-1, -1), (1, -1))  # left top, right top, right bottom, left bottom
MUSCLED = (1, 2, 3)  # sections behind which a segment has a dorsal and a ventral muscle
DORSAL, VENTRAL = (0, 1), (2, 3)  # corners that a muscle pulls along


def points() -> np.ndarray:
    """Rest positions of the masses, (23, 3) m: nose, sections, flukes."""
    corners = [(x, w * y, h * z) for x, w, h in SECTIONS for y, z in CORNERS]
    return np.array([NOSE, *corners, *FLUKES])


def node(section: int, corner: int) -> int:
    """Index of a section's corner."""
    return 1 + 4 * section + corner % 4


def segments() -> list[np.ndarray]:
    """Masses of each of the six body segments: neighbours share the section between them."""
    quads = [np.arange(node(s, 0), node(s, 0) + 4) for s in range(5)]
    between = [np.concatenate(pair) for pair in zip(quads[:-1], quads[1:], strict=True)]
    return [np.concatenate([[0], quads[0]]), *between, np.concatenate([quads[-1], [21, 22]])]


def springs() -> np.ndarray:
    """Pairs of masses, (91, 2)."""
    pairs = [(0, node(0, c)) for c in range(4)]
    for s in range(5):
        pairs += [(node(s, c), node(s, c + 1)) for c in range(4)]
        pairs += [(node(s, 0), node(s, 2)), (node(s, 1), node(s, 3))]
    for s in range(4):
        for c in range(4):
            pairs += [(node(s, c), node(s + 1, other)) for other in (c, c + 1, c + 3)]
    pairs += [(node(4, c), fluke) for fluke in (21, 22) for c in range(4)] + [(21, 22)]
    return np.sort(np.array(pairs), axis=1)


def muscles() -> np.ndarray:
    """Which muscle contracts each spring, (91,); -1 for those that none does. Dorsal ones first, head to tail."""
    owner = {}
    for number, (corners, s) in enumerate((corners, s) for corners in (DORSAL, VENTRAL) for s in MUSCLED):
        owner |= {(node(s, c), node(s + 1, c)): number for c in corners}
    return np.array([owner.get(tuple(pair), -1) for pair in springs().tolist()])


def faces() -> np.ndarray:
    """Triangles of the skin, (42, 3), corners against the clock seen from outside."""
    triangles = [(0, node(0, c), node(0, c + 1)) for c in range(4)]
    for s in range(4):
        for c in range(4):
            a, b, d, e = node(s, c), node(s, c + 1), node(s + 1, c), node(s + 1, c + 1)
            mirrored = (c + s) % 2 if c % 2 == 0 else c == 3  # left as right; above and below by turns
            triangles += [(a, d, e), (a, e, b)] if mirrored else [(a, d, b), (b, d, e)]
    lt, rt, rb, lb = (node(4, c) for c in range(4))
    triangles += [(lt, 21, rt), (rt, 21, 22), (rb, 21, lb), (rb, 22, 21), (lt, lb, 21), (rt, 22, rb)]
    return outward(points(), np.array(triangles))


def outward(rest: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Turn triangles so that their normals point away from the body's axis."""
    a, b, c = (rest[triangles[:, k]] for k in range(3))
    middle = (a + b + c) / 3
    inner = middle * [1, 0, 0]
    inner[:, 0] = np.clip(inner[:, 0], -0.7, 0.7)
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), middle - inner) < 0
    triangles = triangles.copy()
    triangles[inward] = triangles[inward][:, [0, 2, 1]]
    return triangles


def masses() -> np.ndarray:
    """Mass of each point, (23,) kg: by the size of its section."""
    sizes = np.concatenate([[0.02], np.repeat([w * h + 0.02 for _, w, h in SECTIONS], 4), [0.02, 0.02]])
    return DENSITY_MASS * sizes / sizes.sum()
