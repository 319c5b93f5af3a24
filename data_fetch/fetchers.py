"""Fetch the real data sets into the user's cache, or serve them from the folder `RASP_DATA_MIRROR`.

Every file is checked against the registry's hash, each time. A file reaches the cache whole or not at all.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Sequence
from pathlib import Path

import pooch
import requests

from rasp_core.util import caches

from .errors import DownloadInterrupted, HashMismatch, MissingInMirror, NoNetwork, NotOnServer
from .registry import Entry, entries

MIRROR = "RASP_DATA_MIRROR"
OFFLINE = f"set {MIRROR} to a folder that holds the data, or use the procedural sets"
TIMEOUT = 30  # seconds without an answer


def fetch_kitchen() -> list[Path]:
    """106 .obj files: the Kitchen pool of IR-BPP (58 shapes in stable poses), as the RASP authors publish it.

    Metres; each file a set of touching closed convex pieces. No licence of its own; made from YCB (CC BY 4.0),
    BigBIRD, KIT and the Grasp Database, academic use. Cite Zhao et al. 2023, "Learning Physically Realizable Skills
    for Online Packing of General 3D Shapes", ACM TOG. Raises FetchError.
    """
    return fetch("kitchen")


def fetch_general() -> list[Path]:
    """34 .obj files: objects of IR-BPP's General set. Metres. No licence of their own, academic use.

    Cite Zhao et al. 2023 (see `fetch_kitchen`). Raises FetchError.
    """
    return fetch("general")


def fetch_blockout() -> list[Path]:
    """24 .obj files: IR-BPP's BlockOut polycubes, 8 pieces in 24 poses, cells of 0.059 m. Academic use.

    Cite Zhao et al. 2023 (see `fetch_kitchen`). Raises FetchError.
    """
    return fetch("blockout")


def fetch_cad() -> list[Path]:
    """32 .stl .ply .obj files: mechanical parts standing for IR-BPP's ABC. Units differ from file to file.

    Licences differ (the registry has each): MIT, Apache-2.0, GPL-3.0 (the Voron parts), some without. Cite Koch et
    al. 2019, "ABC: A Big CAD Model Dataset", CVPR, for the true ABC items. Raises FetchError.
    """
    return fetch("cad")


def fetch_containers() -> list[Path]:
    """7 mesh files: squirrel, duck, torus, Max Planck's head, hippo, bob, bunny. Own units, most of them y-up.

    Licences differ (the registry has each). Cite the repository that the URL names. Raises FetchError.
    """
    return fetch("containers")


def fetch_fracture() -> list[Path]:
    """24 .npy files: TU Wien 3D Puzzles scans of broken things (venus 7 parts, cake 11, brick 6).

    Each `(n, 6)` float: points and unnormalised normals in assembled position, unit scale. No licence given. Cite
    Huang et al. 2006, "Reassembling Fractured Objects by Geometric Matching", ACM TOG. Raises FetchError.
    """
    return fetch("fracture")


def fetch_targets() -> list[Path]:
    """4 .jpg files: the two cartoon pictures of the RASP authors' two-view example, plain and flipped. No licence.

    Cite Debnath et al. 2025, "Revisiting 3D Anamorphic Art for Shadow-Guided Packing of Irregular Objects", CVPR.
    Raises FetchError.
    """
    return fetch("targets")


def fetch_nesting() -> list[Path]:
    """52 files: 43 .binvox parts of the open 3D nesting benchmark and 9 .txt, its instances; see `nesting_instance`.

    MIT licence (the repository's). Cite the instances' authors: Stoyan et al. 2004 and 2005, Egeblad et al. 2009, Liu
    et al. 2015, Lamas-Fernandez et al. 2022. Raises FetchError.
    """
    return fetch("nesting")


def cache_folder() -> Path:
    """Where fetched files are kept: `data` in the kit's cache (`rasp_core.util.caches`)."""
    return caches.cache_folder() / "data"


def fetch(group: str) -> list[Path]:
    """The files of a data set of `registry.GROUPS`, sorted by name. Raises FetchError with what to do."""
    return fetch_entries(entries(group))


def fetch_entries(wanted: Sequence[Entry], timeout: float = TIMEOUT) -> list[Path]:
    """The files of some entries, from the mirror where one is set, else from the cache or their URLs."""
    mirror = os.environ.get(MIRROR)
    if mirror:
        return [_from_mirror(Path(mirror), entry) for entry in wanted]
    return [_from_web(entry, timeout) for entry in wanted]


def _from_mirror(mirror: Path, entry: Entry) -> Path:
    path = mirror / entry.group / entry.name
    try:
        data = path.read_bytes()
    except OSError as error:
        raise MissingInMirror(
            f"{path}: not in the mirror ({error.strerror}); add it there, or unset {MIRROR} to download it"
        ) from error
    found = hashlib.sha256(data).hexdigest()
    if found != entry.sha256:
        raise HashMismatch(
            f"{path}: sha256 {entry.sha256[:12]}... of {entry.bytes} bytes expected, {found[:12]}... of {len(data)} "
            "bytes found; replace it in the mirror"
        )
    return path


def _from_web(entry: Entry, timeout: float) -> Path:
    folder = cache_folder() / entry.group
    try:
        return Path(
            pooch.retrieve(
                entry.url,
                known_hash=f"sha256:{entry.sha256}",
                fname=entry.name,
                path=folder,
                downloader=pooch.HTTPDownloader(timeout=timeout),
            )
        )
    except requests.exceptions.HTTPError as error:
        status = error.response.status_code
        raise NotOnServer(f"{entry.url}: the server answered {status} instead of {entry.name}; {OFFLINE}") from error
    except (requests.exceptions.Timeout, requests.exceptions.ChunkedEncodingError) as error:
        raise DownloadInterrupted(
            f"{entry.url}: the download stalled or ended before {entry.bytes} bytes had come; try again, or {OFFLINE}"
        ) from error
    except requests.exceptions.RequestException as error:
        # a server that stalls in the middle of the body is reported as a broken connection
        if "timed out" in str(error).lower() or "incomplete" in str(error).lower():
            raise DownloadInterrupted(f"{entry.url}: the download stalled; try again, or {OFFLINE}") from error
        raise NoNetwork(f"{entry.url}: the server cannot be reached; check the network, or {OFFLINE}") from error
    except ValueError as error:
        raise HashMismatch(
            f"{entry.url}: what came is not {entry.name} of sha256 {entry.sha256[:12]}...; nothing was kept; try "
            f"again, or {OFFLINE}"
        ) from error
    except OSError as error:
        raise NoNetwork(f"{folder}: cannot be written ({error.strerror}); set RASP_CACHE to another folder") from error
