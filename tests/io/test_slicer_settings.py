"""What slicers say of volumes in a 3MF is read as they write it."""

import io
import zipfile

import pytest

from rasp_core.io.slicer_settings import LEFT_OUT, NEGATIVE, SOLID, Volume, read_settings
from rasp_core.util.errors import MeshError

PRUSA, ORCA = "Metadata/Slic3r_PE_model.config", "Metadata/model_settings.config"


def read(name, text):
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w") as file:
        file.writestr(name, f"<config>{text}</config>")
    return read_settings(zipfile.ZipFile(archive)).objects


@pytest.mark.parametrize(
    ("kind", "volume"),
    [
        ("ModelPart", Volume(SOLID, "the ModelPart 'x'")),
        ("NegativeVolume", Volume(NEGATIVE, "the NegativeVolume 'x'")),
        ("ParameterModifier", Volume(LEFT_OUT, "the modifier 'x'")),
        ("SupportBlocker", Volume(LEFT_OUT, "the support blocker 'x'")),
        ("SupportEnforcer", Volume(LEFT_OUT, "the support enforcer 'x'")),
        ("Odd", Volume(LEFT_OUT, "the Odd 'x'")),
    ],
)
def test_prusa_slicer(kind, volume):
    inner = f'<metadata type="volume" key="name" value="x"/><metadata type="volume" key="volume_type" value="{kind}"/>'
    text = f'<object id="7"><metadata key="name" value="a"/><volume firstid="2" lastid="9">{inner}</volume></object>'
    found = read(PRUSA, text)["7"]
    assert found.name == "a"
    assert found.ranges == [(2, 9, volume)]


def test_an_older_prusa_slicer():
    text = '<object id="7"><volume firstid="0" lastid="1"><metadata key="modifier" value="1"/></volume>'
    assert read(PRUSA, text + "</object>")["7"].ranges == [(0, 1, Volume(LEFT_OUT, "a modifier"))]


@pytest.mark.parametrize(
    ("kind", "role"),
    [
        ("normal_part", SOLID),
        ("negative_part", NEGATIVE),
        *((kind, LEFT_OUT) for kind in ("modifier_part", "support_blocker", "support_enforcer")),
    ],
)
def test_orca_slicer_and_bambu_studio(kind, role):
    found = read(ORCA, f'<object id="3"><metadata key="name" value="a"/><part id="1" subtype="{kind}"/></object>')
    assert found["3"].name == "a"
    assert found["3"].parts["1"].role == role


def test_no_settings():
    assert read("other.config", "") == {}


@pytest.mark.parametrize(
    "text", ["<object>", '<object id="1"><volume/></object>', '<object><volume firstid="-1" lastid="2"/></object>']
)
def test_nonsense(text):
    with pytest.raises(MeshError, match="make no sense"):
        read(PRUSA, text)
