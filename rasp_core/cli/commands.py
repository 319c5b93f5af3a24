"""What the commands of the command line do: input from options, a run's folder, one line of result, the exit status.

Everything heavy is imported where it is used, so that a wrong argument is answered at once.
"""

from __future__ import annotations

import argparse
import itertools
import sys
from pathlib import Path

from ..io.atomic_files import whole
from ..util.errors import InputError
from ..util.loading import loading
from .checks import (
    CLEARANCES,
    check_clearances,
    check_container,
    check_time,
    check_together,
    count_of,
    fit_of,
    made_of,
    table_of,
)
from .options import SETTINGS, WEIGHTS, container_of, counted, given_of, method_of, reading_of

MADE = {"build": "built.stl", "hang": "hung.3mf"}  # of a heap, and the file it is in
INTERRUPTED = "rasp: interrupted; this is the best until then"
SWEPT = (
    *("time_limit", "effort", "repeat", "fit_objects", "azimuths_deg", "elevations_deg", "viewing_volume"),
    *("iterations", "resolution", *CLEARANCES),
)


def pack(options: argparse.Namespace) -> int:
    """Pack objects into a container."""
    with loading():
        from ..api.inputs import as_fixed
        from ..api.pack import pack as pack_parts
        from ..api.run_folder import check_writable
        from ..geometry.box_table import read_boxes
        from ..geometry.containers import FreeBox
        from ..geometry.loading import load_bodies
        from ..io.exports import formats
        from ..packing import from_files

    count, table = count_of(options.count), table_of(options)
    boxes = None if table or options.boxes is None else count_of(options.boxes, "--boxes")
    check_container(options, table)
    check_time(options)
    check_clearances(options)
    formats(options.export)
    check_together(options)
    folder, reading = check_writable(options.out), reading_of(options)
    method = method_of(options, given_of(options, "time_limit", "effort", "record", *SETTINGS) | counted(count))
    kinds = []
    if table:
        kinds = read_boxes(table, reading, from_files.directions_of(options.azimuths_deg, options.elevations_deg))
    bodies, container, scale = from_files.load(
        objects=options.objects,
        container=kinds[0][0] if table else container_of(options),
        repeat=options.repeat,
        fit_objects=options.fit_objects,
        seed=options.seed,
        azimuths_deg=options.azimuths_deg,
        elevations_deg=options.elevations_deg,
        reading=reading,
        progress=True,
        parts=options.parts,
    )
    asked = {
        "seed": options.seed,
        "count": count,
        "time_limit": options.time_limit,
        "effort": options.effort,
        "device": options.device,
        "progress": True,
        "unit": options.unit,
        "fixed": as_fixed(options.fixed or (), reading),
        "separable": options.separable,
        "gravity": options.gravity,
        "keep_out": load_bodies(options.keep_out, reading) if options.keep_out else (),
        **given_of(options, *SETTINGS, *CLEARANCES),
    }
    if options.boxes:
        return _pack_boxes(bodies, kinds or container, method, {"boxes": boxes, **asked}, folder, scale, options)
    packed = pack_parts(bodies, container, method, record=bool(options.record), **asked)
    apart = packed.dismantling
    print(f"rasp: {(apart or packed.removal).summary()}", file=sys.stderr)
    if any(packed.gradient_shares.values()):
        shares = ", ".join(f"{name} {share:.0%}" for name, share in packed.gradient_shares.items())
        print(f"rasp: shares of the gradient, in the mean over the run: {shares}", file=sys.stderr)
    if packed.resting is not None:
        print(f"rasp: {packed.resting.summary(options.unit)}", file=sys.stderr)
    settled = packed.settle() if options.settle else None
    for line in settled.lines(options.unit) if settled else ():
        print(f"rasp: {line}", file=sys.stderr)
    packed.save(folder, {"object_scale": scale}, settled, options.export)
    within = _box(packed.container, options) if isinstance(container, FreeBox) else ""
    around = f" around {len(packed.fixed)}" if packed.fixed else ""
    if packed.interrupted:
        print(INTERRUPTED, file=sys.stderr)
    what = f"{len(packed.chosen)} of {packed.pool} objects{around}{within}"
    _say(what, packed.density, packed.certificate, folder, options.unit)
    if packed.missing:
        print(f"rasp: must go in, but found no place: {', '.join(packed.missing)}", file=sys.stderr)
    asked = [one.holds for one in (apart, packed.resting) if one is not None]
    return 0 if packed.certificate.holds and not packed.missing and all(asked) else 1


def _pack_boxes(bodies, container, method: str, asked: dict, folder: Path, scale: float, options) -> int:
    """Pack objects into several boxes."""
    from ..api.boxes import pack_boxes

    found = pack_boxes(bodies, container, method, **asked)
    found.save(folder, {"object_scale": scale}, options.export)
    for line in found.lines(options.unit):
        print(f"rasp: {line}", file=sys.stderr)
    if found.interrupted:
        print(INTERRUPTED, file=sys.stderr)
    print(f"{folder}: {found.headline()}; by volume alone {found.least}")
    return 0 if found.certified and found.separable and found.resting and not found.missing else 1


def assemble(options: argparse.Namespace) -> int:
    """Put the parts of a broken thing back together."""
    with loading():
        from ..api.assemble import assemble as assemble_parts
        from ..api.run_folder import check_writable
        from ..geometry.loading import load_bodies, load_body

    folder = check_writable(options.out)
    reading = reading_of(options)
    assembled = assemble_parts(
        load_bodies(options.parts, reading),
        None if options.whole is None else load_body(options.whole, reading),
        silhouettes=options.silhouettes,
        **given_of(options, "width", "azimuths_deg", "elevations_deg"),
        seed=options.seed,
        progress=True,
    )
    assembled.save(folder)
    for line in assembled.warnings:
        print(f"rasp: {line}", file=sys.stderr)
    for hole in assembled.holes or ():
        place = ", ".join(f"{x:.4g}" for x in hole.centre)
        print(f"rasp: something may be missing at ({place}) m: {1e4 * hole.area:.3g} cm2 of fracture", file=sys.stderr)
    print(f"{folder}: {len(assembled.bodies)} parts, {assembled.fit()}")
    return 1 if assembled.warnings else 0


def art(options: argparse.Namespace) -> int:
    """Heap objects up so that each side shows another picture."""
    with loading():
        from ..api.run_folder import check_writable
        from ..api.sculpt import sculpt
        from ..art.building import check_printer
        from ..art.hanging import check_thread
        from ..geometry.loading import load_bodies

    check_time(options)
    folder, (making, asked), fitting, fallen = check_writable(options.out), made_of(options), fit_of(options), []
    (check_thread if making == "hang" else check_printer)(**asked)
    several = options.text is not None and max(map(len, options.text)) > 1
    places = (folder / f"{number}" for number in itertools.count(1)) if several else iter([folder])

    def keep(heap) -> None:
        place, made = next(places), None if making is None else getattr(heap, making)(**asked)
        (made or heap).save(place, pictures=options.pictures)
        lines = [
            *(heap.fitted.lines() if heap.fitted else ()),
            *(made or heap).warnings,
            *heap.certificate.lines()[:20],
        ]
        if heap.painted is not None:
            lines.append(f"painted, {heap.paint_fit()}")
        for line in lines:
            print(f"rasp: {line}", file=sys.stderr)
        print(f"{place}: {heap.headline().removeprefix('Sculpture of ')}")
        if heap.in_room is not None:
            print(f"{place / 'room.html'}: {heap.in_room.line()}")
        if made is not None:
            print(f"{place / MADE[making]}: {made.headline()}")
            fallen.append(not made.holds)

    made = sculpt(
        load_bodies(options.objects, reading_of(options), progress=True),
        options.targets,
        text=options.text,
        azimuths_deg=options.azimuths_deg,
        elevations_deg=options.elevations_deg,
        projection=options.projection,
        room=options.room,
        fit_targets=fitting,
        **given_of(options, "width"),
        count=options.count,
        resolution=options.resolution,
        time_limit=options.time_limit,
        paint=options.paint,
        seed=options.seed,
        device=options.device,
        progress=True,
        each=keep,
    )
    return 0 if all(heap.certificate.holds for heap in (made if several else [made])) and not any(fallen) else 1


def sweep(options: argparse.Namespace) -> int:
    """Pack with many seeds and weights at once."""
    import csv
    from dataclasses import asdict

    with loading():
        from ..geometry.loading import METRES
        from ..packing import from_files
        from ..problem import Settings
        from .sweep import grid
        from .sweep import sweep as sweep_all

    check_container(options)
    check_time(options)
    check_clearances(options)
    if options.seeds < 1:
        raise InputError(f"--seeds must be positive, got {options.seeds}")
    count, given, weights = count_of(options.count), given_of(options, *SWEPT), given_of(options, *WEIGHTS)
    method = method_of(options, {**given, **weights} | counted(count))
    if method == "paper":
        weights = {"lambda_": [Settings.lambda_], "epsilon": [Settings.epsilon]} | weights
    varied = grid(**weights, seed=range(options.seeds))
    fixed = {
        "objects": [str(Path(path).resolve()) for path in options.objects],
        **({} if options.parts is None else {"parts": str(Path(options.parts).resolve())}),
        "container": container_of(options, whole_path=True),
        "method": method,
        "device": options.device,
        **given,
        **counted(count),
    }
    if (reading := reading_of(options)) != METRES:
        fixed["reading"] = asdict(reading)
    runs = [fixed | run for run in varied]
    found = sweep_all(from_files.pack, runs, options.out, options.workers, options.scheduler, progress=True)
    with whole(options.out / "sweep.csv") as part, part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [*varied[0], *found[0]])
        writer.writeheader()
        writer.writerows(run | result for run, result in zip(varied, found, strict=True))
    best = max(range(len(found)), key=lambda i: (found[i]["certified"], found[i]["density"]))
    run, result = varied[best], found[best]
    words = {name: value if isinstance(value, str) else f"{value:g}" for name, value in run.items()}
    chosen = " ".join(f"--{name.strip('_')} {word}" for name, word in words.items())
    print(
        f"{options.out}: {len(found)} runs, {sum(r['certified'] for r in found)} certified; best density "
        f"{result['density']:.4f} with {result['objects']} objects: {chosen}"
    )
    return 0 if result["certified"] else 1


def check(options: argparse.Namespace) -> int:
    """Certificate and density of a run."""
    with loading():
        import numpy as np

        from .. import density
        from ..api.run_folder import BOXES, boxes_of, recorded
        from ..exact.certificate import certify
        from ..packing.clearance import asked_of, clearance_of
        from ..packing.separable import proven_again
        from ..physics.disassembly import remove_all
        from ..visualize import gltf

    check_clearances(options)
    if (options.scene / BOXES).exists():
        return max(check(argparse.Namespace(**vars(options) | {"scene": box})) for box in boxes_of(options.scene))
    bodies, container = gltf.read_scene(options.scene)
    stay = np.tile(np.eye(4), (len(bodies), 1, 1))
    given = given_of(options, *CLEARANCES)
    asked, record = {}, recorded(options.scene)
    if "clearance" not in given:
        bodies, asked = asked_of(bodies, record)
    asked = clearance_of(bodies, **asked | given)
    certificate = certify(bodies, stay, container, clearance=None if asked is None else (asked.parts, asked.wall))
    apart = proven_again(bodies, stay, container, record, options.separable)
    print(f"rasp: {(apart or remove_all(bodies, stay)).summary()}", file=sys.stderr)
    what, filled = f"{len(bodies)} object{'s' * (len(bodies) != 1)}", density.mesh_density(bodies, container)
    _say(what, filled, certificate, options.scene, options.unit)
    return 0 if certificate.holds and (apart is None or apart.holds) else 1


def figures(options: argparse.Namespace) -> int:
    """Run the figure notebooks and compare their facts."""
    from ..reproduce import figures as notebooks

    return notebooks.run(options.names, options.scale, options.store)


def _box(container, options: argparse.Namespace) -> str:
    """The edges of the box that was found, in the user's unit."""
    edges = " x ".join(f"{edge / reading_of(options).metres:.4g}" for edge in container.base.size)
    return f" in a box of {edges} {options.unit}"


def _say(what: str, density: float, certificate, where: Path, unit: str) -> None:
    for line in certificate.lines(unit)[:20]:
        print(f"rasp: {line}", file=sys.stderr)
    if certificate.gaps is not None:
        print(f"rasp: {certificate.gaps.summary(unit)}", file=sys.stderr)
    verdict = "certified" if certificate.holds else "NOT certified"
    print(
        f"{where}: {what}, density {density:.4f}, {verdict} (worst overlap {certificate.worst_overlap:.1e}, "
        f"worst protrusion {certificate.worst_protrusion:.1e})"
    )
