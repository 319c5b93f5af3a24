"""A 3MF's build: units, places, files within files, and what of it is no part."""

import io
import zipfile

import numpy as np
import pytest
import trimesh

from rasp_core.io import bounds
from rasp_core.io.threemf import parse
from rasp_core.util.errors import MeshError

NAMESPACES = (
    'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02" '
    'xmlns:p="http://schemas.microsoft.com/3dmanufacturing/production/2015/06"'
)
ITEM = '<item objectid="1"/>'


def mesh(size=(1, 2, 3), move=(0, 0, 0), boxes=1):
    """The XML of a box, or of several that grow by one."""
    found = trimesh.util.concatenate([trimesh.creation.box(np.array(size) + k) for k in range(boxes)])
    vertices = "".join('<vertex x="{}" y="{}" z="{}"/>'.format(*row) for row in found.vertices + move)
    faces = "".join('<triangle v1="{}" v2="{}" v3="{}"/>'.format(*row) for row in found.faces)
    return f"<mesh><vertices>{vertices}</vertices><triangles>{faces}</triangles></mesh>"


def thing(number, inner, more=""):
    return f'<object id="{number}" {more}>{inner}</object>'


def parts(*components):
    return f"<components>{''.join(f'<component {one}/>' for one in components)}</components>"


def model(objects, items="", more='unit="millimeter"'):
    return f"<model {more} {NAMESPACES}><resources>{objects}</resources><build>{items}</build></model>"


def archive(objects, items=ITEM, more='unit="millimeter"', **others):
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w") as file:
        for name, text in {"3D/3dmodel.model": model(objects, items, more), **others}.items():
            file.writestr(name, text)
    bounds.CHECKS[".3mf"](data.getvalue())
    return data.getvalue()


def volumes(file):
    return [trimesh.Trimesh(part.vertices, part.faces, process=False).volume for part in file.parts]


@pytest.mark.parametrize(
    ("more", "metres"),
    [
        ("", 1e-3),
        *((f'unit="{u}"', m) for u, m in [("micron", 1e-6), ("inch", 0.0254), ("meter", 1), ("foot", 0.3048)]),
    ],
)
def test_units(more, metres):
    file = parse(archive(thing(1, mesh()), more=more))
    assert file.metres == metres
    assert file.notes == ()
    assert volumes(file) == pytest.approx([6])


def test_items_and_their_places():
    items = '<item objectid="1" transform="0 1 0 -1 0 0 0 0 1 5 6 7"/>'
    items += '<item objectid="1" transform="-1 0 0 0 2 0 0 0 1 0 0 0"/>'
    file = parse(archive(thing(1, mesh(move=(1, 0, 0)), 'name="a"'), items))
    assert [part.name for part in file.parts] == ["a", "a"]
    assert volumes(file) == pytest.approx([6, 12])
    np.testing.assert_allclose(file.parts[0].vertices.mean(0), [5, 7, 7])  # rows times the matrix, as 3MF has it


def test_objects_of_objects():
    inner = thing(2, parts('objectid="1"', 'objectid="1" transform="2 0 0 0 2 0 0 0 2 9 0 0"'))
    outer = thing(3, parts('objectid="2" transform="1 0 0 0 -1 0 0 0 1 0 0 0"', 'objectid="1"'), 'name="whole"')
    file = parse(archive(outer + inner + thing(1, mesh()), '<item objectid="3"/>'))  # in any order
    assert volumes(file) == pytest.approx([6 + 48 + 6])
    assert file.parts[0].name == "whole"


@pytest.mark.parametrize(
    ("top", "below", "item", "settings", "name"),
    [
        ('name="a" partnumber="b"', "", 'partnumber="c"', "", "a"),
        ('partnumber="b"', "", 'partnumber="c"', "", "b"),
        ("", 'name="d"', 'partnumber="c"', "", "c"),
        ("", 'name="d"', "", "", "d"),
        ("", "", "", "", ""),
        ('name="a"', "", "", '<metadata key="name" value="e"/>', "e"),
    ],
)
def test_names(top, below, item, settings, name):
    objects = thing(1, mesh(), below) + thing(2, parts('objectid="1"'), top)
    config = {"Metadata/model_settings.config": f'<config><object id="2">{settings}</object></config>'}
    file = parse(archive(objects, f'<item objectid="2" {item}/>', **config))
    assert [part.name for part in file.parts] == [name]


def test_files_within_files():
    inner = {"3D/Objects/one.model": model(thing(1, mesh()) + thing(2, parts('objectid="1"', 'objectid="1"')))}
    objects = thing(1, parts('p:path="/3D/Objects/one.model" objectid="1"'))  # the same number: no loop
    items = ITEM + '<item p:path="/3D/Objects/One.model" objectid="2"/>'
    assert volumes(parse(archive(objects, items, **inner))) == pytest.approx([6, 12])
    rels = '<Relationships><Relationship Type="http://x/3dmanufacturing/2013/01/3dmodel" Target="/3D/b.model"/>'
    other = {
        "_rels/.rels": rels + "</Relationships>",
        "3D/b.model": model(thing(5, mesh((1, 1, 1))), '<item objectid="5"/>'),
    }
    assert volumes(parse(archive(thing(1, mesh()), **other))) == pytest.approx([1])


def test_files_of_different_units():
    inner = {"3D/one.model": model(thing(1, mesh()) + thing(2, parts('objectid="1"')), more='unit="centimeter"')}
    objects = thing(1, parts('p:path="/3D/one.model" objectid="2"'))
    file = parse(archive(objects, **inner))
    assert volumes(file) == pytest.approx([6000])
    assert file.notes == ("its files have different units; each is taken in its own",)


@pytest.mark.parametrize("kind", ["support", "solidsupport", "surface", "other"])
def test_types_that_are_no_part(kind):
    objects = thing(1, mesh()) + thing(2, mesh((9, 9, 9)), f'type="{kind}" name="tree"')
    objects += thing(3, parts('objectid="1"', 'objectid="2"'))
    file = parse(archive(objects, ITEM + '<item objectid="2"/><item objectid="3"/>'))
    assert volumes(file) == pytest.approx([6, 6])
    assert file.notes == (f"tree of the type {kind} is left out (2 times)",)


def test_items_that_are_not_to_be_printed():
    objects = thing(1, mesh()) + thing(2, mesh(), 'name="parked"')
    file = parse(archive(objects, '<item objectid="2" printable="0"/><item objectid="1" printable="1"/>'))
    assert volumes(file) == pytest.approx([6])
    assert file.notes == ("parked is left out, as it is not to be printed",)
    with pytest.raises(MeshError, match=r"holds no triangles \(parked is left out"):
        parse(archive(objects, '<item objectid="2" p:printable="0"/>'))


def prusa(*volumes):
    rows = [
        f'<volume firstid="{12 * k}" lastid="{12 * k + 11}"><metadata key="name" value="v{k}"/>'
        f'<metadata key="volume_type" value="{kind}"/></volume>'
        for k, kind in enumerate(volumes)
    ]
    return {"Metadata/Slic3r_PE_model.config": f'<config><object id="1">{"".join(rows)}</object></config>'}


def test_volumes_of_prusa_slicer():
    config = prusa("ModelPart", "NegativeVolume", "SupportBlocker", "ModelPart")
    file = parse(
        archive(
            thing(1, mesh((1, 1, 1), boxes=5)), '<item objectid="1" transform="-1 0 0 0 1 0 0 0 1 9 0 0"/>', **config
        )
    )
    assert volumes(file) == pytest.approx([1 + 64 + 125])  # what no range names is solid
    (vertices, faces), *none = file.parts[0].cuts
    assert none == []
    assert trimesh.Trimesh(vertices, faces).volume == pytest.approx(8)
    np.testing.assert_allclose(vertices.mean(0), [9, 0, 0])
    assert file.notes == ("the support blocker 'v2' is left out",)


def test_an_object_of_modifiers_alone():
    with pytest.raises(MeshError, match=r"holds no triangles \(the modifier 'v0' is left out\)"):
        parse(archive(thing(1, mesh()), **prusa("ParameterModifier")))


def test_parts_of_orca_slicer():
    objects = "".join(thing(k, mesh((k, k, k))) for k in (1, 2, 3)) + thing(
        4, parts(*(f'objectid="{k}"' for k in (1, 2, 3)))
    )
    rows = [(1, "normal_part"), (2, "negative_part"), (3, "support_enforcer")]
    text = "".join(f'<part id="{k}" subtype="{kind}"><metadata key="name" value="n{k}"/></part>' for k, kind in rows)
    config = {"Metadata/model_settings.config": f'<config><object id="4">{text}</object></config>'}
    file = parse(
        archive(objects, '<item objectid="4" transform="1 0 0 0 1 0 0 0 1 5 0 0"/><item objectid="3"/>', **config)
    )
    assert volumes(file) == pytest.approx([1, 27])
    assert trimesh.Trimesh(*file.parts[0].cuts[0]).volume == pytest.approx(8)
    np.testing.assert_allclose(file.parts[0].cuts[0][0].mean(0), [5, 0, 0])
    assert file.notes == ("the support enforcer 'n3' is left out",)


@pytest.mark.parametrize("mark", ["support_mesh", "anti_overhang_mesh", "infill_mesh", "cutting_mesh"])
def test_meshes_that_cura_marks(mark):
    data = f'<metadatagroup><metadata name="cura:{mark}">{{}}</metadata></metadatagroup>'
    objects = thing(1, data.format("False") + mesh()) + thing(2, data.format("True") + mesh())
    file = parse(archive(objects, ITEM + '<item objectid="2"/>'))
    assert volumes(file) == pytest.approx([6])
    assert file.notes == (f"an object of the type {mark} is left out",)


def test_what_is_not_read_is_said():
    lattice = mesh().replace("</mesh>", '<b:beamlattice xmlns:b="urn:b"/></mesh>')
    odd = '<o:booleanshape xmlns:o="urn:o"/>'
    more = 'requiredextensions="p q" xmlns:q="urn:q"'
    file = parse(archive(thing(1, lattice, 'name="a"') + thing(2, odd), ITEM + '<item objectid="2"/>', more))
    assert file.notes == (
        "the extension 'urn:q' that it requires is not read",
        "the beam lattice of a is left out",
        "the booleanshape of an object is not read",
    )


def test_faces_stay_as_they_are():
    twice = mesh().replace(
        "</triangles>", '<triangle v1="0" v2="0" v3="1"/><triangle v1="0" v2="1" v3="2"/></triangles>'
    )
    assert parse(archive(thing(1, twice))).parts[0].faces[-2:].tolist() == [[0, 0, 1], [0, 1, 2]]


@pytest.mark.parametrize(
    ("objects", "items", "more", "says"),
    [
        (thing(1, mesh()), "", "", "its build holds no triangles"),
        (thing(1, mesh()), '<item objectid="7"/>', "", r"an object that is not there \(7 in /3d/3dmodel.model\)"),
        (thing(1, mesh()), '<item p:path="/x.model" objectid="1"/>', "", "no model '/x.model'"),
        (thing(1, mesh()) * 2, ITEM, "", "two objects of the number 1"),
        (thing(1, mesh()), ITEM, 'unit="furlong"', "'furlong' is unknown"),
        (thing(1, mesh()), '<item objectid="1" transform="1 0 0"/>', "", "transform of 3 numbers"),
        (thing(1, mesh().replace('v1="0"', 'v1="99"')), ITEM, "", "vertices that are not there"),
        (thing(1, mesh().replace('x="0.5"', 'x="0,5"')), ITEM, "", "decimal comma"),
    ],
)
def test_what_is_refused(objects, items, more, says):
    with pytest.raises(MeshError, match=says):
        parse(archive(objects, items, more))


def test_a_model_that_is_none():
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w") as file:
        file.writestr("3D/3dmodel.model", "<other/>")
    with pytest.raises(MeshError, match="a model that is none"):
        parse(data.getvalue())
