"""Exports a frame as binary glTF (KHR_gaussian_splatting, SPEC Annex C.2) with pygltflib.

The extension does not support animation, so each frame is a separate file. The attributes are
rotated so that +y is up, and scaled to meters if the stream declares a scale. The file has no node
rotation, because not all readers apply node rotations to SH.
"""

from typing import Any

import numpy as np

from quarc_ref.decoder.dequantize import Float32, Splats
from quarc_ref.export.activate import compute_opacities, compute_scales, convert_to_xyzw
from quarc_ref.export.clip import Clip, Frame
from quarc_ref.export.upright import rotate_upright

_EXTENSION = "KHR_gaussian_splatting"
_EXTENSION_PROPERTIES = {
    "kernel": "ellipse",
    "colorSpace": "srgb_rec709_display",
    "sortingMethod": "cameraDistance",
    "projection": "perspective",
}


def build(frame: Frame, clip: Clip) -> bytes:
    """Build the `.glb` file of a frame."""
    import pygltflib as gltf

    attributes = _list_attributes(rotate_upright(frame.splats, clip), clip.meters_per_unit)
    model = gltf.GLTF2(
        asset=gltf.Asset(version="2.0", generator="quarc-ref"),
        extensionsUsed=[_EXTENSION],
        scene=0,
        scenes=[gltf.Scene(nodes=[0])],
        nodes=[gltf.Node(name=f"frame {frame.scene.frame}", mesh=0)],
    )
    accessor_by_name: dict[str, int] = {}
    offset = 0
    for number, (name, array) in enumerate(attributes.items()):
        model.bufferViews.append(
            gltf.BufferView(buffer=0, byteOffset=offset, byteLength=array.nbytes)
        )
        model.accessors.append(_make_accessor(gltf, number, name, array))
        accessor_by_name[name] = number
        offset += array.nbytes
    primitive = gltf.Primitive(
        attributes=gltf.Attributes(**accessor_by_name),
        mode=gltf.POINTS,
        extensions={_EXTENSION: _EXTENSION_PROPERTIES},
    )
    model.meshes = [gltf.Mesh(primitives=[primitive])]
    model.buffers = [gltf.Buffer(byteLength=offset)]
    model.set_binary_blob(b"".join(array.tobytes() for array in attributes.values()))
    return b"".join(model.save_to_bytes())


def _list_attributes(splats: Splats, meters_per_unit: float) -> dict[str, Float32]:
    """Return the attributes of the glTF primitive, each `[N, c]` or `[N]`."""
    attributes = {
        "POSITION": splats.positions * np.float32(meters_per_unit),
        "ROTATION": convert_to_xyzw(splats.rotations),
        "SCALE": compute_scales(splats) * np.float32(meters_per_unit),
        "OPACITY": compute_opacities(splats),
        "SH_DEGREE_0_COEF_0": splats.sh[:, 0],
    }
    for coefficient in range(splats.sh.shape[1] - 1):
        attributes[f"SH_DEGREE_1_COEF_{coefficient}"] = splats.sh[:, 1 + coefficient]
    return {
        name if name == "POSITION" else f"{_EXTENSION}:{name}": np.ascontiguousarray(array, "<f4")
        for name, array in attributes.items()
    }


def _make_accessor(gltf: Any, buffer_view: int, name: str, array: Float32) -> Any:  # noqa: ANN401
    element_type = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}[array.size // len(array)]
    accessor = gltf.Accessor(
        bufferView=buffer_view, componentType=gltf.FLOAT, count=len(array), type=element_type
    )
    if name == "POSITION":  # glTF requires bounds
        accessor.min, accessor.max = array.min(axis=0).tolist(), array.max(axis=0).tolist()
    return accessor
