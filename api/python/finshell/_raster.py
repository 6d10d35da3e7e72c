"""Lit triangles as pixels: a depth buffer in numpy, shaded where something is seen.

Every pixel knows its triangle and where in it it lies, so normals and values are interpolated exactly, hidden parts are hidden
whatever cuts or folds there are, and lines of the mesh are drawn by their distance in pixels.
"""
from __future__ import annotations

from typing import Any, Callable, NamedTuple, Optional, Tuple

import numpy as np

from ._library import Doubles

SAMPLES = 2  # per pixel and direction
CREASE = np.cos(np.radians(40.0))
CHUNK = 2_000_000  # pixels looked at side by side


class View(NamedTuple):
    """Unit vectors of an orthographic view: across and up in the picture, and toward the eye."""

    across: Doubles
    up: Doubles
    toward: Doubles


def view_from(azimuth: float, elevation: float) -> View:
    """The view from a direction in degrees: azimuth from +x towards +y, elevation above the plane of x and y."""
    a, e = np.radians([azimuth, elevation])
    across = np.array([-np.sin(a), np.cos(a), 0.0])
    toward = np.array([np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)])
    return View(across, np.cross(toward, across), toward)


def unit(vectors: Doubles) -> Doubles:
    """Vectors of length 1; zero stays zero."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.where(length > 0, length, 1.0)


def corner_normals(points: Doubles, triangles: "np.ndarray") -> Doubles:
    """(m, 3, 3): normals at the corners of triangles, the mean over the neighbours that no crease divides from them."""
    corners = points[triangles]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal = unit(area)
    order = np.argsort(triangles, axis=None, kind="stable")
    nodes, faces = triangles.ravel()[order], order // 3
    total = area[faces].copy()
    for shift in range(1, int(np.bincount(nodes).max(initial=1))):
        first = np.flatnonzero(nodes[shift:] == nodes[:-shift])
        f, g = faces[first], faces[first + shift]
        cosine = np.einsum("ij,ij->i", normal[f], normal[g])
        sign = np.where(np.abs(cosine) > CREASE, np.sign(cosine), 0.0)[:, None]  # triangles may be turned against each other
        np.add.at(total, first, sign * area[g])
        np.add.at(total, first + shift, sign * area[f])
    result = np.empty((triangles.size, 3))
    result[order] = unit(total)
    return result.reshape(-1, 3, 3)


def sharp_edges(points: Doubles, triangles: "np.ndarray") -> "np.ndarray":
    """(m, 3): whether the edge opposite to corner i is free, or one of more than two triangles."""
    ends = np.sort(triangles[:, [[1, 2], [2, 0], [0, 1]]], axis=2)
    key = ends[..., 0].astype(np.int64) * len(points) + ends[..., 1]
    _, where, count = np.unique(key, return_inverse=True, return_counts=True)
    return (count[where] != 2).reshape(key.shape)


class Fragments(NamedTuple):
    """What is seen in the pixels where something is."""

    pixel: "np.ndarray"  # index in the flat image
    face: "np.ndarray"
    weight: Doubles  # (k, 3) of the corners


def rasterise(xy: Doubles, depth: Doubles, width: int, height: int) -> Fragments:
    """The nearest triangle in each pixel. xy (m, 3, 2): corners in pixels, y downward; depth (m, 3): larger is nearer."""
    low = np.clip(np.ceil(xy.min(axis=1) - 0.5), 0, [width, height]).astype(np.int64)
    high = np.clip(np.floor(xy.max(axis=1) - 0.5) + 1, 0, [width, height]).astype(np.int64)
    extent = np.maximum(high - low, 0)
    count = extent.prod(axis=1)
    a, b, c = xy[:, 0], xy[:, 1], xy[:, 2]
    double = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    count[np.abs(double) < 1e-12] = 0
    nearest = np.full(width * height, -np.inf)
    seen = np.full(width * height, -1, dtype=np.int64)
    ends = np.cumsum(count)
    first = 0
    while first < len(count):
        before = ends[first - 1] if first else 0
        last = max(int(np.searchsorted(ends, before + CHUNK)), first + 1)
        n = count[first:last]
        face = np.repeat(np.arange(first, last), n)
        at = np.arange(len(face)) - np.repeat(np.cumsum(n) - n, n)
        x, y = low[face, 0] + at % np.maximum(extent[face, 0], 1), low[face, 1] + at // np.maximum(extent[face, 0], 1)
        weight = weights(xy, double, face, x + 0.5, y + 0.5)
        inside = (weight >= -1e-9).all(axis=1)
        face, pixel, weight = face[inside], (y * width + x)[inside], weight[inside]
        z = np.einsum("ij,ij->i", weight, depth[face])
        np.maximum.at(nearest, pixel, z)
        wins = z >= nearest[pixel]
        seen[pixel[wins]] = face[wins]
        first = last
    pixel = np.flatnonzero(seen >= 0)
    face = seen[pixel]
    return Fragments(pixel, face, weights(xy, double, face, pixel % width + 0.5, pixel // width + 0.5))


def weights(xy: Doubles, double: Doubles, face: "np.ndarray", x: "np.ndarray", y: "np.ndarray") -> Doubles:
    """(k, 3) barycentric coordinates of points in triangles."""
    (ax, ay), (bx, by), (cx, cy) = (xy[face, i].T for i in range(3))
    area = double[face]
    area = np.where(area == 0, 1.0, area)
    wb = ((x - ax) * (cy - ay) - (y - ay) * (cx - ax)) / area
    wc = ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / area
    return np.stack([1 - wb - wc, wb, wc], axis=1)


def draw(points: Doubles, triangles: "np.ndarray", colour: "Colour", view: View, width: int, height: int,
         window: Tuple[float, float, float], edges: Optional[bool] = None, lit: bool = True) -> Doubles:
    """(height, width, 3) picture with values 0 to 1 on white. window: centre across and up, and length per pixel.

    edges: lines of the mesh; None: where its triangles are large enough for them.
    """
    big = np.array([width, height]) * SAMPLES
    scale = SAMPLES / window[2]
    flat = np.stack([(points @ view.across - window[0]) * scale + big[0] / 2,
                     (window[1] - points @ view.up) * scale + big[1] / 2], axis=1)
    xy = flat[triangles]
    seen = rasterise(xy, (points @ view.toward)[triangles], int(big[0]), int(big[1]))
    rgb = colour.of(seen.face, seen.weight, triangles)
    normals = corner_normals(points, triangles)
    if lit:
        n = unit(np.einsum("ij,ijk->ik", seen.weight, normals[seen.face]))
        n *= np.where(np.einsum("ij,j->i", n, view.toward) < 0, -1.0, 1.0)[:, None]
        lamp = unit(-0.45 * view.across + 0.55 * view.up + 0.8 * view.toward)
        half = unit(lamp + view.toward)
        diffuse, shine = np.clip(n @ lamp, 0, 1), np.clip(n @ half, 0, 1) ** 40
        rgb = np.clip(rgb * (0.6 + 0.44 * diffuse)[:, None] + 0.10 * shine[:, None], 0, 1)
    sides = np.linalg.norm(xy[:, [2, 0, 1]] - xy[:, [1, 2, 0]], axis=2)
    area = 0.5 * np.abs((xy[:, 1, 0] - xy[:, 0, 0]) * (xy[:, 2, 1] - xy[:, 0, 1]) - (xy[:, 1, 1] - xy[:, 0, 1]) * (xy[:, 2, 0] - xy[:, 0, 0]))
    if edges is None:
        edges = bool(np.median(np.sqrt(area)) > 5 * SAMPLES)
    distance = seen.weight * (2 * area[:, None] / np.maximum(sides, 1e-12))[seen.face]  # of a pixel from the sides, in pixels
    if edges:
        rgb *= 1 - 0.28 * np.clip(1.2 - distance.min(axis=1) / (0.35 * SAMPLES), 0, 1)[:, None]
    outline = np.where(sharp_edges(points, triangles)[seen.face], distance, np.inf).min(axis=1)
    rgb *= 1 - 0.7 * np.clip(1.5 - outline / (0.6 * SAMPLES), 0, 1)[:, None]
    picture = np.ones((int(big[0] * big[1]), 3))
    picture[seen.pixel] = rgb
    return picture.reshape(height, SAMPLES, width, SAMPLES, 3).mean(axis=(1, 3))


class Colour:
    """Colours of a field: constant in each triangle, or linear between its nodes."""

    def __init__(self, values: Doubles, on_nodes: bool, norm: Callable[[Any], Any], palette: Callable[[Any], Any]) -> None:
        self._values, self._on_nodes, self._norm, self._palette = values, on_nodes, norm, palette

    def of(self, face: "np.ndarray", weight: Doubles, triangles: "np.ndarray") -> Doubles:
        """(k, 3) colours of points of triangles."""
        if self._on_nodes:
            values = np.einsum("ij,ij->i", weight, self._values[triangles[face]])
        else:
            values = self._values[face]
        return np.asarray(self._palette(self._norm(np.ma.masked_invalid(values)))[:, :3])
