"""What slicers write beside the model of a 3MF: which of its volumes are solid, cut away, or no part of it at all."""

from __future__ import annotations

import zipfile
from dataclasses import dataclass, field

from ..util.errors import MeshError
from .bounds import MAX_BYTES

SOLID, NEGATIVE, LEFT_OUT = "solid", "negative", "left out"
PRUSA, ORCA = ("metadata/slic3r_pe_model.config", "metadata/slic3r_model.config"), "metadata/model_settings.config"
ROLES = {
    **dict.fromkeys(("", "modelpart", "normal_part"), SOLID),
    **dict.fromkeys(("negativevolume", "negative_part"), NEGATIVE),
}
WORDS = {
    **dict.fromkeys(("parametermodifier", "modifier_part"), "modifier"),
    **dict.fromkeys(("supportblocker", "support_blocker"), "support blocker"),
    **dict.fromkeys(("supportenforcer", "support_enforcer"), "support enforcer"),
}


@dataclass(frozen=True)
class Volume:
    """role : SOLID, NEGATIVE or LEFT_OUT. name : what a note calls it."""

    role: str
    name: str


@dataclass
class ObjectSettings:
    """Of one object of the model. ranges : (first triangle, last triangle, volume); parts : by a component's object."""

    name: str = ""
    ranges: list[tuple[int, int, Volume]] = field(default_factory=list)
    parts: dict[str, Volume] = field(default_factory=dict)


@dataclass
class Settings:
    """objects : by their numbers in the first model."""

    objects: dict[str, ObjectSettings] = field(default_factory=dict)


def read_settings(archive: zipfile.ZipFile) -> Settings:
    """The settings of PrusaSlicer, OrcaSlicer or Bambu Studio, empty where there are none.

    Raises MeshError where they make no sense.
    """
    from lxml import etree

    names = {name.lower().lstrip("/"): name for name in archive.namelist()}
    settings = Settings()
    for name in (*PRUSA, ORCA):
        if name not in names:
            continue
        parser = etree.XMLParser(resolve_entities=False, no_network=True, load_dtd=False, huge_tree=False)
        with archive.open(names[name]) as file:
            try:
                root = etree.fromstring(file.read(MAX_BYTES), parser)
                for part in root.iter("object"):
                    _add(settings.objects.setdefault(part.get("id", ""), ObjectSettings()), part)
            except (etree.XMLSyntaxError, ValueError) as error:
                raise MeshError(f"its slicer settings {names[name][:60]!r} make no sense; export it again") from error
    return settings


def _add(settings: ObjectSettings, part) -> None:
    settings.name = _metadata(part).get("name", "") or settings.name
    for volume in part.iterchildren("volume"):  # PrusaSlicer: one mesh, a range of triangles each
        data = _metadata(volume)
        kind = data.get("volume_type", "") or ("ParameterModifier" if data.get("modifier") == "1" else "")
        first, last = int(volume.get("firstid", "")), int(volume.get("lastid", ""))
        if first < 0:
            raise ValueError("a range begins before the first triangle")
        settings.ranges.append((first, last, _volume(kind, data.get("name", ""))))
    for volume in part.iterchildren("part"):  # OrcaSlicer, Bambu Studio: an object each
        kind = volume.get("subtype", "")
        settings.parts[volume.get("id", "")] = _volume(kind, _metadata(volume).get("name", ""))


def _metadata(part) -> dict[str, str]:
    return {one.get("key", ""): one.get("value", "").strip() for one in part.iterchildren("metadata")}


def _volume(kind: str, name: str) -> Volume:
    word = WORDS.get(kind.lower(), kind[:40])
    return Volume(ROLES.get(kind.lower(), LEFT_OUT), f"the {word} {name[:60]!r}" if name else f"a {word}")
