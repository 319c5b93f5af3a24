"""Part accuracy and seconds over many seeded fractures: vessels, animals, CAD parts; flat, wavy and rough cuts.

python tests/benchmarks/fracture_table.py [--count 100] [--modes alone whole silhouettes] [--workers 2] [--data]

A third of the fractures is worn by 0.5 % of the diagonal; one in five lacks a piece, one in five holds a foreign one.
Without --data the animals and CAD parts are those that the kit makes; with it, those of the registry. Judged are the
pieces that are there, by Chamfer distance. Runs are kept in --out, so that a table that was interrupted goes on.
"""

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np

import data_fetch
import rasp_core as rasp
from rasp_core.cli.sweep import sweep
from rasp_core.reproduce.pools import as_files

WORN = 0.005  # of the diagonal, half on each side of a cut
MODES = ("alone", "whole", "silhouettes")


def judge(kind, thing, parts, cut, worn, missing, foreign, seed, mode):
    """One fracture broken, scattered and put together: what came right, plainly."""
    from data_fetch import fracture, scatter
    from rasp_core.assembly.assemble import assemble, assemble_by_silhouettes
    from rasp_core.assembly.metrics import measure
    from rasp_core.assembly.pieces_alone import assemble_alone
    from rasp_core.geometry.cameras import box_views
    from rasp_core.geometry.containers import Container
    from rasp_core.geometry.silhouette_edges import Views
    from rasp_core.silhouettes import render_at_rest
    from rasp_core.util.errors import InputError

    body = rasp.load(thing)[0]
    diagonal = 2 * float(np.linalg.norm(body.half_extents))
    pieces = fracture(body, parts, seed, cut=cut, lost=worn * diagonal / 2)
    if missing:
        del pieces[1 + seed % (len(pieces) - 1)]  # never the largest
    pieces, truth = scatter(pieces, seed)
    given = list(pieces)
    if foreign is not None:
        other = rasp.load(foreign)[0]
        other = other.scaled(diagonal / 2 / float(np.linalg.norm(other.half_extents)))
        shard = fracture(other, max(parts, 2), seed + 1000, cut=cut)[-1]
        given.append(scatter([shard], seed + 1)[0][0])
    began, computed = time.monotonic(), time.process_time()
    try:
        if mode == "alone":
            found = assemble_alone(given, seed)
        elif mode == "whole":
            found = assemble(given, Container(body), seed)
        else:
            cameras = box_views(1.1 * diagonal, body.centre)
            found = assemble_by_silhouettes(given, render_at_rest(body, Views(cameras), 256).numpy(), cameras, seed)
    except InputError as error:
        return {"right": 0.0, "seconds": time.monotonic() - began, "cpu": 0.0, "named": None, "error": str(error)}
    seconds, computed = time.monotonic() - began, time.process_time() - computed
    accuracy = measure(pieces, found.matrices[: len(pieces)], truth).parts
    named = None if foreign is None else any(given[-1].name in line for line in found.warnings)
    wrongly = sum(any(piece.name in line for line in found.warnings) for piece in pieces)
    return {"right": accuracy, "seconds": seconds, "cpu": computed, "named": named, "doubted": wrongly}


def fractures(count, things):
    """The parameters of each fracture, by number: the same for every count and mode."""
    rows = []
    for k in range(count):
        random = np.random.default_rng([26, k])
        kind = ("vessel", "animal", "cad")[k % 3]
        pick = [things[kind][i] for i in random.permutation(len(things[kind]))]
        parts = int(2 + k % 4 if k % 2 else random.integers(2, 13))
        rows.append(
            {
                "kind": kind,
                "thing": pick[0],
                "parts": parts,
                "cut": ("flat", "wavy", "rough")[(k // 3) % 3],
                "worn": WORN if random.random() < 1 / 3 else 0.0,
                "missing": bool(parts > 3 and random.random() < 0.2),
                "foreign": pick[1] if random.random() < 0.2 else None,
                "seed": k,
            }
        )
    return rows


def pools(data, folder):
    """Files of things to break, by kind."""
    if data:
        animals = rasp.load(data_fetch.fetch_containers())
        cad = rasp.load(data_fetch.fetch_cad())
    else:
        animals, cad = [data_fetch.duck(), data_fetch.head(), data_fetch.torus()], data_fetch.cad_like(12)
    pool = {"vessel": data_fetch.vessels(), "animal": animals, "cad": cad}
    return {
        kind: [str(path) for path in sorted(Path(as_files(bodies, folder / kind)[0]).iterdir())]
        for kind, bodies in pool.items()
    }


def say(name, rows):
    """One line of the table."""
    if rows:
        right, seconds = [row["right"] for row in rows], [row["seconds"] for row in rows]
        print(
            f"{name:24s} {len(rows):4d}  accuracy {np.mean(right):.3f}, all right {np.mean(np.equal(right, 1)):.2f}; "
            f"{np.median(seconds):.1f} s in the median, {max(seconds):.1f} at most; "
            f"{np.median([row['cpu'] for row in rows]):.1f} s of computing in the median"
        )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--modes", nargs="+", default=["alone"], choices=MODES)
    parser.add_argument("--data", action="store_true", help="animals and CAD parts of the registry")
    parser.add_argument("--workers", type=int)
    parser.add_argument("--out", type=Path, default=Path(tempfile.gettempdir()) / "rasp_fracture_table")
    options = parser.parse_args()
    broken = fractures(options.count, pools(options.data, options.out / ("data" if options.data else "made")))
    for mode in options.modes:
        runs = [{**row, "mode": mode} for row in broken]
        found = sweep(judge, runs, options.out / "runs", options.workers, progress=True)
        rows = [run | result for run, result in zip(runs, found, strict=True)]
        say(mode, rows)
        for low, high in ((2, 5), (6, 8), (9, 12)):
            say(f"  {low} to {high} pieces", [row for row in rows if low <= row["parts"] <= high])
        for name in ("kind", "cut"):
            for value in sorted({row[name] for row in rows}):
                say(f"  {value}", [row for row in rows if row[name] == value])
        say("  worn", [row for row in rows if row["worn"]])
        say("  one missing", [row for row in rows if row["missing"]])
        foreign = [row for row in rows if row["named"] is not None]
        say("  one foreign", foreign)
        print(f"  foreign pieces named: {sum(row['named'] for row in foreign)} of {len(foreign)}")
        for row in rows:
            if "error" in row:
                print(f"  {row['kind']} {row['seed']}: {row['error']}")


if __name__ == "__main__":
    main()
