"""The command line: `rasp pack`, `check`, `assemble`, `art`, `sweep`, `figures`; also `python -m rasp_core`.

Exit status: 0 certified (assemble: nothing doubtful), 1 not, 2 for input that cannot be used (one line on standard
error says what and how to mend it). Progress goes to standard error, one line of result to standard output.
"""

from __future__ import annotations

import argparse
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import NoReturn

from .. import __version__
from ..util.errors import InputError, MeshWarning
from . import commands


class _Parser(argparse.ArgumentParser):
    """Says what is wrong in one line, without the usage."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"rasp: {message}; see {self.prog} --help\n")


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; returns the exit status."""
    for stream in (sys.stdout, sys.stderr):  # a console may lack letters of a file's name
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")
    options = _parser().parse_args(arguments)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("always", MeshWarning)
            warnings.showwarning = _show
            return options.run(options)
    except InputError as error:
        print(f"rasp: {' '.join(str(error).split())}", file=sys.stderr)
        return 2
    except OSError as error:  # the disk is full, a file is gone: what could not be foreseen
        print(
            f"rasp: {error.filename or 'a file'}: {error.strerror or error}; see to it and try again", file=sys.stderr
        )
        return 2
    except MemoryError:
        print(
            "rasp: the memory does not suffice; give fewer or simpler objects, or a smaller resolution", file=sys.stderr
        )
        return 2
    except KeyboardInterrupt:
        print("rasp: interrupted; nothing was written", file=sys.stderr)
        return 130


def _show(message, category, filename, lineno, file=None, line=None) -> None:
    """What is said of a file, as a line of ours; other warnings as Python prints them."""
    if issubclass(category, MeshWarning):
        print(f"rasp: {message}", file=sys.stderr)
    else:
        print(warnings.formatwarning(message, category, filename, lineno, line), end="", file=sys.stderr)


def _within(least: int, most: int) -> Callable[[str], int]:
    """What reads a whole number between two bounds."""

    def number(text: str) -> int:
        try:
            found = int(text)
        except ValueError:
            found = least - 1
        if not least <= found <= most:
            raise argparse.ArgumentTypeError(f"a whole number from {least} to {most} is needed, got {text!r}")
        return found

    return number


_pixels, _seed = _within(1, 4096), _within(0, 2**31 - 1)


def _parser() -> _Parser:
    parser = _Parser(prog="rasp", description="Arrange rigid 3D objects by their shadows, without overlap.")
    parser.add_argument("--version", action="version", version=f"rasp {__version__}")
    added = parser.add_subparsers(required=True, metavar="COMMAND", parser_class=_Parser)

    pack = added.add_parser("pack", help="pack objects into a container")
    _add_problem(pack)
    pack.add_argument("--lambda", dest="lambda_", type=float, help="weight of Eq. 5 (default: 0.001)")
    pack.add_argument("--epsilon", type=float, help="depth of Eq. 5, a length (default: 0.01 m)")
    pack.add_argument("--weighting", metavar="NAME", help="how Eq. 1 weighs its terms (default: summed)")
    pack.add_argument("--shadow", metavar="NAME", help="silhouette (default), or thickness or slices: the kit's own")
    pack.add_argument("--seed", type=_seed, default=0)
    pack.add_argument(
        "--fixed", action="append", metavar="FILE", help="a run or meshes whose objects stay in their places"
    )
    pack.add_argument(
        "--boxes",
        metavar="N|CSV",
        help="all objects in at most N boxes like the container; auto: as few as go; or a table: container, count",
    )
    pack.add_argument(
        "--keep-out",
        action="append",
        metavar="FILE",
        help="a closed mesh, a zone that stays free; up from the floor of a box to be found",
    )
    pack.add_argument("--settle", action="store_true", help="let the packing fall under gravity, and judge it anew")
    pack.add_argument("--gravity", action="store_true", help="what is found comes to rest under gravity, and stands")
    pack.add_argument("--export", default="", metavar="FORMATS", help="of 3mf,stl,csv: the parts in their places")
    pack.add_argument(
        "--record", action="store_true", default=None, help="also run.html: how the objects came there, to be played"
    )
    pack.add_argument(
        "--separable", action="store_true", help="only what straight pulls take out through the top; also load.html"
    )
    pack.add_argument("--out", type=Path, default=Path("out"), help="the run's folder (default: out)")
    pack.set_defaults(run=commands.pack)

    sweep = added.add_parser("sweep", help="pack with many seeds and weights at once, on Dask")
    _add_problem(sweep)
    sweep.add_argument("--seeds", type=int, default=8, metavar="N", help="the seeds 0 to N - 1 (default: 8)")
    sweep.add_argument("--lambda", dest="lambda_", type=float, nargs="+", help="one or more (default: 0.001)")
    sweep.add_argument("--epsilon", type=float, nargs="+", help="one or more lengths (default: 0.01 m)")
    sweep.add_argument("--weighting", metavar="NAME", nargs="+", help="one or more (default: summed)")
    sweep.add_argument("--shadow", metavar="NAME", nargs="+", help="one or more (default: silhouette)")
    sweep.add_argument("--workers", type=int, help="local processes (default: one for each core)")
    sweep.add_argument("--scheduler", metavar="ADDRESS", help="a running Dask cluster instead, tcp://HOST:8786")
    sweep.add_argument("--out", type=Path, default=Path("out"), help="finished runs are kept here (default: out)")
    sweep.set_defaults(run=commands.sweep)

    check = added.add_parser("check", help="certificate and density of a run; exit status 1 where it fails")
    check.add_argument("scene", metavar="DIR|scene.glb", type=Path)
    check.add_argument("--unit", default="m", help="of the clearances: mm, cm, m, inch (default: m)")
    _add_clearance(check)
    check.add_argument("--separable", action="store_true", help="whether straight pulls take all out through the top")
    check.set_defaults(run=commands.check)

    assemble = added.add_parser("assemble", help="put the parts of a broken thing back together")
    assemble.add_argument(
        "parts", nargs="+", metavar="PARTS", help="mesh files or folders of them; poses do not matter"
    )
    _add_reading(assemble)
    whole = assemble.add_mutually_exclusive_group()
    whole.add_argument("--whole", metavar="FILE", help="the whole's mesh, closed (default: the pieces alone)")
    whole.add_argument("--silhouettes", nargs="+", metavar="PNG", help="pictures of the whole, one for each view")
    assemble.add_argument("--azimuths-deg", type=float, nargs="+", help="(default: 0 90 0)")
    assemble.add_argument("--elevations-deg", type=float, nargs="+", help="(default: 0 0 90)")
    assemble.add_argument("--width", type=float, help="of the silhouettes' edges")
    assemble.add_argument("--seed", type=_seed, default=0)
    assemble.add_argument("--out", type=Path, default=Path("out"), help="the run's folder (default: out)")
    assemble.set_defaults(run=commands.assemble)

    art = added.add_parser("art", help="heap objects up so that each side shows another picture")
    art.add_argument("objects", nargs="+", metavar="OBJECTS", help="mesh files or folders of them, to be repeated")
    _add_reading(art)
    shown = art.add_mutually_exclusive_group(required=True)
    shown.add_argument("--targets", nargs="+", metavar="PNG", help="two to four pictures, one for each view")
    shown.add_argument(
        "--text", nargs="+", type=_word, metavar="WORD", help="for each view: a heap for each place in the longest"
    )
    art.add_argument("--azimuths-deg", type=float, nargs="+", help="(default: 0 90; 0 120 240; 0 45 90 135)")
    art.add_argument("--elevations-deg", type=float, nargs="+", help="(default: 0 each)")
    art.add_argument("--projection", default="orthographic", choices=["orthographic", "perspective"])
    art.add_argument(
        "--room", type=Path, metavar="JSON", help="where lamps, walls and floor are, instead of directions"
    )
    art.add_argument(
        "--fit-targets",
        nargs="?",
        const="0.1,0.15,8",
        metavar="SHIFT,SCALE,DEG",
        help="how much pictures may give way to agree: of their edge, by one more or less, degrees (0.1,0.15,8)",
    )
    art.add_argument("--width", type=float, help="of the pictures (default: chosen)")
    art.add_argument("--count", type=int, help="objects, at most (default: as many as are needed)")
    art.add_argument("--resolution", type=_pixels, default=512, help="pixels along a picture (default: 512)")
    art.add_argument(
        "--time-limit", type=float, metavar="S", default=120.0, help="seconds after which no other width is tried (120)"
    )
    art.add_argument("--paint", action="store_true", help="paint the pictures' colours onto the heap")
    made = art.add_mutually_exclusive_group()
    made.add_argument("--build", action="store_true", help="also one closed piece for a printer: built.stl, built.3mf")
    made.add_argument("--hang", action="store_true", help="also threads to hang it by: hung.3mf, threads.csv")
    art.add_argument("--printer", metavar="X,Y,Z", help="its volume in mm, which is filled (default: 200,200,200)")
    art.add_argument("--thickness", type=float, metavar="MM", help="of struts and joints, at least (default: 2)")
    art.add_argument("--thread", type=float, metavar="MM", help="how thick threads are (default: 0.2)")
    art.add_argument("--pictures", action="store_true", help="also installation.png, turntable.gif, heap.html")
    art.add_argument("--seed", type=_seed, default=0)
    art.add_argument("--device", default="auto", help="auto, cpu, cuda, cuda:1, mps (default: auto)")
    art.add_argument("--out", type=Path, default=Path("out"), help="the run's folder (default: out)")
    art.set_defaults(run=commands.art)

    figures = added.add_parser("figures", help="run the figure notebooks and compare their facts")
    figures.add_argument("names", nargs="*", metavar="NAME", help="such as 03_packing_density (default: all)")
    figures.add_argument(
        "--scale", default="quick", choices=["quick", "paper"], help="embedded data, or the real pools"
    )
    figures.add_argument(
        "--store", action="store_true", help="keep figures in paper_figures/, and quick notebooks in notebooks/"
    )
    figures.set_defaults(run=commands.figures)
    return parser


def _word(text: str) -> str:
    """What was typed, also where the locale is not UTF-8 and its letters came as bytes."""
    return text.encode("utf-8", "surrogateescape").decode("utf-8", "replace")


def _add_reading(parser: argparse.ArgumentParser) -> None:
    """What mesh files and lengths mean."""
    parser.add_argument(
        "--unit", default="m", help="of lengths, and of files that state none: mm, cm, m, inch (default: m)"
    )
    parser.add_argument(
        "--repair", default="close", help="none; close: small holes (default); wrap: any sheet or soup, on a grid"
    )
    parts = parser.add_mutually_exclusive_group()
    parts.add_argument("--together", action="store_true", help="a file of several parts is one object")
    parts.add_argument("--split", action="store_true", help="pieces of a file that do not touch are objects, too")


def _add_clearance(parser: argparse.ArgumentParser) -> None:
    """What is to be kept clear."""
    parser.add_argument("--clearance", type=float, metavar="D", help="least distance between two objects")
    parser.add_argument(
        "--wall-clearance", type=float, metavar="D", help="least distance from the wall (default: as much)"
    )


def _add_problem(parser: argparse.ArgumentParser) -> None:
    """The arguments that one packing and many have in common."""
    parser.add_argument("objects", nargs="*", metavar="OBJECTS", help="mesh files or folders of them; part.stl*12")
    parser.add_argument(
        "--parts", metavar="CSV", help="a table: file, count, must, priority, turns, scale, clearance, colour"
    )
    parser.add_argument("--container", help="box:X,Y,Z; a closed mesh; auto, auto:cube or auto:X,Y,*")
    parser.add_argument("--cavity", action="store_true", help="pack into what the container's mesh holds, not its wall")
    _add_reading(parser)
    _add_clearance(parser)
    parser.add_argument("--azimuths-deg", type=float, nargs="+", help="of the views (default: 3 of a box, 5 of a mesh)")
    parser.add_argument("--elevations-deg", type=float, nargs="+", help="as many as --azimuths-deg")
    parser.add_argument("--count", default="auto", help="auto (search), or exactly how many to arrange")
    parser.add_argument("--repeat", type=int, metavar="D", help="draw a pool of D objects with replacement")
    parser.add_argument(
        "--fit-objects", type=int, metavar="N", help="scale all objects so that N make half the container"
    )
    parser.add_argument(
        "--method",
        help="paper: the paper's (default); dense: the kit's own (for auto); baselines: spectral, dblf, heightmap",
    )
    parser.add_argument("--time-limit", type=float, metavar="S", help="seconds for the search")
    parser.add_argument("--effort", type=int, metavar="E", help="tries of --method dense, instead of seconds")
    parser.add_argument("--iterations", type=int, help="length of the optimisation (default: 1000)")
    parser.add_argument(
        "--viewing-volume", type=float, metavar="W", help="its edge over the container's extent (default: 2)"
    )
    parser.add_argument("--resolution", type=_pixels, help="pixels along a silhouette (default: 256)")
    parser.add_argument("--device", default="auto", help="auto, cpu, cuda, cuda:1, mps (default: auto)")
