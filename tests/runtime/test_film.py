from __future__ import annotations

import math
import resource
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio  # noqa: N813
import pytest
from numpy.typing import NDArray

from runtime.film import Film, ImageError, SurfaceImages, check_path


def make_film(width: int = 5, height: int = 3, **changes: Any) -> Film:
    """A film of random values; keyword arguments replace fields."""
    random = np.random.default_rng(1)
    alpha = random.uniform(0.1, 1, (height, width, 1))
    fields: dict[str, Any] = {
        "color": np.dstack([random.uniform(0, 1, (height, width, 3)) * alpha, alpha]),
        "error": random.uniform(0, 0.1, (height, width)),
        "depth": random.uniform(1, 9, (height, width)),
        "normal": random.uniform(-1, 1, (height, width, 3)),
        "instance": random.integers(-1, 1000, (height, width)),
        "integrator": "direct",
        "exposure": 0.0,
        "samples": 4,
        "rays": 100,
        "seconds": 0.5,
        "build_seconds": 0.1,
    } | changes
    for name in ("color", "error", "depth", "normal"):
        fields[name] = fields[name].astype(np.float32)
    surfaces = SurfaceImages(*(fields.pop(name) for name in ("depth", "normal", "instance")))
    return Film(surfaces=surfaces, **fields)


def solid(*rgba: float, **changes: Any) -> Film:
    return make_film(color=np.broadcast_to(np.array(rgba), (3, 5, 4)), **changes)


def read(path: Path, part: int = 0, kind: str = "uint8") -> tuple[NDArray[Any], Any]:
    image: Any = oiio.ImageInput.open(str(path))
    image.seek_subimage(part, 0)
    spec = image.spec()
    return image.read_image(part, 0, 0, spec.nchannels, kind), spec


@pytest.mark.parametrize(
    ("linear", "byte"), [(0, 0), (0.18, 118), (0.5, 188), (1, 255), (7, 255), (0.001, 3)]
)
def test_light_is_shown_by_the_srgb_curve(linear: float, byte: int) -> None:
    assert solid(linear, linear, linear, 1).pixels[0, 0].tolist() == [byte, byte, byte, 255]


def test_exposure_is_in_stops() -> None:
    brighter = solid(0.09, 0.09, 0.09, 1, exposure=1.0)
    np.testing.assert_array_equal(brighter.pixels, solid(0.18, 0.18, 0.18, 1).pixels)
    assert solid(1e-9, 0, 0, 1, exposure=1e6).pixels[0, 0].tolist() == [255, 0, 0, 255]
    assert solid(1e9, 0, 0, 1, exposure=-1e6).pixels[0, 0].tolist() == [0, 0, 0, 255]


@pytest.mark.parametrize("integrator", ["normals", "ids"])
def test_data_is_shown_as_it_is(integrator: str) -> None:
    film = solid(0.5, 0.25, 1, 1, integrator=integrator, exposure=3.0)
    assert film.pixels[0, 0].tolist() == [128, 64, 255, 255]


def test_coverage_is_divided_out() -> None:
    assert solid(0.25, 0.25, 0.25, 0.5).pixels[0, 0].tolist() == [188, 188, 188, 128]
    assert solid(0, 0, 0, 0).pixels[0, 0].tolist() == [0, 0, 0, 0]


def test_a_film_without_surfaces_says_so(tmp_path: Path) -> None:
    film = replace(make_film(), surfaces=None)
    film.save(tmp_path / "a.png")
    assert film.aov("alpha").shape == (3, 5)
    for name in ("depth", "normal", "instance"):
        with pytest.raises(ImageError, match=f"no image '{name}': render with surfaces=True"):
            film.aov(name)
    with pytest.raises(ImageError, match="surfaces=True"):
        film.save(tmp_path / "a.exr")
    assert [path.name for path in tmp_path.iterdir()] == ["a.png"]
    with pytest.raises(ValueError, match="there is no image 'z', but alpha, color"):
        film.aov("z")


def test_png_holds_the_pixels(tmp_path: Path) -> None:
    film = make_film()
    film.save(tmp_path / "a.png")
    got, spec = read(tmp_path / "a.png")
    assert spec.nchannels == 4
    # The reader multiplies by the coverage again: compare what can be compared.
    np.testing.assert_array_equal(got[..., 3], film.pixels[..., 3])
    opaque = solid(0.1, 0.5, 0.9, 1)
    opaque.save(str(tmp_path / "b.PNG"))
    got, spec = read(tmp_path / "b.PNG")
    assert spec.nchannels == 3
    np.testing.assert_array_equal(got, opaque.pixels[..., :3])


def test_jpeg_is_over_black(tmp_path: Path) -> None:
    solid(0.25, 0.25, 0.25, 0.5).save(tmp_path / "a.jpg")
    got, spec = read(tmp_path / "a.jpg")
    assert spec.nchannels == 3
    assert np.abs(got.astype(int) - 137).max() <= 2


def test_exr_holds_everything(tmp_path: Path) -> None:
    ids = np.array([[-1, 0, 1, (1 << 24) + 1, (1 << 32) - 2]] * 3)
    depth = np.full((3, 5), math.inf)
    film = make_film(instance=ids, depth=depth)
    film.save(tmp_path / "a.exr")
    values, spec = read(tmp_path / "a.exr", 0, "float")
    assert tuple(spec.channelnames) == ("R", "G", "B", "A", "Z", "N.X", "N.Y", "N.Z")
    np.testing.assert_array_equal(values[..., :4], film.color)
    np.testing.assert_array_equal(values[..., 4], film.depth)
    np.testing.assert_array_equal(values[..., 5:], film.normal)
    values, spec = read(tmp_path / "a.exr", 1, "uint")
    assert tuple(spec.channelnames) == ("instance",)
    np.testing.assert_array_equal(values[..., 0], ids % (1 << 32))


def test_exr_holds_more_instances_than_32_bits_can_count(tmp_path: Path) -> None:
    ids = np.array([[-1, 0, (1 << 32) - 1, 1 << 32, 10**12]] * 3)
    make_film(instance=ids).save(tmp_path / "a.exr")
    values, spec = read(tmp_path / "a.exr", 1, "uint")
    assert tuple(spec.channelnames) == ("instance", "instance.high")
    low, high = np.moveaxis(values.astype(np.int64), 2, 0)
    np.testing.assert_array_equal(low[:, 1:] + (high[:, 1:] << 32), ids[:, 1:])
    assert (low[:, 0] == (1 << 32) - 1).all()
    assert (high[:, 0] == (1 << 32) - 1).all()


@pytest.mark.parametrize(
    ("format", "start"), [("png", b"\x89PNG"), ("jpeg", b"\xff\xd8\xff"), ("exr", b"v/1\x01")]
)
def test_encoding_gives_the_bytes_of_the_file(format: str, start: bytes) -> None:
    film = make_film()
    assert film.encode(format).startswith(start)
    assert film._repr_png_() == film.encode("png")


def test_images_have_names() -> None:
    film = make_film()
    assert film.aov("depth") is film.depth
    np.testing.assert_array_equal(film.aov("alpha"), film.color[..., 3])
    with pytest.raises(ValueError, match=r"'z'.*depth"):
        film.aov("z")


def test_what_cannot_be_written_is_said_with_its_mend(tmp_path: Path) -> None:
    film = make_film()
    faults = {
        "picture.bmp": r"use \.png, \.jpg or \.exr",
        "picture": r"use \.png, \.jpg or \.exr",
        "none/picture.png": "does not exist: make it",
        "folder.png": "is a folder",
    }
    (tmp_path / "folder.png").mkdir()
    for name, message in faults.items():
        with pytest.raises(ImageError, match=message):
            film.save(tmp_path / name)
        with pytest.raises(ImageError, match=message):
            check_path(tmp_path / name)
    with pytest.raises(ImageError, match="'gif'"):
        film.encode("gif")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["folder.png"]


@pytest.mark.parametrize("name", ["a.png", "a.jpg", "a.exr"])
def test_a_full_disc_leaves_the_old_picture(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_bytes(b"old")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, before[1]))
    try:
        with pytest.raises(ImageError, match=f"{name} cannot be written: "):
            make_film(200, 200).save(path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_picture_too_wide_for_its_format_is_refused() -> None:
    film = make_film(1 << 16, 1)
    with pytest.raises(ImageError, match="65535 columns"):
        film.encode("jpeg")
    assert film.encode("png").startswith(b"\x89PNG")


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="needs a folder that refuses files")
def test_a_refused_file_is_said(tmp_path: Path) -> None:
    with pytest.raises(ImageError, match=r"/proc/picture\.png"):
        make_film().save("/proc/picture.png")
