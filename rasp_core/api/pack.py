"""One door for all ways to pack."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..density import voxel_density
from ..exact.certificate import certify
from ..exact.pulls import Dismantling
from ..geometry.containers import Container, FreeBox
from ..geometry.meshes import Body, named_apart
from ..geometry.zones import free_without, without
from ..io.exports import formats
from ..packing import methods
from ..packing.clearance import clearance_of
from ..packing.separable import check_open, made_separable
from ..physics import disassembly
from ..physics.gravity import Settled, settle
from ..physics.resting import Resting, check_may_rest, check_may_turn, made_resting
from ..problem import Settings
from ..util.devices import resolve_device
from ..util.errors import InputError
from .inputs import as_bodies, as_container, as_fixed
from .result import Result

if TYPE_CHECKING:
    from ..visualize.loading_order import LoadingOrder
    from ..visualize.recording import Recording

SEARCHED = 0.8  # of the time for a box to be found that is to come apart; the rest closes it up again
VOXELS = 160  # along the container's longest edge, in which the density is counted again


@dataclass(frozen=True, repr=False)
class PackingResult(Result):
    """A packing of some of a pool's objects.

    method : that found it. chosen : indices into the pool, in the order of `bodies`, whose last may be fixed ones.
    pool : how many there were. musts : names of those that must go in. rounds : what each round left.
    losses : `(I, 5)` of every iteration of every round. recording : of poses and losses, where it was asked for.
    dismantling : how it comes apart through the top, where `separable` was. resting : how it stands, where `gravity`
    was.
    """

    method: str
    chosen: list[int]
    pool: int
    rounds: list[dict]
    losses: np.ndarray
    device: str
    musts: list[str]
    recording: Recording | None = None
    dismantling: Dismantling | None = None
    resting: Resting | None = None

    @property
    def history(self) -> np.ndarray:
        """`(I, 5)` losses of every iteration of every round, columns `objective.LOSS_NAMES`."""
        return self.losses

    def headline(self) -> str:
        """What it is, in one line."""
        return f"Packing {self._counted}, density {self.density:.3f}, {self.verdict}"

    def table(self) -> dict[str, str]:
        """Its facts in words, for a small table."""
        return {"method": self.method, **super().table(), "objects": self._counted.replace(" objects", "")}

    @property
    def _counted(self) -> str:
        around = f" around {len(self.fixed)}" if self.fixed else ""
        return f"{len(self.chosen)} of {self.pool} objects{around}"

    @property
    def fixed(self) -> list[str]:
        """Names of the objects that were there before, the last of `bodies`."""
        return [body.name for body in self.bodies if body.wishes.fixed]

    @cached_property
    def missing(self) -> list[str]:
        """Names of the objects that must go in and did not."""
        return [name for name in self.musts if name not in {body.name for body in self.bodies}]

    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C ended the search."""
        return self.arrangement.interrupted

    @cached_property
    def removal(self) -> disassembly.Removal:
        """In which order the objects can be taken out by straight pulls, and which interlock."""
        return disassembly.remove_all(self.bodies, self.matrices)

    @cached_property
    def loading(self) -> LoadingOrder:
        """How the container is loaded part by part, to be shown. Raises InputError where `separable` was not asked."""
        from ..visualize.loading_order import LoadingOrder

        if self.dismantling is None:
            raise InputError("the order to load it is not known; pack with separable=True")
        return LoadingOrder(self.bodies, self.matrices, self.container, self.dismantling)

    def settle(self) -> Settled:
        """Where the objects come to rest under gravity, certified again: with the same clearance, if one was asked for,
        which objects that rest on each other do not keep. Raises InputError where some are fixed, or only some turns of
        one are wished."""
        if self.fixed:
            raise InputError("what is fixed does not fall, and nothing settles about it; leave out --settle or --fixed")
        check_may_turn(self.bodies, "--settle")
        settled, gaps = settle(self.bodies, self.matrices, self.container), self.certificate.gaps
        if gaps is None:
            return settled
        asked = gaps.of(self.bodies), gaps.wall_clearance
        return replace(settled, certificate=certify(self.bodies, settled.matrices, self.container, clearance=asked))

    def record(self) -> dict:
        """Further entries of result.json: density by voxels too, and whether the objects come apart."""
        voxel = float(np.ptp(self.container.bounds, axis=0).max()) / VOXELS
        return {
            "command": "pack",
            "method": self.method,
            "pool": self.pool,
            "density": self.density,
            "density_voxels": voxel_density(self.bodies, self.matrices, self.container, voxel),
            "voxel": voxel,
            "rounds": self.rounds,
            "device": self.device,
            "seconds": self.seconds,
            "removal": self.removal.to_dict(),
            **({"missing": self.missing} if self.musts else {}),
            **({} if self.dismantling is None else {"separable": self.dismantling.to_dict()}),
            **({} if self.resting is None else {"gravity": self.resting.to_dict()}),
        }

    def save(
        self,
        folder: str | Path,
        facts: Mapping | None = None,
        settled: Settled | None = None,
        export: str = "",
    ) -> Path:
        """As `Result.save`, with run.html where there is a recording, and load.html where `separable` was asked for;
        settled : the packing at rest, written as settled.glb beside it. export : "3mf,stl,csv" or some of them: a named
        object for each part, in millimetres; one mesh of all; a table of poses."""
        from .run_folder import save_run

        exports, facts, scenes = formats(export), self.record() | dict(facts or {}), {}
        if settled is not None:
            facts["settled"], scenes["settled.glb"] = settled.to_dict(), settled.matrices
        pages = {} if self.recording is None else {"run.html": self.recording.page()}
        if self.dismantling is not None:
            pages["load.html"] = self.loading.page()
        kept = self.arrangement, self.certificate, facts, self.losses, scenes
        return save_run(folder, *kept, pages=pages, exports=exports)


def pack(
    parts: str | Path | Sequence[Body] | Sequence[str | Path],
    container: str | Path | Container | FreeBox,
    method: str | None = None,
    *,
    seed: int = 0,
    count: int | None = None,
    time_limit: float | None = None,
    effort: int | None = None,
    clearance: float | None = None,
    wall_clearance: float | None = None,
    device: str = "auto",
    progress: bool = False,
    unit: str = "m",
    fixed: str | Path | Sequence[Body] | Sequence[str | Path] = (),
    keep_out: str | Path | Sequence[Body] | Sequence[str | Path] = (),
    record: bool = False,
    separable: bool = False,
    gravity: bool = False,
    **settings,
) -> PackingResult:
    """Pack rigid objects into a container so that no two overlap, and certify it by exact booleans.

    parts : objects, the files that hold them, or `rasp.Item`s, which say how many and how they may be turned.
    container : `rasp.box(...)`, a mesh file, "box:0.3,0.2,0.2", or
    "auto", "auto:cube", "auto:0.3,0.2,*" for the smallest box that holds all objects.
    method : "paper" (the default: Eq. 1 from random poses, then N = N_max), "dense" (the kit's own search, the default
    of a box to be found), or a baseline, "spectral", "dblf", "heightmap".
    count : exactly so many objects, without search ("paper"). time_limit : seconds. effort : tries ("dense").
    clearance : metres that no two objects come nearer to each other. wall_clearance : the same from the wall, as much
    if None. The certificate's `gaps` say what they are. unit : "mm", "cm", "m" or "inch", that errors are written in.
    fixed : objects that lie in the container already, in its coordinates (a box is about the origin): a run's folder,
    mesh files or bodies. The others go around them, and the certificate judges all. keep_out : closed meshes, zones
    that stay free; what is left of the container counts as the container, and their surface as its wall. In a box whose
    height is to be found they lie about the middle of its base, up from its floor.
    record : keep poses and losses on the way ("paper"), to be shown as `recording`; nothing else changes.
    separable : only what comes apart through the container's open top (its highest plane), one by one by straight
    pulls; `dismantling` has them. What locks is left out or dropped on top instead; a box to be found grows for that.
    gravity : what is found falls and comes to rest, and what then has room is dropped onto it; `resting` says how it
    stands by itself.
    settings : further ones by the names of `problem.Settings` (lambda_, epsilon, iterations, resolution, ...).

    Raises InputError for a setting that the method would ignore, a clearance below 0, for objects larger than
    the container, if not one could be placed, or be pulled out where that is asked.

    >>> import rasp_core as rasp
    >>> from data_fetch import kitchen_like
    >>> packed = rasp.pack(kitchen_like(6), rasp.box(0.3, 0.3, 0.3), method="spectral", time_limit=5)
    >>> packed
    <Packing 6 of 6 objects, density 0.053, certified>
    """
    began = time.monotonic()
    ends = np.inf if time_limit is None else began + time_limit
    bodies, room, there = as_bodies(parts), with_zones(as_container(container), keep_out), as_fixed(fixed)
    bodies = named_apart(bodies, there)
    method = methods.resolve_method(method, room)
    given = {"count": count, "time_limit": time_limit, "effort": effort}
    known = {field.name for field in fields(Settings)} - {"seed"}
    if unknown := sorted(settings.keys() - known):
        raise InputError(f"pack has no setting {', '.join(unknown)}; use some of {', '.join(sorted(known))}")
    named = {name: value for name, value in given.items() if value is not None}
    methods.refuse_ignored(method, named | settings | ({"record": True} if record else {}), room)
    if record and there:
        raise InputError("record shows all objects on their way, and fixed ones stay in their places; leave one out")
    if separable:
        check_open(bodies, room)
        if time_limit and isinstance(room, FreeBox):
            given["time_limit"] = SEARCHED * time_limit
    if gravity:
        check_may_rest([*bodies, *there], room, clearance, wall_clearance, separable)
    recorder, chosen = _recorder(bodies, room) if record else None, resolve_device(device)
    packed = methods.search(
        method=method,
        bodies=bodies,
        container=room,
        settings=Settings(seed=seed, **settings),
        device=chosen,
        progress=progress,
        clearance=clearance,
        wall_clearance=wall_clearance,
        unit=unit,
        fixed=there,
        watch=recorder and recorder.watch,
        separable=separable,
        **given,
    )
    if separable:
        pool, late = [*bodies, *there], lambda: time.monotonic() > ends
        asked = clearance_of(pool, clearance, wall_clearance)
        packed = made_separable(packed, pool, room, asked, count, chosen, late)
    resting = None
    if gravity:
        packed, resting = made_resting(packed, bodies, room, count, chosen)
    return PackingResult(
        arrangement=packed.arrangement,
        certificate=packed.certificate,
        seconds=time.monotonic() - began,
        method=method,
        chosen=[i for i in packed.chosen if i < len(bodies)],
        pool=len(bodies),
        rounds=packed.rounds,
        losses=packed.history,
        device=str(chosen),
        musts=[body.name for body in bodies if body.wishes.must],
        dismantling=packed.dismantling,
        resting=resting,
        recording=recorder and recorder.recording(packed.chosen, packed.poses, Settings(**settings).viewing_volume),
    )


def _recorder(bodies: Sequence[Body], container: Container):
    from ..visualize.recording import Recorder

    return Recorder(bodies, container)


def with_zones(
    container: Container | FreeBox, keep_out: str | Path | Sequence[Body] | Sequence[str | Path]
) -> Container | FreeBox:
    """The container without zones that stay free. Raises InputError as `without` and `free_without` do."""
    zones = as_bodies(keep_out) if isinstance(keep_out, str | Path) or len(keep_out) else []
    if not zones:
        return container
    return free_without(container, zones) if isinstance(container, FreeBox) else without(container, zones)
