"""Pictures of one shape, drawn in different ways."""

import numpy as np
import pytest
from PIL import Image

from rasp_core.io.images import read_silhouettes, read_targets
from rasp_core.util.errors import InputError, PictureWarning

SHAPE = np.zeros((32, 32), np.uint8)
SHAPE[8:20, 10:14] = 255


def save(path, pixels):
    Image.fromarray(pixels).save(path)
    return path


def test_dark_on_light_light_on_dark_and_alpha_are_the_same(tmp_path):
    clear = np.zeros((32, 32, 4), np.uint8)
    clear[..., 3] = SHAPE
    paths = [save(tmp_path / f"{k}.png", p) for k, p in enumerate((SHAPE, 255 - SHAPE, clear, 40 + SHAPE // 2))]
    for image in read_silhouettes(paths):
        assert np.array_equal(image > 0.5, SHAPE > 0)


def test_what_is_no_silhouette(tmp_path):
    (tmp_path / "text.png").write_text("no picture")
    cases = {
        "no such picture": [tmp_path / "none.png"],
        "cannot be read as a picture": [tmp_path / "text.png"],
        "one colour only": [save(tmp_path / "black.png", 0 * SHAPE)],
        "square and of one size.*32 x 30": [save(tmp_path / "flat.png", SHAPE[:30])],
        "square and of one size.*16 x 16": [
            save(tmp_path / "large.png", SHAPE),
            save(tmp_path / "small.png", np.ascontiguousarray(SHAPE[4:20, 4:20])),
        ],
    }
    for message, paths in cases.items():
        with pytest.raises(InputError, match=message):
            read_silhouettes(paths)


def ring(size, inner, outer):
    steps = np.arange(size) + 0.5 - size / 2
    distance = np.hypot(steps[:, None], steps)
    return (distance < outer) & (distance > inner)


def test_targets_by_alpha_by_paper_and_by_an_even_background(tmp_path):
    disk = ring(64, -1, 20)
    alpha = np.tile([200, 30, 30, 0], (64, 64, 1))
    alpha[disk, 3] = 255
    paper = np.where(disk, 240, 255)[..., None].repeat(3, 2)
    night = np.where(disk, 220, 20)[..., None].repeat(3, 2)
    paths = [save(tmp_path / f"{k}.png", image.astype(np.uint8)) for k, image in enumerate((alpha, paper, night))]
    dark, colours = read_targets(paths, 64)
    assert dark.shape == (3, 64, 64)
    assert all(np.array_equal(image, disk) for image in dark)
    assert colours[0, 32, 32] == pytest.approx([200 / 255, 30 / 255, 30 / 255], abs=0.01)
    assert np.allclose(colours[0, 0, 0], 1), "white where alpha is 0"


def test_a_photograph_without_a_ground_is_refused(tmp_path):
    noise = np.random.default_rng(0).integers(0, 240, (40, 60, 3)).astype(np.uint8)
    with pytest.raises(InputError, match=r"photo\.png: what is ink cannot be told from its ground"):
        read_targets([save(tmp_path / "photo.png", noise)], 32)


@pytest.mark.parametrize("value", [255, 128, 0])
def test_a_blank_target_is_refused(tmp_path, value):
    with pytest.raises(InputError, match=r"blank\.png: is blank"):
        read_targets([save(tmp_path / "blank.png", np.full((20, 20, 3), value, np.uint8))], 32)


def test_lines_that_vanish_are_refused(tmp_path):
    lines = np.full((640, 640), 255, np.uint8)
    lines[100:500, 320:322] = 0
    with pytest.raises(InputError, match="too thin to show in 32 x 32"):
        read_targets([save(tmp_path / "lines.png", lines)], 32)


DISK = ring(64, -1, 20) & (np.arange(64)[:, None] < 40)  # upright is above
GREY = np.where(DISK, 30, 240).astype(np.uint8)


def layers(*values):
    return [Image.fromarray(np.broadcast_to(v, (64, 64)).astype(np.uint8)) for v in values]


def palette(transparency):
    picture = Image.fromarray(DISK.astype(np.uint8), "L").convert("P")
    picture.putpalette([20, 20, 20, 20, 20, 20])
    return picture, {"transparency": transparency}


GLARE = np.where(DISK, 0.2, 3.0).astype(np.float32)
GLARE[0, :2] = 9000, np.nan
OVER = np.where(DISK, 900, 70000).astype(np.int32)
CLEAR = np.where(DISK, 5000, 60000).astype(np.uint16)
MODES = {
    "grey.png": Image.fromarray(GREY),
    "bits.png": Image.fromarray(~DISK),
    "pair.png": Image.merge("LA", layers(0, np.where(DISK, 100, 0))),
    "deep.png": Image.fromarray(CLEAR),
    "deep_clear.png": (Image.fromarray(CLEAR), {"transparency": 60000}),
    "twelve.png": Image.fromarray((CLEAR // 16).astype(np.uint16)),
    "whole.tiff": Image.fromarray(OVER),
    "float.tiff": Image.fromarray((GREY / 255).astype(np.float32)),
    "glare.tiff": Image.fromarray(GLARE),
    "palette.png": palette(0),
    "palette_bytes.png": palette(bytes([0, 90])),
    "inks.tiff": Image.merge("CMYK", layers(0, 0, 0, 255 - GREY)),
    "inks.jpg": Image.merge("CMYK", layers(0, 0, 0, 255 - GREY)),
    "lab_like.jpg": Image.merge("YCbCr", layers(GREY, 128, 128)),
    "opaque.png": Image.merge("RGBA", layers(GREY, GREY, GREY, 255)),
    "photo.jpg": Image.fromarray(GREY),
    "paper.webp": Image.fromarray(GREY),
    "really_a_jpeg.bmp": (Image.fromarray(GREY), {"format": "JPEG"}),
}


@pytest.mark.parametrize("name", MODES)
def test_every_mode_shows_the_same_shape(tmp_path, name):
    picture, options = MODES[name] if isinstance(MODES[name], tuple) else (MODES[name], {})
    picture.save(tmp_path / name, **options)
    dark, colours = read_targets([tmp_path / name], 64)
    assert (dark[0] == DISK).mean() > (0.99 if "j" in name else 0.9999)
    assert colours[0][DISK].mean() < 0.7 < colours[0, 60].mean(), "ink is darker than its ground"


def test_greys_keep_their_brightness_whatever_their_depth(tmp_path):
    for name in ("deep.png", "twelve.png"):
        MODES[name].save(tmp_path / name)
        colours = read_targets([tmp_path / name], 64)[1][0]
        assert colours[0, 0] == pytest.approx(60000 / 65535, abs=0.01)


@pytest.mark.parametrize(("tag", "turns"), [(3, 2), (6, 3), (8, 1)])
def test_a_phone_held_otherwise(tmp_path, tag, turns):
    exif = Image.Exif()
    exif[0x112] = tag
    Image.fromarray(GREY).save(tmp_path / "phone.png", exif=exif)
    dark, colours = read_targets([tmp_path / "phone.png"], 64)
    assert np.array_equal(dark[0], np.rot90(DISK, turns))
    assert np.array_equal(colours[0, ..., 0] < 0.5, dark[0])


def test_wide_and_high_pictures_keep_their_shape(tmp_path):
    wide = np.pad(GREY, ((0, 0), (32, 32)), constant_values=240)
    paths = [save(tmp_path / "wide.png", wide), save(tmp_path / "high.png", np.ascontiguousarray(wide.T))]
    dark, colours = read_targets(paths, 128)
    assert np.array_equal(dark[0, 32:96, 32:96], DISK)
    assert dark[0].sum() == DISK.sum()
    assert np.array_equal(dark[1], dark[0].T)
    assert np.allclose(colours[:, 0, 0], 240 / 255), "the ground goes on"


def test_large_pictures_are_looked_at_smaller(tmp_path):
    large = np.kron(GREY, np.ones((40, 40), np.uint8))
    dark, _ = read_targets([save(tmp_path / "large.png", large)], 64)
    assert (dark[0] == DISK).mean() > 0.998


def test_the_first_of_several_pictures_is_taken_and_told(tmp_path):
    Image.fromarray(GREY).save(tmp_path / "many.gif", save_all=True, append_images=[Image.fromarray(GREY.T)])
    with pytest.warns(PictureWarning, match=r"many\.gif: holds several pictures; the first is taken"):
        assert np.array_equal(read_targets([tmp_path / "many.gif"], 64)[0][0], DISK)


def test_guesses_are_told_with_the_name_of_the_file(tmp_path):
    path = save(tmp_path / "night.png", 255 - GREY)
    with pytest.warns(PictureWarning, match=r"night\.png: is light on dark"):
        read_targets([path], 64)
    with pytest.warns(PictureWarning, match=r"night\.png: is light on dark"):
        read_silhouettes([path])


@pytest.mark.parametrize("form", ["png", "jpeg", "gif", "webp", "bmp", "tiff"])
@pytest.mark.parametrize("share", [0.3, 0.9])
def test_files_that_are_cut_off(tmp_path, form, share):
    path = tmp_path / f"cut.{form}"
    Image.fromarray(np.random.default_rng(0).integers(0, 255, (64, 64)).astype(np.uint8)).save(path)
    path.write_bytes(path.read_bytes()[: int(path.stat().st_size * share)])
    # of a TIFF, Pillow 12 (Python 3.10) does not say that its end is missing
    with pytest.raises(InputError, match="is cut off" if form != "tiff" else "is cut off|is damaged"):
        read_targets([path], 32)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("text.png", b"no picture", "cannot be read as a picture; use PNG or JPEG"),
        ("empty.png", b"", "is empty"),
        ("head.png", b"\x89PNG\r\n\x1a\n", "is cut off"),
        ("short.jpg", b"\xff\xd8\xff\xe0", "is cut off"),
        ("drawing.svg", b"<svg/>", r"is a drawing in vectors \(SVG\); convert it to a PNG"),
        ("drawing.png", b"<?xml version='1.0'?>\n<svg/>", r"in vectors \(SVG\); convert it to a PNG"),
        ("page.png", b"%PDF-1.7", r"in vectors \(PDF or PostScript\); convert it to a PNG"),
        ("phone.png", b"\0\0\0\x18ftypheic\0\0\0\0mif1heic", "HEIC or alike.*convert it to PNG or JPEG"),
    ],
)
def test_targets_that_are_no_pictures(tmp_path, name, content, message):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=message):
        read_targets([tmp_path / name], 32)


def test_targets_that_are_missing_damaged_or_far_too_large(tmp_path, monkeypatch):
    with pytest.raises(InputError, match="no such picture"):
        read_targets([tmp_path / "none.png"], 32)
    Image.fromarray(np.full((32, 32), np.nan, np.float32)).save(tmp_path / "nan.tiff")
    with pytest.raises(InputError, match=r"is damaged or of a rare kind \(no brightness is a number\)"):
        read_targets([tmp_path / "nan.tiff"], 32)
    path = save(tmp_path / "bomb.png", GREY)
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 1000)
    with pytest.raises(InputError, match="has too many pixels; make it smaller"):
        read_targets([path], 32)
