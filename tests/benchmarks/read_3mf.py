"""A run's parts.3mf read by lib3mf, which is not ours: how many parts, their names, and how far from where they are.

python tests/benchmarks/read_3mf.py FOLDER          (pip install lib3mf)

FOLDER is a run with --export 3mf,csv. Places are compared by the corners of the parts' boxes with those of scene.glb.
"""

import sys
from pathlib import Path

import lib3mf
import numpy as np

from rasp_core.visualize.gltf import read_scene


def read(path):
    """Corners of each part's box, millimetres, by name."""
    library = lib3mf.Wrapper()
    model = library.CreateModel()
    model.QueryReader("3mf").ReadFromFile(str(path))
    found, items = {}, model.GetBuildItems()
    while items.MoveNext():
        item = items.GetCurrent()
        points, resource = [], item.GetObjectResource()
        for outer, mesh in meshes(model, resource, np.eye(4)):
            corners = np.array([list(vertex.Coordinates) for vertex in mesh.GetVertices()])
            points.append(corners @ outer[:3, :3].T + outer[:3, 3])
        points = np.concatenate(points)
        found[resource.GetName()] = np.stack([points.min(0), points.max(0)])
    return found


def meshes(model, resource, outer):
    """Meshes of an object and where they are, through its components."""
    if resource.IsMeshObject():
        yield outer, model.GetMeshObjectByID(resource.GetResourceID())
        return
    whole = model.GetComponentsObjectByID(resource.GetResourceID())
    for k in range(whole.GetComponentCount()):
        component, matrix = whole.GetComponent(k), np.eye(4)
        matrix[:3] = np.array([list(row) for row in component.GetTransform().Fields]).T
        yield from meshes(model, component.GetObjectResource(), outer @ matrix)


def main():
    folder = Path(sys.argv[1])
    bodies, _ = read_scene(folder)
    found = read(folder / "parts.3mf")
    ours = {body.name: body.vertices for body in bodies}
    print(f"{len(found)} parts, {len(ours)} in scene.glb; names {'agree' if found.keys() == ours.keys() else 'DIFFER'}")
    ends = {name: np.stack([points.min(0), points.max(0)]) for name, points in ours.items()}
    furthest = max(float(np.abs(found[name] / 1000 - ends[name]).max()) for name in found.keys() & ends.keys())
    print(f"places differ by {furthest:.1e} m at most")


if __name__ == "__main__":
    main()
