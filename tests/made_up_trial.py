"""A small made-up trial."""

from types import SimpleNamespace

import numpy as np
import pytest

from graspbench.grasp.configuration import Grasp
from graspbench.perception.camera import Camera, Intrinsics, View
from graspbench.perception.silhouette import silhouette_of_mask
from graspbench.reconstruction.network import build_network
from graspbench.reconstruction.surface import Surface


def sphere_surface(radius, iteration=0, at_rest=False):
    meridians, parallels = 10, 9
    network = build_network(meridians, parallels)
    polar = np.repeat(np.arange(1, parallels + 1) / (parallels + 1) * np.pi, meridians)
    azimuth = np.tile(np.arange(meridians) / meridians * 2 * np.pi, parallels)
    ring = np.column_stack((np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)))
    directions = np.vstack(([0, 0, 1.0], ring, [0, 0, -1.0]))
    return Surface(
        radius * directions + [0, 0, 0.1], directions, np.array([0, 0, 0.1]), network, iteration, at_rest
    )


@pytest.fixture
def trial():
    surfaces = [sphere_surface(0.08 - 0.01 * k, k, k == 4) for k in range(5)]
    surface = surfaces[-1]
    vertices = np.array([41, 44, 47])
    grasp = Grasp(vertices, surface.points[vertices], surface.normals[vertices], surface.centroid)
    pose = np.eye(4)
    pose[:3, :3] = np.diag([1.0, -1.0, -1.0])
    pose[2, 3] = 0.6
    camera = Camera(Intrinsics(64, 48, 60.0, 60.0, 32.0, 24.0), pose)
    image = np.full((48, 64, 3), 200, dtype=np.uint8)
    mask = np.zeros((48, 64), dtype=bool)
    mask[10:30, 20:45] = True
    image[mask] = (250, 30, 10)
    views = [View(f"outer-{k}", image, camera) for k in range(3)]
    return SimpleNamespace(
        surfaces=surfaces, grasp=grasp, views=views,
        silhouettes=[silhouette_of_mask(view.station, mask, camera) for view in views],
    )  # fmt: skip
