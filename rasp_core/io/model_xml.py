"""The XML of a 3MF's models: long lists of vertices and triangles are taken out before a parser makes a tree."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator

import numpy as np

from .text import floats, integers

OPTIONS = {"resolve_entities": False, "no_network": True, "load_dtd": False, "huge_tree": False}
LISTS = {"vertices": ("vertex", ("x", "y", "z")), "triangles": ("triangle", ("v1", "v2", "v3"))}
OPENS = re.compile(rb"<(vertices|triangles)>")
ROWS = {
    "vertices": re.compile(rb'<vertex\s+x="([^"<&]*)"\s+y="([^"<&]*)"\s+z="([^"<&]*)"\s*/>'),
    "triangles": re.compile(rb'<triangle\s+v1="([^"<&]*)"\s+v2="([^"<&]*)"\s+v3="([^"<&]*)"(?:\s[^<>]*)?/>'),
}
STANDS_FOR = "list-of-this-file"  # an element that no 3MF has


class ModelXml:
    """One model. Its elements come from `elements`; their lists are read by `count` and `numbers`."""

    def __init__(self, text: bytes):
        self.lists: list[bytes] = []
        # comments, CDATA and declarations can hide tags, and other encodings have other bytes: the parser has it all
        plain = b"<!" not in text and b"\0" not in text[:100] and STANDS_FOR.encode() not in text
        self.text = b"".join(self._without_lists(text)) if plain else text

    def _without_lists(self, text: bytes) -> Iterator[bytes]:
        at = 0
        while True:
            found = OPENS.search(text, at)
            if not found:
                break
            name = found[1].decode()
            begin, end = found.end(), text.find(b"</" + found[1] + b">", found.end())
            if end < 0:
                break
            yield text[at:begin]
            inside = text[begin:end]
            if inside.count(b"<") == inside.count(f"<{LISTS[name][0]} ".encode()):
                yield f'<{STANDS_FOR} number="{len(self.lists)}"/>'.encode()
                self.lists.append(inside)
            else:
                yield inside
            at = end
        yield text[at:]

    def elements(self, *names: str) -> Iterator[tuple[str, object]]:
        """("start" or "end", element) of the elements of these local names. Raises lxml's XMLSyntaxError."""
        from lxml import etree

        tags = [f"{{*}}{name}" for name in names]
        yield from etree.iterparse(io.BytesIO(self.text), ("start", "end"), tag=tags, **OPTIONS)

    def _list(self, element) -> bytes | None:
        stands = next(element.iterchildren(f"{{*}}{STANDS_FOR}"), None)
        return None if stands is None else self.lists[int(stands.get("number"))]

    def count(self, element) -> int:
        """How many triangles lie in an element, at any depth."""
        inside = [self._list(one) for one in element.iter("{*}triangles")]
        listed = sum(one.count(b"<") for one in inside if one is not None)
        return listed + sum(1 for _ in element.iter("{*}triangle"))

    def numbers(self, mesh, name: str) -> np.ndarray:
        """`(N, 3)` of a mesh's "vertices" (float64) or "triangles" (int64). Raises MeshError where one is no number."""
        kind, attributes = LISTS[name]
        element = mesh.find(f"{{*}}{name}")  # the first, as extensions have vertices and triangles of their own
        read = floats if name == "vertices" else integers
        if element is None:
            return read([]).reshape(-1, 3)
        inside = self._list(element)
        if inside is None:
            return read([row.get(a, "") for row in element.iterchildren(f"{{*}}{kind}") for a in attributes]).reshape(
                -1, 3
            )
        rows = ROWS[name].findall(inside)
        if len(rows) != inside.count(b"<"):  # attributes in another order
            rows = [[_attribute(row, a) for a in attributes] for row in inside.split(b"<")[1:]]
        return read([word for row in rows for word in row]).reshape(-1, 3)


def _attribute(row: bytes, name: str) -> bytes:
    found = re.search(rb"\s" + name.encode() + rb"\s*=\s*(?:\"([^\"]*)\"|'([^']*)')", row)
    return (found[1] if found[1] is not None else found[2]) if found else b""
