"""What the commands of the command line do: input from options, a run's folder, one line of result, the exit status.

Everything heavy is imported where it is used, so that a wrong argument is answered at once.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

from ..io.atomic_files import whole
from ..util.errors import InputError

SWEPT = (
    *("method", "time_limit", "effort", "repeat", "fit_objects", "iterations", "resolution", "device"),
    *("azimuths_deg", "elevations_deg"),
)
AZIMUTHS = {2: [0.0, 90.0], 3: [0.0, 120.0, 240.0], 4: [0.0, 45.0, 90.0, 135.0]}  # of art's views, where none are given


def pack(options: argparse.Namespace) -> int:
    """Pack objects into a container."""
    from .. import density
    from ..api import run_folder
    from ..packing import methods
    from ..physics import disassembly, gravity
    from ..problem import Settings
    from ..util.devices import resolve_device

    began = time.monotonic()
    count = _count(options.count)
    _check_time(options)
    settings = Settings(
        iterations=options.iterations,
        lambda_=options.lambda_,
        epsilon=options.epsilon,
        resolution=options.resolution,
        seed=options.seed,
    )
    folder = run_folder.check_writable(options.out)
    device = resolve_device(options.device)
    bodies, container, scale = methods.load(
        *(options.objects, options.container, options.repeat, options.fit_objects, options.seed),
        *(options.azimuths_deg, options.elevations_deg),
    )
    budget = options.time_limit, options.effort
    method = methods.resolve_method(options.method, container)
    packed = methods.search(method, bodies, container, count, settings, device, *budget, progress=True)
    arrangement, certificate = packed.arrangement, packed.certificate
    placed, container = arrangement.problem.bodies, arrangement.problem.container
    voxel = float(max(container.bounds[1] - container.bounds[0])) / 160
    facts = {
        "command": "pack",
        "method": method,
        "pool": len(bodies),
        "object_scale": scale,
        "density": packed.density,
        "density_voxels": density.voxel_density(placed, arrangement.matrices, container, voxel),
        "voxel": voxel,
        "rounds": packed.rounds,
        "device": str(device),
        "seconds": time.monotonic() - began,
    }
    removed = disassembly.remove_all(placed, arrangement.matrices)
    facts["removal"], scenes = removed.to_dict(), {}
    print(f"rasp: {_removal(removed)}", file=sys.stderr)
    if options.settle:
        settled = gravity.settle(placed, arrangement.matrices, container)
        facts["settled"], scenes["settled.glb"] = settled.to_dict(), settled.matrices
        for line in settled.lines():
            print(f"rasp: {line}", file=sys.stderr)
    run_folder.save_run(folder, arrangement, certificate, facts, packed.history, scenes)
    _say(len(placed), packed.density, certificate, folder)
    return 0 if certificate.holds else 1


def assemble(options: argparse.Namespace) -> int:
    """Put the parts of a broken thing back together."""
    from ..api import run_folder
    from ..assembly import assemble
    from ..geometry import containers, meshes
    from ..geometry.cameras import Camera
    from ..io import images
    from ..packing import result
    from ..problem import Settings

    began = time.monotonic()
    folder = run_folder.check_writable(options.out)
    if options.whole is not None:
        whole, parts = containers.from_mesh(options.whole), meshes.load_bodies(options.parts)
        found = assemble.assemble(parts, whole, options.seed, progress=True)
    else:
        angles = options.azimuths_deg, options.elevations_deg
        if options.width is None or not len(options.silhouettes) == len(angles[0]) == len(angles[1]):
            raise InputError(
                f"silhouettes need --width and as many --azimuths-deg and --elevations-deg, got {len(angles[0])} and "
                f"{len(angles[1])} for {len(options.silhouettes)} pictures"
            )
        cameras = [Camera(*pair, options.width) for pair in zip(*angles, strict=True)]
        images, parts = images.read_silhouettes(options.silhouettes), meshes.load_bodies(options.parts)
        found = assemble.assemble_by_silhouettes(parts, images, cameras, options.seed, progress=True)
    settings = Settings(seed=options.seed)
    drawn = result.finish(parts, list(range(len(parts))), found.start, found.whole, settings)
    facts = {
        "command": "assemble",
        "scores": {body.name: float(score) for body, score in zip(parts, found.scores, strict=True)},
        "likeness": None if found.likeness is None else found.likeness.tolist(),
        "warnings": list(found.warnings),
        "seconds": time.monotonic() - began,
    }
    run_folder.save_run(folder, drawn.arrangement, drawn.certificate, facts)
    for line in found.warnings:
        print(f"rasp: {line}", file=sys.stderr)
    shared = drawn.certificate.overlap_volume / sum(body.volume for body in parts)
    name, fit = ("fit of their surfaces", found.scores) if found.likeness is None else ("likeness", found.likeness)
    print(
        f"{folder}: {len(parts)} parts, {name}: {fit.mean():.1%} in the mean, {fit.min():.1%} at least; "
        f"{shared:.2%} of the volume shared"
    )
    return 1 if found.warnings else 0


def art(options: argparse.Namespace) -> int:
    """Heap objects up so that each side shows another picture."""
    import numpy as np

    from ..api import run_folder
    from ..art import anamorphic, glyphs, texturing
    from ..geometry import meshes
    from ..geometry.cameras import Camera
    from ..io import images
    from ..util.devices import resolve_device
    from ..visualize import gltf, scene3d

    _check_time(options)
    for name, value, least in (("--resolution", options.resolution, 32), ("--count", options.count, 1)):
        if value is not None and value < least:
            raise InputError(f"{name} must be at least {least}, got {value}")
    shown = options.targets or options.text
    azimuths = options.azimuths_deg or AZIMUTHS.get(len(shown), [0.0] * len(shown))
    elevations = options.elevations_deg or [0.0] * len(azimuths)
    if not len(shown) == len(azimuths) == len(elevations):
        raise InputError(
            f"each of {len(shown)} pictures needs an azimuth and an elevation, got {len(azimuths)}, {len(elevations)}"
        )
    angles = zip(azimuths, elevations, strict=True)
    cameras = [Camera(*pair, options.width or 1.0, projection=options.projection) for pair in angles]
    folder, device = run_folder.check_writable(options.out), resolve_device(options.device)
    colours = painted = None
    if options.targets:
        targets, colours = images.read_targets(options.targets, options.resolution)
        wanted = {folder: targets}
    else:
        if options.paint:
            raise InputError("letters have no colours; --paint needs pictures, --targets")
        found = glyphs.letters(options.text, options.resolution, square=any(elevations))
        places = [folder] if len(found) == 1 else [folder / f"{k + 1}" for k in range(len(found))]
        wanted = dict(zip(places, found, strict=True))
    pool, holds = meshes.load_bodies(options.objects), True
    for place, targets in wanted.items():
        began = time.monotonic()
        limits = options.count, options.width, options.seed, device, options.time_limit
        to_paint = colours if options.paint else None
        made = anamorphic.sculpt(pool, targets, cameras, *limits, progress=True, colours=to_paint)
        for line in anamorphic.disagreements(made.pictures, made.hull, cameras):
            print(f"rasp: {line}", file=sys.stderr)
        facts = {"command": "art", **made.to_dict(), "device": str(device), "seconds": time.monotonic() - began}
        images = {f"target_{k + 1}.png": np.where(t, 0, 255).astype(np.uint8) for k, t in enumerate(targets)}
        if options.paint:
            bodies, run = made.arrangement.problem.bodies, made.arrangement
            painted = texturing.Canvas(bodies, run.matrices, run.cameras, options.resolution).paint(colours)
            noise, alike = texturing.measure(painted, colours)
            facts |= {"psnr": noise.tolist(), "ssim": alike.tolist()}
            images["painted.png"] = (255 * np.concatenate(painted.images, 1)).astype(np.uint8)
            print(f"rasp: painted, PSNR {noise.min():.1f} dB, SSIM {alike.min():.2f} at least", file=sys.stderr)
        if options.pictures:
            images["installation.png"] = scene3d.installation(made.arrangement)
        run_folder.save_run(place, made.shown, made.certificate, facts, images=images, painted=painted)
        if options.pictures:
            with whole(place / "turntable.gif") as part:
                scene3d.save_turntable(part, made.arrangement, painted)
            heap = made.arrangement.problem.bodies, made.arrangement.matrices
            with whole(place / "heap.html") as part:
                part.write_text(gltf.page(*heap, painted))
        for line in made.certificate.lines()[:20]:
            print(f"rasp: {line}", file=sys.stderr)
        print(
            f"{place}: {len(made.arrangement.problem.bodies)} objects, {len(cameras)} views, likeness "
            f"{made.of_ceiling.min():.1%} of the ceiling at least, ceiling {made.ceiling.min():.1%}; "
            f"{'certified' if made.certificate.holds else 'NOT certified'}"
        )
        holds = holds and made.certificate.holds
    return 0 if holds else 1


def sweep(options: argparse.Namespace) -> int:
    """Pack with many seeds and weights at once."""
    import csv

    from ..packing import methods
    from .sweep import grid
    from .sweep import sweep as sweep_all

    _check_time(options)
    if options.seeds < 1:
        raise InputError(f"--seeds must be positive, got {options.seeds}")
    varied = grid(lambda_=options.lambda_, epsilon=options.epsilon, seed=range(options.seeds))
    fixed = {
        "objects": [str(Path(path).resolve()) for path in options.objects],
        "container": options.container
        if options.container.startswith(("box:", "auto"))
        else str(Path(options.container).resolve()),
        "count": _count(options.count),
        **{name: getattr(options, name) for name in SWEPT},
    }
    found = sweep_all(
        methods.pack, [fixed | run for run in varied], options.out, options.workers, options.scheduler, progress=True
    )
    with whole(options.out / "sweep.csv") as part, part.open("w", newline="") as file:
        writer = csv.DictWriter(file, [*varied[0], *found[0]])
        writer.writeheader()
        writer.writerows(run | result for run, result in zip(varied, found, strict=True))
    best = max(range(len(found)), key=lambda i: (found[i]["certified"], found[i]["density"]))
    run, result = varied[best], found[best]
    print(
        f"{options.out}: {len(found)} runs, {sum(r['certified'] for r in found)} certified; best density "
        f"{result['density']:.4f} with {result['objects']} objects: --seed {run['seed']} --lambda {run['lambda_']:g} "
        f"--epsilon {run['epsilon']:g}"
    )
    return 0 if result["certified"] else 1


def check(options: argparse.Namespace) -> int:
    """Certificate and density of a run."""
    import numpy as np

    from .. import density
    from ..exact.certificate import certify
    from ..physics import disassembly
    from ..visualize import gltf

    bodies, container = gltf.read_scene(options.scene)
    stay = np.tile(np.eye(4), (len(bodies), 1, 1))
    certificate = certify(bodies, stay, container)
    print(f"rasp: {_removal(disassembly.remove_all(bodies, stay))}", file=sys.stderr)
    _say(len(bodies), density.mesh_density(bodies, container), certificate, options.scene)
    return 0 if certificate.holds else 1


def figures(options: argparse.Namespace) -> int:
    """Run the figure notebooks and compare their facts."""
    from ..reproduce import figures as notebooks

    return notebooks.run(options.names, options.scale, options.store)


def _say(count: int, density: float, certificate, where: Path) -> None:
    for line in certificate.lines()[:20]:
        print(f"rasp: {line}", file=sys.stderr)
    verdict = "certified" if certificate.holds else "NOT certified"
    print(
        f"{where}: {count} objects, density {density:.4f}, {verdict} (worst overlap {certificate.worst_overlap:.1e}, "
        f"worst protrusion {certificate.worst_protrusion:.1e})"
    )


def _removal(removed) -> str:
    if not removed.stuck:
        return "all objects can be taken out one by one by straight pulls"
    return f"{len(removed.stuck)} objects interlock, no straight pull takes them out: {', '.join(removed.stuck)}"


def _check_time(options: argparse.Namespace) -> None:
    if options.time_limit is not None and not options.time_limit > 0:
        raise InputError(f"--time-limit must be positive, got {options.time_limit}")


def _count(text: str) -> int | None:
    if text == "auto":
        return None
    try:
        count = int(text)
    except ValueError:
        count = 0
    if count < 1:
        raise InputError(f"--count must be auto or a positive number, got {text}")
    return count
