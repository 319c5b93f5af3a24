"""Damaged mesh files and odd arguments for the command line: `python tests/fuzz.py --count 10000`.

Each input goes through `rasp_core.cli.main.main`. What counts as a failure: an exception that reaches the user, an exit
status other than 0, 1, 2, more than `SECONDS`, or more than `MEMORY` on top of what the process had.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import os
import random
import re
import resource
import signal
import sys
import tempfile
import traceback
from pathlib import Path
from unittest import mock

import trimesh

from rasp_core.cli import main as entrance
from rasp_core.cli.main import main
from rasp_core.geometry.loading import MESH_SUFFIXES

SECONDS = 10
MEMORY = 2 * 2**30
NUMBERS = ("0", "-1", "1", "2", "3.5", "nan", "inf", "-inf", "1e400", "1e-400", "9" * 20, "4294967295", "")
WORDS = (
    *NUMBERS,
    *("mm", "inch", "none", "close", "wrap"),
    *("auto", "auto:cube", "auto:1,*,*", "box:", "box:1,1", "box:0,1,1", "box:1,1,nan", "box:inf,1,1", "x", "a\0b"),
    *("..", "/", "/dev/null", "/dev/zero", "/proc/self/mem", "é\u202e", "'; rm -rf", "--", "-", "*"),
)
PACK = (
    *("--count", "--repeat", "--fit-objects", "--method", "--effort", "--resolution", "--device", "--lambda"),
    *("--epsilon", "--seed", "--azimuths-deg", "--elevations-deg", "--container", "--iterations", "--out"),
    *("--unit", "--repair", "--together", "--split", "--cavity"),
)
ART = (
    "--unit",
    "--repair",
    "--split",
    "--targets",
    "--text",
    "--azimuths-deg",
    "--elevations-deg",
    "--width",
    "--count",
    "--resolution",
    "--seed",
)
ASSEMBLE = ("--unit", "--repair", "--whole", "--silhouettes", "--azimuths-deg", "--elevations-deg", "--width", "--seed")


def seeds() -> dict[str, bytes]:
    """A small valid file of each format."""
    mesh = trimesh.creation.box((0.05, 0.04, 0.03))
    found = {suffix: mesh.export(file_type=suffix[1:]) for suffix in MESH_SUFFIXES}
    found[".ascii.ply"] = mesh.export(file_type="ply", encoding="ascii")
    found[".ascii.stl"] = mesh.export(file_type="stl_ascii")
    return {suffix: data.encode() if isinstance(data, str) else data for suffix, data in found.items()}


def damage(data: bytes, chance: random.Random) -> bytes:
    """One to four damages: bytes changed, cut or repeated, numbers replaced."""
    data = bytearray(data)
    for _ in range(chance.randint(1, 4)):
        at, length = chance.randrange(len(data) + 1), chance.choice((1, 4, 4, 50, 500))
        kind = chance.randrange(6)
        if kind == 0:
            data[at : at + length] = chance.randbytes(min(length, 50))
        elif kind == 1:
            data[at : at + 4] = chance.choice((b"\xff" * 4, b"\0" * 4, b"\0\0\xc0\x7f", b"\xff\xff\xff\x7f"))
        elif kind == 2:
            del data[at : at + length]
        elif kind == 3:
            data[at:at] = data[at : at + length] * chance.choice((1, 2, 100))
        elif kind == 4:
            del data[at:]
        else:
            found = list(re.finditer(rb"-?\d+(\.\d+)?", bytes(data)))
            if found:
                where = chance.choice(found)
                data[where.start() : where.end()] = chance.choice(NUMBERS).encode()
    return bytes(data)


def mesh_call(folder: Path, files: dict[str, bytes], chance: random.Random) -> list[str]:
    """A command that reads a damaged mesh: as an object, a container, a whole or a scene."""
    suffix = chance.choice(sorted(files))
    path = folder / f"damaged{Path(suffix).suffix or suffix}"
    path.write_bytes(damage(files[suffix], chance))
    nothing = ["--method", "none-such"]  # refused after the files are read
    return chance.choice(
        [
            ["pack", str(path), "--container", "box:9,9,9", *nothing],
            ["pack", str(folder / "good.stl"), "--container", str(path), *nothing],
            ["assemble", str(path), "--whole", str(path), "--out", str(folder / "out")],
            ["check", str(path)],
        ]
    )


def word_call(folder: Path, chance: random.Random) -> list[str]:
    """A command with odd words in some places."""
    good, out = str(folder / "good.stl"), str(folder / "out")
    short = ["--iterations", "3", "--resolution", "16", "--time-limit", "0.3", "--out", out]
    command, options = chance.choice(
        [
            (["pack", good, "--container", "box:0.1,0.1,0.1", *short], PACK),
            (["art", good, "--text", "I", "L", "--resolution", "32", "--time-limit", "0.3", "--out", out], ART),
            (["assemble", good, good, "--whole", good, "--out", out], ASSEMBLE),
            (["check", out], ("--no-such",)),
            (["figures", "--scale", "none"], ("--store",)),
        ]
    )
    for _ in range(chance.choice((1, 1, 2, 3))):
        if chance.random() < 0.2:
            command[chance.randrange(len(command))] = chance.choice(WORDS)
        else:
            command += [chance.choice(options), *chance.choices(WORDS, k=chance.choice((0, 1, 1, 1, 1, 2)))]
    if chance.random() < 0.1:
        del command[chance.randrange(len(command))]
    return command


def failure(call: list[str]) -> str | None:
    """What is wrong with how the command line takes a call; None where nothing is."""

    def late(*_):
        raise TimeoutError(f"more than {SECONDS} s")

    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(SECONDS)
    said = io.StringIO()
    notes = mock.patch.object(entrance, "_show")  # what is said of a file comes beside the one line of a refusal
    try:
        with notes, contextlib.redirect_stderr(said), contextlib.redirect_stdout(io.StringIO()):
            try:
                status = main(call)
            except SystemExit as exit_:
                status = exit_.code or 0
    except BaseException:
        return traceback.format_exc(limit=-3)
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)
    lines = [line for line in said.getvalue().splitlines() if line.startswith("rasp: ")]
    if status == 2 and len(lines) != 1:
        return f"status 2 with {len(lines)} lines: {said.getvalue()[-300:]!r}"
    return None if status in (0, 1, 2) else f"status {status}"


def run(count: int, seed: int, words: float = 0.2) -> list[tuple[list[str], str]]:
    """`count` inputs, a share of them odd `words`; the calls that fail, and how."""
    chance, failed, files = random.Random(seed), [], seeds()
    before = Path.cwd()
    with tempfile.TemporaryDirectory() as name:
        os.chdir(name)  # odd words may name files to be written
        folder = Path(name)
        (folder / "good.stl").write_bytes(files[".stl"])
        try:
            for _ in range(count):
                call = word_call(folder, chance) if chance.random() < words else mesh_call(folder, files, chance)
                wrong = failure(call)
                if wrong is not None:
                    failed.append((call, wrong))
        finally:
            os.chdir(before)
    return failed


def limit_memory() -> None:
    """Let this process have `MEMORY` more than it has."""
    has = int(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    resource.setrlimit(resource.RLIMIT_AS, (has + MEMORY, has + MEMORY))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--words", type=float, default=0.2, help="share of odd arguments among the inputs")
    options = parser.parse_args()
    run(20, 1, 1.0)  # imports all, before memory is limited
    limit_memory()
    failures = run(options.count, options.seed, options.words)
    for call, wrong in failures[:20]:
        print(f"{call}\n    {wrong}\n")
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    print(f"{options.count} inputs, {len(failures)} failures, {peak:.2f} GiB at most")
    sys.exit(1 if failures else 0)
