"""Lists taken out of a model's XML are the same as those that a parser finds in it."""

import numpy as np
import pytest

from rasp_core.io.model_xml import ModelXml
from rasp_core.util.errors import MeshError

MESH = (
    '<mesh><vertices><vertex x="0" y="0" z="1e-3"/><vertex x="1" y="-2.5" z="0"/>\n'
    '<vertex x="0" y="1" z="0"/></vertices>'
    '<triangles><triangle v1="0" v2="1" v3="2"/><triangle v1="2" v2="1" v3="0" pid="3" p1="0"/></triangles></mesh>'
)
VERTICES, TRIANGLES = [[0, 0, 1e-3], [1, -2.5, 0], [0, 1, 0]], [[0, 1, 2], [2, 1, 0]]


def model(mesh, before=""):
    return f"{before}<model><object>{mesh}</object><object>{mesh}</object></model>"


@pytest.mark.parametrize(
    "text",
    [
        model(MESH).encode(),
        model(MESH.replace('x="0" y="0" z="1e-3"', "z='1e-3' y='0' x = '0'")).encode(),
        model(MESH.replace('z="0"/>', 'z="0"></vertex>')).encode(),
        model(MESH.replace("<vertices>", '<vertices xml:lang="en">')).encode(),
        model(MESH, "<!-- <vertices> <triangles> -->").encode(),
        model(MESH.replace("<triangles>", "<triangles><!-- <triangle/> -->")).encode(),
        model(MESH).replace("<model>", '<model xmlns="urn:x">').encode(),
        ('<?xml version="1.0" encoding="UTF-16"?>' + model(MESH)).encode("utf-16"),
        model(MESH)
        .replace("<", "<m:")
        .replace("<m:/", "</m:")
        .replace("<m:model>", '<m:model xmlns:m="urn:x">')
        .encode(),
    ],
)
def test_numbers(text):
    xml = ModelXml(text)
    found = [(event, element) for event, element in xml.elements("object") if event == "end"]
    assert len(found) == 2
    for _, element in found:
        mesh = element[0]
        assert xml.count(element) == 2
        np.testing.assert_array_equal(xml.numbers(mesh, "vertices"), VERTICES)
        np.testing.assert_array_equal(xml.numbers(mesh, "triangles"), TRIANGLES)


def test_lists_are_taken_out():
    assert len(ModelXml(model(MESH).encode()).text) < 300
    assert b"v1" in ModelXml(model(MESH).encode() + b"<!-- -->").text


@pytest.mark.parametrize(
    ("was", "now", "name"),
    [('x="1"', 'x="one"', "vertices"), ('x="1"', "", "vertices"), ('v1="0"', 'v1="0.5"', "triangles")],
)
def test_what_is_no_number(was, now, name):
    xml = ModelXml(model(MESH.replace(was, now)).encode())
    for event, element in xml.elements("mesh"):
        if event == "end":
            with pytest.raises(MeshError, match="stands where a"):
                xml.numbers(element, name)


def test_lists_that_are_not_there():
    xml = ModelXml(b"<mesh><vertices><vertex ")
    assert xml.text == b"<mesh><vertices><vertex "
    xml = ModelXml(b"<mesh></mesh>")
    for _, element in xml.elements("mesh"):
        assert xml.numbers(element, "vertices").shape == xml.numbers(element, "triangles").shape == (0, 3)
        assert xml.count(element) == 0
