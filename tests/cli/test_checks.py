"""Checks of options: what passes, and the line that says what does not."""

import json
from argparse import Namespace

import pytest

from rasp_core.cli.checks import check_clearances, check_time, check_together, count_of, fit_of, made_of
from rasp_core.cli.main import main
from rasp_core.util.errors import InputError


def test_a_count_is_positive_or_found():
    assert count_of("auto") is None
    assert count_of("12") == 12
    for wrong in ("0", "-1", "many"):
        with pytest.raises(InputError, match=f"--count must be auto or a positive number, got {wrong}"):
            count_of(wrong)


def test_seconds_are_positive():
    check_time(Namespace(time_limit=None))
    check_time(Namespace(time_limit=0.5))
    for wrong in (0.0, float("nan")):
        with pytest.raises(InputError, match="--time-limit must be positive"):
            check_time(Namespace(time_limit=wrong))


def test_clearances_are_lengths():
    check_clearances(Namespace(clearance=0.0, wall_clearance=None))
    for wrong in (-1.0, float("nan"), float("inf")):
        with pytest.raises(InputError, match="--wall-clearance must be a length of 0 or more"):
            check_clearances(Namespace(clearance=1.0, wall_clearance=wrong))


def test_what_is_of_one_box_in_motion_goes_with_neither_boxes_nor_what_is_fixed():
    alone = {"settle": False, "record": False, "gravity": False, "boxes": None, "fixed": None}
    for fine in ({}, {"settle": True, "record": True}, {"boxes": "auto", "fixed": ["there.stl"]}):
        check_together(Namespace(**alone | fine))
    for moves in ("settle", "record"):
        for other in ({"boxes": "2"}, {"fixed": ["there.stl"]}):
            with pytest.raises(InputError, match=f"--{moves} .*--{next(iter(other))}"):
                check_together(Namespace(**alone | {moves: True} | other))
        with pytest.raises(InputError, match=f"--{moves} .*--gravity|--gravity .*--{moves}"):
            check_together(Namespace(**alone | {moves: True, "gravity": True}))


def test_what_is_built_or_hung_up_has_a_printer_of_three_lengths():
    nothing = {"build": False, "hang": False, "printer": None, "thickness": None, "thread": None}
    assert made_of(Namespace(**nothing)) == (None, {})
    assert made_of(Namespace(**nothing | {"build": True})) == ("build", {})
    asked = made_of(Namespace(**nothing | {"build": True, "printer": "220,220,250", "thickness": 1.2}))
    assert asked == ("build", {"printer_mm": (220, 220, 250), "thickness_mm": 1.2})
    assert made_of(Namespace(**nothing | {"hang": True, "thread": 0.5})) == ("hang", {"thread_mm": 0.5})
    with pytest.raises(InputError, match="--printer must be three lengths in mm, as 200,200,200, got large"):
        made_of(Namespace(**nothing | {"build": True, "printer": "large"}))
    with pytest.raises(InputError, match=r"--printer is of a piece .* add --build or --hang"):
        made_of(Namespace(**nothing | {"printer": "220,220,250"}))
    with pytest.raises(InputError, match="--thickness is of a piece to build; add --build"):
        made_of(Namespace(**nothing | {"hang": True, "thickness": 2.0}))
    with pytest.raises(InputError, match="--thread is of a heap to hang up; add --hang"):
        made_of(Namespace(**nothing | {"build": True, "thread": 0.5}))


def test_pictures_give_way_by_three_numbers():
    assert fit_of(Namespace(fit_targets=None)) is None
    assert fit_of(Namespace(fit_targets="0.05,0.1,5")) == (0.05, 0.1, 5)
    for wrong in ("0.1,0.2", "much"):
        with pytest.raises(InputError, match=f"--fit-targets must be a shift, a scale and degrees, .*, got {wrong}"):
            fit_of(Namespace(fit_targets=wrong))


def test_boxes_of_a_table_are_packed(cans, tmp_path, capsys):
    out, table = tmp_path / "out", tmp_path / "boxes.csv"
    table.write_text('container,count\n"box:0.13,0.13,0.13",1\n"box:0.2,0.2,0.2",auto\n')
    asked = ["pack", str(cans), "--method", "spectral", "--boxes", str(table), "--out", str(out)]
    assert main(asked) == 0
    sizes = [box["extent"] for box in json.loads((out / "boxes.json").read_text())["boxes"]]
    assert sizes[0] == pytest.approx([0.13] * 3)
    assert all(size == pytest.approx([0.2] * 3) for size in sizes[1:])
    capsys.readouterr()
    assert main([*asked, "--container", "box:0.2,0.2,0.2"]) == 2
    assert "the table of --boxes has all; leave them" in capsys.readouterr().err
    for command in ("pack", "sweep"):
        assert main([command, str(cans), "--out", str(tmp_path / "no")]) == 2
        assert capsys.readouterr().err.startswith("rasp: --container is needed, such as")
