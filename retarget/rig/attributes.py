"""What a glTF primitive says of its vertices and triangles, as checked arrays.

Reference: glTF 2.0, sections 3.7.2 (meshes) and 3.7.3.3 (skinned mesh attributes).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from retarget.errors import InputError
from retarget.rig.fields import LARGEST
from retarget.rig.glb import DAMAGED

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.rig.fields import Fields
    from retarget.rig.glb import Glb

LIST, STRIP = 4, 5


def read_floats(glb: Glb, index: int, shape: tuple[int, ...], count: int | None = None) -> NDArray[np.float64]:
    """An accessor with elements of `shape`, all finite; InputError unless there are `count`, where it is given."""
    fields = glb.entry("accessors", index)
    if count is not None and fields.integer("count") != count:
        raise InputError(f"{fields.place} has {fields.integer('count')} elements for {count} vertices; {DAMAGED}.")
    values = glb.array(index)
    if values.shape[1:] != shape:
        raise InputError(f"{fields.place} has elements of shape {values.shape[1:]} where {shape} is needed; {DAMAGED}.")
    floats = values.astype(np.float64)
    if not (np.abs(floats) < LARGEST).all():
        raise InputError(f"{fields.place} holds values that are not finite; mend the mesh and export it again.")
    return floats


def read_optional(
    glb: Glb, attributes: Fields, key: str, shape: tuple[int, ...], count: int
) -> NDArray[np.float32] | None:
    """The attribute `key` of `count` vertices; None where there is none."""
    if key not in attributes:
        return None
    return read_floats(glb, attributes.integer(key), shape, count).astype(np.float32)


def read_colors(glb: Glb, attributes: Fields, count: int) -> NDArray[np.float32] | None:
    """(V, 4) linear RGBA; colours of three parts are opaque. None where there are none."""
    if "COLOR_0" not in attributes:
        return None
    kind = glb.entry("accessors", attributes.integer("COLOR_0")).text("type")
    colors = read_optional(glb, attributes, "COLOR_0", (3,) if kind == "VEC3" else (4,), count)
    return colors if colors is None or kind != "VEC3" else np.pad(colors, ((0, 0), (0, 1)), constant_values=1.0)


def read_triangles(glb: Glb, primitive: Fields, count: int) -> NDArray[np.int32]:
    """(F, 3) indices of the `count` vertices, whether given as a list, a strip or a fan."""
    order = np.arange(count, dtype=np.int32)
    if "indices" in primitive:
        given = glb.array(primitive.integer("indices"))
        if given.ndim != 1 or given.dtype.kind != "u" or (given >= count).any():
            raise InputError(f"{primitive.place} has triangles beyond the {count} vertices there are; {DAMAGED}.")
        order = given.astype(np.int32)
    mode = primitive.integer("mode", LIST)
    if mode == LIST or len(order) < 3:
        return order[: len(order) // 3 * 3].reshape(-1, 3)
    if mode == STRIP:
        corners = [order[:-2], order[1:-1], order[2:]]
        strip = np.stack(corners, axis=-1)
        strip[1::2] = strip[1::2][:, [0, 2, 1]]  # every other triangle of a strip is listed the other way round
        return strip
    return np.stack([order[1:-1], order[2:], np.full(len(order) - 2, order[0])], axis=-1)


def read_influences(
    glb: Glb, attributes: Fields, joints: int, count: int
) -> tuple[NDArray[np.intp], NDArray[np.float32]]:
    """(V, I) joint numbers below `joints` and their weights, of every set that is given; rows of weights add up to 1.

    A vertex without any weight goes with the skin's first joint.
    """
    numbers: list[NDArray[np.unsignedinteger]] = []
    weights: list[NDArray[np.float64]] = []
    while f"JOINTS_{len(numbers)}" in attributes and f"WEIGHTS_{len(numbers)}" in attributes:
        weight = np.maximum(read_floats(glb, attributes.integer(f"WEIGHTS_{len(weights)}"), (4,), count), 0.0)
        number = glb.array(attributes.integer(f"JOINTS_{len(numbers)}"))
        if number.shape != weight.shape or number.dtype.kind != "u" or (number[weight > 0] >= joints).any():
            raise InputError(f"{attributes.place}, JOINTS_{len(numbers)} names joints beyond the {joints} of the skin.")
        numbers.append(np.where(weight > 0, number, 0))
        weights.append(weight)
    if not numbers:
        raise InputError(
            f"{attributes.place} lacks JOINTS_0 and WEIGHTS_0, though its node has a skin; export it again."
        )
    number, weight = np.concatenate(numbers, axis=1).astype(np.intp), np.concatenate(weights, axis=1)
    weight[~weight.any(axis=1), 0] = 1.0
    used = weight.any(axis=0)
    weight = weight[:, used] / weight.sum(axis=1, keepdims=True)
    return number[:, used], weight.astype(np.float32)
