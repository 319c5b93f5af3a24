"""The arrays of a GLB: numbers in its bytes, plain, interleaved, normalised or sparse."""

from __future__ import annotations

import base64
import binascii
import struct
import urllib.parse

import numpy as np

from ..util.errors import MeshError
from .bounds import MAX_SCENE, MAX_TRIANGLES

TYPES = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


class GlbArrays:
    """The accessors of a GLB of bytes `data` and JSON `tree`, every one held to the bytes that are there."""

    def __init__(self, tree: dict, data: bytes):
        self.tree = tree
        self.arrays = tree.get("accessors", [])
        self.buffers = self._buffers(data)
        self.unfolded = 0

    def _buffers(self, data: bytes) -> list[bytes]:
        """The bytes of each buffer: what follows the JSON, or what stands in it."""
        after, binary = 20 + struct.unpack_from("<I", data, 12)[0], b""
        while after + 8 <= len(data):
            length, kind = struct.unpack_from("<I4s", data, after)
            if kind == b"BIN\0":
                binary = data[after + 8 : after + 8 + length]
                break
            after += 8 + length
        found = []
        for buffer in self.tree.get("buffers", []):
            if "uri" not in buffer:
                found.append(binary)
                continue
            head, _, text = str(buffer["uri"]).partition(",")
            if not head.startswith("data:"):
                raise MeshError("names another file, and none is opened; export it as one GLB")
            try:
                raw = urllib.parse.unquote_to_bytes(text)
                found.append(base64.b64decode(raw) if head.endswith(";base64") else raw)
            except binascii.Error as error:
                raise MeshError("has a buffer that is no base64; export the mesh again") from error
        return found

    def array(self, which: int, kind: str) -> np.ndarray:
        """The numbers `(count, width)` of an accessor: normalised ones as fractions, sparse ones filled in.

        kind : the glTF type that it must have. Raises MeshError where it has another, or reaches beyond its bytes.
        """
        array = self.arrays[which]
        if array["type"] != kind:
            raise MeshError(f"an array of {kind} is of type {str(array['type'])[:20]!r}; export the mesh again")
        count, width, plain = int(array["count"]), WIDTHS[kind], np.dtype(TYPES[array["componentType"]])
        if "bufferView" in array:
            rows = self._rows(array["bufferView"], int(array.get("byteOffset", 0)), count, width, plain)
        else:
            rows = np.broadcast_to(np.zeros(1, plain), (count, width))
        if "sparse" in array or "bufferView" not in array:
            self.unfolded += count  # arrays that take more room than they have bytes
            if self.unfolded > 3 * MAX_SCENE * MAX_TRIANGLES:
                raise MeshError("its sparse arrays unfold to more than is read; simplify the mesh")
        if "sparse" in array:
            sparse = array["sparse"]
            here, values, few = sparse["indices"], sparse["values"], int(sparse["count"])
            places = np.dtype(TYPES[here["componentType"]])
            at = self._rows(here["bufferView"], int(here.get("byteOffset", 0)), few, 1, places)[:, 0]
            if few and int(at.max()) >= count:
                raise MeshError("its sparse arrays reach outside of themselves; export the mesh again")
            rows = rows.copy()
            rows[at] = self._rows(values["bufferView"], int(values.get("byteOffset", 0)), few, width, plain)
        if array.get("normalized") and plain.kind in "iu":
            return np.maximum(rows.astype(np.float64) / np.iinfo(plain).max, -1)
        return rows

    def _rows(self, view: int, offset: int, count: int, width: int, plain: np.dtype) -> np.ndarray:
        """`(count, width)` numbers as they lie in a buffer's view, without a copy."""
        view = self.tree["bufferViews"][view]
        buffer, start, length = self.buffers[view["buffer"]], int(view.get("byteOffset", 0)), int(view["byteLength"])
        row = width * plain.itemsize
        stride = int(view.get("byteStride", row))
        last = offset + (count - 1) * stride + row
        if min(view["buffer"], start, length, offset, count) < 0 or stride < row:
            raise MeshError("its arrays make no sense; export the mesh again")
        if count and (last > length or start + last > len(buffer)):
            raise MeshError("is cut off: its arrays reach beyond its bytes; export the mesh again")
        if not count:
            return np.empty((0, width), plain)
        return np.ndarray((count, width), plain, buffer, start + offset, (stride, plain.itemsize))
