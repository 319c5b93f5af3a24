"""A judge of packed parts that reads scene.glb alone, with trimesh and manifold3d: counts, gaps and turns.

python tests/judge.py SCENE.GLB [X,Y,Z] [PART=TURNS ...]    # box edges; such as arrow=z clip=90
"""

from __future__ import annotations

import sys
from collections import Counter

import manifold3d
import numpy as np
import trimesh


def read(path):
    """Name -> (solid where it lies, rotation `(3, 3)` of its node) of all objects but the container."""
    scene, found = trimesh.load_scene(path), {}
    for node in scene.graph.nodes_geometry:
        if node == "container":
            continue
        matrix, geometry = scene.graph[node]
        mesh = scene.geometry[geometry].copy()
        mesh.apply_transform(matrix)
        mesh.merge_vertices(merge_tex=True, merge_norm=True)
        vertices, faces = np.ascontiguousarray(mesh.vertices, np.float64), np.ascontiguousarray(mesh.faces, np.uint64)
        found[node] = manifold3d.Manifold(manifold3d.Mesh64(vertices, faces)), matrix[:3, :3]
    return found


def counts(objects) -> Counter:
    """How many copies there are of each part."""
    return Counter(name.split("#")[0] for name in objects)


def least_gap(objects) -> float:
    """Of all pairs."""
    solids = [solid for solid, _ in objects.values()]
    low, high = (np.array([s.bounding_box()[k : k + 3] for s in solids]) for k in (0, 3))
    reach = float(np.linalg.norm(high.max(0) - low.min(0)))
    return min((a.min_gap(b, reach) for i, a in enumerate(solids) for b in solids[:i]), default=np.inf)


def least_to_box(objects, size) -> float:
    """Of all objects to the walls of a box about the origin; negative where one sticks out."""
    half = np.asarray(size) / 2
    boxes = [np.array(solid.bounding_box()).reshape(2, 3) for solid, _ in objects.values()]
    return min(float((half - np.abs(box)).min()) for box in boxes)


def most_shared_on_the_way(objects, loading, samples=200) -> float:
    """The largest share of the smaller one's volume that a part, at samples of its straight way in, has in common with
    one that is there. loading : result.json's, name, direction and length of each; the others are there before."""
    names = [step["name"] for step in loading]
    there, worst = [objects[name][0] for name in objects if name not in names], 0.0
    for step in loading:
        solid = objects[step["name"]][0]
        for away in np.linspace(step["length"], 0, samples):
            moved = solid.translate(-away * np.array(step["direction"]))
            low, high = np.reshape(moved.bounding_box(), (2, 3))
            for other in there:
                below, above = np.reshape(other.bounding_box(), (2, 3))
                if (low < above).all() and (below < high).all():
                    worst = max(worst, (moved ^ other).volume() / min(moved.volume(), other.volume()))
        there.append(solid)
    return worst


def off_by(turns: str, rotation: np.ndarray, down=None) -> float:
    """How far a rotation is from the turns asked, as the largest error of an entry.

    down `(N, 3)` : for flat:N, normals in the file of the faces that may be down.
    """
    if turns == "any":
        return float(np.abs(rotation @ rotation.T - np.eye(3)).max())
    if turns == "none":
        return float(np.abs(rotation - np.eye(3)).max())
    if turns == "z":
        return float(np.abs(rotation[2] - (0, 0, 1)).max())
    if turns == "90":
        return float(np.abs(np.abs(rotation) - np.round(np.abs(rotation))).max())
    return min(float(np.abs(rotation @ normal - (0, 0, -1)).max()) for normal in down)


if __name__ == "__main__":
    seen = read(sys.argv[1])
    print(dict(counts(seen)), f"least gap {least_gap(seen):.7g}")
    for word in sys.argv[2:]:
        if "=" in word:
            part, asked = word.split("=")
            worst = max(off_by(asked, turn) for name, (_, turn) in seen.items() if name.split("#")[0] == part)
            print(f"{part} is off {asked} by {worst:.2g}")
        else:
            print(f"least gap to the wall {least_to_box(seen, list(map(float, word.split(',')))):.7g}")
