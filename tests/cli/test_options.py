"""Options mean the same whatever unit they are written in."""

from argparse import Namespace
from pathlib import Path

import pytest

from rasp_core.cli import options
from rasp_core.util.errors import InputError

READING = {"unit": "mm", "repair": "close", "together": False, "split": False}


def test_lengths_are_in_metres_and_other_numbers_as_they_are():
    asked = Namespace(unit="mm", epsilon=[1.0, 20.0], clearance=2.0, iterations=30, lambda_=None)
    found = options.given_of(asked, "epsilon", "clearance", "iterations", "lambda_")
    assert found == {"epsilon": pytest.approx([0.001, 0.02]), "clearance": pytest.approx(0.002), "iterations": 30}
    assert options.metres_of(asked) == 0.001


def test_a_count_is_a_setting_if_there_is_one():
    assert options.counted(3) == {"count": 3}
    assert options.counted(None) == {}


def test_a_container_is_a_box_or_a_file_or_what_a_vessel_holds():
    assert options.container_of(Namespace(container="box:1,2,3", cavity=False)) == "box:1,2,3"
    assert options.container_of(Namespace(container="mug.stl", cavity=True)) == "cavity:mug.stl"
    whole = options.container_of(Namespace(container="mug.stl", cavity=False), whole_path=True)
    assert whole == str(Path("mug.stl").resolve())
    with pytest.raises(InputError, match="--cavity needs a vessel's mesh, got box:1,2,3"):
        options.container_of(Namespace(container="box:1,2,3", cavity=True))


def test_files_are_read_as_the_options_say():
    reading = options.reading_of(Namespace(**READING))
    assert (reading.unit, reading.repair, reading.together, reading.split) == ("mm", "close", False, False)


def test_a_box_to_be_found_has_a_method_of_its_own_and_ignored_settings_are_refused():
    free = Namespace(container="auto", method=None, **READING)
    assert options.method_of(free, {}) == "dense"
    assert options.method_of(Namespace(container="box:1,1,1", method=None, **READING), {"lambda_": 1.0}) == "paper"
    with pytest.raises(InputError, match="method dense does not use lambda"):
        options.method_of(free, {"lambda_": 1.0})
