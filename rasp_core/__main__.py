"""The command line: `rasp pack`, `check`, `assemble`, `sweep`, `figures`; also `python -m rasp_core`.

Exit status: 0 certified (assemble: nothing doubtful), 1 not, 2 for input that cannot be used (one line on standard
error says what and how to mend it). Progress goes to standard error, one line of result to standard output.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from typing import NoReturn

from . import __version__
from .errors import InputError

SWEPT = (
    *("method", "time_limit", "effort", "repeat", "fit_objects", "iterations", "resolution", "device"),
    *("azimuths_deg", "elevations_deg"),
)


class _Parser(argparse.ArgumentParser):
    """Says what is wrong in one line, without the usage."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"rasp: {message}; see {self.prog} --help\n")


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; returns the exit status."""
    options = _parser().parse_args(arguments)
    try:
        return options.run(options)
    except InputError as error:
        print(f"rasp: {' '.join(str(error).split())}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("rasp: interrupted; nothing was written", file=sys.stderr)
        return 130


def _parser() -> _Parser:
    parser = _Parser(prog="rasp", description="Arrange rigid 3D objects by their shadows, without overlap.")
    parser.add_argument("--version", action="version", version=f"rasp {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND", parser_class=_Parser)

    pack = commands.add_parser("pack", help="pack objects into a container")
    _add_problem(pack)
    pack.add_argument("--lambda", dest="lambda_", type=float, default=0.001, help="weight of Eq. 5 (default: 0.001)")
    pack.add_argument("--epsilon", type=float, default=0.01, help="depth of Eq. 5 in metres (default: 0.01)")
    pack.add_argument("--seed", type=int, default=0)
    pack.add_argument("--settle", action="store_true", help="let the packing fall under gravity, and judge it anew")
    pack.add_argument("--out", type=Path, default=Path("out"), help="the run's folder (default: out)")
    pack.set_defaults(run=_pack)

    sweep = commands.add_parser("sweep", help="pack with many seeds and weights at once, on Dask")
    _add_problem(sweep)
    sweep.add_argument("--seeds", type=int, default=8, metavar="N", help="the seeds 0 to N - 1 (default: 8)")
    sweep.add_argument("--lambda", dest="lambda_", type=float, nargs="+", default=[0.001], help="one or more")
    sweep.add_argument("--epsilon", type=float, nargs="+", default=[0.01], help="one or more, in metres")
    sweep.add_argument("--workers", type=int, help="local processes (default: one for each core)")
    sweep.add_argument("--scheduler", metavar="ADDRESS", help="a running Dask cluster instead, tcp://HOST:8786")
    sweep.add_argument("--out", type=Path, default=Path("out"), help="finished runs are kept here (default: out)")
    sweep.set_defaults(run=_sweep)

    check = commands.add_parser("check", help="certificate and density of a run; exit status 1 where it fails")
    check.add_argument("scene", metavar="DIR|scene.glb", type=Path)
    check.set_defaults(run=_check)

    assemble = commands.add_parser("assemble", help="put the parts of a broken thing back together")
    assemble.add_argument(
        "parts", nargs="+", metavar="PARTS", help="mesh files or folders of them; poses do not matter"
    )
    whole = assemble.add_mutually_exclusive_group(required=True)
    whole.add_argument("--whole", metavar="FILE", help="the whole's mesh, closed, in the same unit")
    whole.add_argument("--silhouettes", nargs="+", metavar="PNG", help="pictures of the whole, one for each view")
    assemble.add_argument("--azimuths-deg", type=float, nargs="+", default=[0, 90, 0], help="(default: 0 90 0)")
    assemble.add_argument("--elevations-deg", type=float, nargs="+", default=[0, 0, 90], help="(default: 0 0 90)")
    assemble.add_argument("--width", type=float, help="of the silhouettes' edges, in the parts' unit")
    assemble.add_argument("--seed", type=int, default=0)
    assemble.add_argument("--out", type=Path, default=Path("out"), help="the run's folder (default: out)")
    assemble.set_defaults(run=_assemble)

    figures = commands.add_parser("figures", help="run the figure notebooks and compare their facts")
    figures.add_argument("names", nargs="*", metavar="NAME", help="such as 03_packing_density (default: all)")
    figures.add_argument(
        "--scale", default="quick", choices=["quick", "paper"], help="embedded data, or the real pools"
    )
    figures.add_argument(
        "--store", action="store_true", help="keep the executed notebooks, with outputs, in notebooks/"
    )
    figures.set_defaults(run=_figures)
    return parser


def _add_problem(parser: argparse.ArgumentParser) -> None:
    """The arguments that one packing and many have in common."""
    parser.add_argument("objects", nargs="+", metavar="OBJECTS", help="mesh files or folders of them, in metres")
    parser.add_argument(
        "--container", required=True, help="box:X,Y,Z in metres; a closed mesh; auto, auto:cube or auto:X,Y,*"
    )
    parser.add_argument("--azimuths-deg", type=float, nargs="+", help="of the views (default: 3 of a box, 5 of a mesh)")
    parser.add_argument("--elevations-deg", type=float, nargs="+", help="as many as --azimuths-deg")
    parser.add_argument("--count", default="auto", help="auto (search), or exactly how many to arrange")
    parser.add_argument("--repeat", type=int, metavar="D", help="draw a pool of D objects with replacement")
    parser.add_argument(
        "--fit-objects", type=int, metavar="N", help="scale all objects so that N make half the container"
    )
    parser.add_argument(
        "--method",
        help="rasp: the paper's (default); dense: the kit's own (for auto); baselines: spectral, dblf, heightmap",
    )
    parser.add_argument("--time-limit", type=float, metavar="S", help="seconds for the search")
    parser.add_argument("--effort", type=int, metavar="E", help="tries of --method dense, instead of seconds")
    parser.add_argument("--iterations", type=int, default=1000, help="length of the optimisation (default: 1000)")
    parser.add_argument("--resolution", type=int, default=256, help="pixels along a silhouette (default: 256)")
    parser.add_argument("--device", default="auto", help="auto, cpu, cuda, cuda:1, mps (default: auto)")


def _pack(options: argparse.Namespace) -> int:
    from . import density, jobs, physics, removal, results
    from .problem import Settings
    from .scene import resolve_device

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
    folder = results.check_writable(options.out)
    device = resolve_device(options.device)
    bodies, container, scale = jobs.load(
        *(options.objects, options.container, options.repeat, options.fit_objects, options.seed),
        *(options.azimuths_deg, options.elevations_deg),
    )
    budget = options.time_limit, options.effort
    method = jobs.resolve_method(options.method, container)
    packed = jobs.search(method, bodies, container, count, settings, device, *budget, progress=True)
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
    removed = removal.remove_all(placed, arrangement.matrices)
    facts["removal"], scenes = removed.to_dict(), {}
    print(f"rasp: {_removal(removed)}", file=sys.stderr)
    if options.settle:
        settled = physics.settle(placed, arrangement.matrices, container)
        facts["settled"], scenes["settled.glb"] = settled.to_dict(), settled.matrices
        for line in settled.lines():
            print(f"rasp: {line}", file=sys.stderr)
    results.save_run(folder, arrangement, certificate, facts, packed.history, scenes)
    _say(len(placed), packed.density, certificate, folder)
    return 0 if certificate.holds else 1


def _assemble(options: argparse.Namespace) -> int:
    from . import assembly, containers, meshes, packing, pictures, results
    from .cameras import Camera
    from .problem import Settings

    began = time.monotonic()
    folder = results.check_writable(options.out)
    if options.whole is not None:
        whole, parts = containers.from_mesh(options.whole), meshes.load_bodies(options.parts)
        found = assembly.assemble(parts, whole, options.seed, progress=True)
    else:
        angles = options.azimuths_deg, options.elevations_deg
        if options.width is None or not len(options.silhouettes) == len(angles[0]) == len(angles[1]):
            raise InputError(
                f"silhouettes need --width and as many --azimuths-deg and --elevations-deg, got {len(angles[0])} and "
                f"{len(angles[1])} for {len(options.silhouettes)} pictures"
            )
        cameras = [Camera(*pair, options.width) for pair in zip(*angles, strict=True)]
        images, parts = pictures.read_silhouettes(options.silhouettes), meshes.load_bodies(options.parts)
        found = assembly.assemble_by_silhouettes(parts, images, cameras, options.seed, progress=True)
    settings = Settings(seed=options.seed)
    drawn = packing.finish(parts, list(range(len(parts))), found.start, found.whole, settings)
    facts = {
        "command": "assemble",
        "scores": {body.name: float(score) for body, score in zip(parts, found.scores, strict=True)},
        "likeness": None if found.likeness is None else found.likeness.tolist(),
        "warnings": list(found.warnings),
        "seconds": time.monotonic() - began,
    }
    results.save_run(folder, drawn.arrangement, drawn.certificate, facts)
    for line in found.warnings:
        print(f"rasp: {line}", file=sys.stderr)
    shared = drawn.certificate.overlap_volume / sum(body.volume for body in parts)
    name, fit = ("fit of their surfaces", found.scores) if found.likeness is None else ("likeness", found.likeness)
    print(
        f"{folder}: {len(parts)} parts, {name}: {fit.mean():.1%} in the mean, {fit.min():.1%} at least; "
        f"{shared:.2%} of the volume shared"
    )
    return 1 if found.warnings else 0


def _sweep(options: argparse.Namespace) -> int:
    import csv

    from . import jobs, sweep

    _check_time(options)
    if options.seeds < 1:
        raise InputError(f"--seeds must be positive, got {options.seeds}")
    varied = sweep.grid(lambda_=options.lambda_, epsilon=options.epsilon, seed=range(options.seeds))
    fixed = {
        "objects": [str(Path(path).resolve()) for path in options.objects],
        "container": options.container
        if options.container.startswith(("box:", "auto"))
        else str(Path(options.container).resolve()),
        "count": _count(options.count),
        **{name: getattr(options, name) for name in SWEPT},
    }
    found = sweep.sweep(
        jobs.pack, [fixed | run for run in varied], options.out, options.workers, options.scheduler, progress=True
    )
    with (options.out / "sweep.csv").open("w", newline="") as file:
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


def _check(options: argparse.Namespace) -> int:
    import numpy as np

    from . import density, removal, results
    from .certify import certify

    bodies, container = results.read_scene(options.scene)
    stay = np.tile(np.eye(4), (len(bodies), 1, 1))
    certificate = certify(bodies, stay, container)
    print(f"rasp: {_removal(removal.remove_all(bodies, stay))}", file=sys.stderr)
    _say(len(bodies), density.mesh_density(bodies, container), certificate, options.scene)
    return 0 if certificate.holds else 1


def _figures(options: argparse.Namespace) -> int:
    from . import figures

    return figures.run(options.names, options.scale, options.store)


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


if __name__ == "__main__":
    sys.exit(main())
