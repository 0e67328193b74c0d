"""Silhouettes from masks that came with the images."""

from dataclasses import replace

import numpy as np

from graspbench.arrays import BoolArray
from graspbench.errors import ImageError
from graspbench.perception.camera import Camera, View
from graspbench.perception.silhouette import Silhouette, describe


def given_silhouette(view: View) -> Silhouette:
    """Describe the mask that came with a view; where it meets the border, the object goes on beyond."""
    mask, k = view.mask, view.camera.intrinsics
    assert mask is not None, "only views with a mask are asked"
    if not mask.any():
        raise ImageError(f"the mask of station {view.station} is empty", station=view.station)
    sides = (mask[0].any(), mask[-1].any(), mask[:, 0].any(), mask[:, -1].any())
    if not any(sides):
        return _described_mask(view.station, mask, view.camera)
    # Beyond a side that cuts the object nothing is known, so that nothing there may be carved away.
    margin = max(k.width, k.height) // 2
    wide = np.pad(mask, margin)
    wide[1:margin, 1:-1] |= sides[0]
    wide[-margin:-1, 1:-1] |= sides[1]
    wide[1:-1, 1:margin] |= sides[2]
    wide[1:-1, -margin:-1] |= sides[3]
    k = replace(k, width=wide.shape[1], height=wide.shape[0], cx=k.cx + margin, cy=k.cy + margin)
    found = _described_mask(view.station, wide, Camera(k, view.camera.transform_camera_to_world))
    seen = np.argwhere(mask).mean(axis=0)[::-1] + 0.5
    return replace(found, margin_px=margin, centroid=seen + margin)


def _described_mask(station: str, mask: BoolArray, camera: Camera) -> Silhouette:
    whole = (0, mask.shape[0], 0, mask.shape[1])
    return describe(station, mask, whole, mask.astype(np.float32), camera, fills=True)
