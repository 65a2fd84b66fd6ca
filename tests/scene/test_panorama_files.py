import io
import pickle
import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from panoscene.scene import Panorama, PanoramaError, Problem, SceneFormatError, read_panorama

WIDTH, HEIGHT = 128, 64


def gradient() -> np.ndarray:
    """Return a picture with a different colour in each corner."""
    u = np.linspace(0, 255, WIDTH)[None, :].repeat(HEIGHT, 0)
    v = np.linspace(0, 255, HEIGHT)[:, None].repeat(WIDTH, 1)
    return np.stack((u, v, 255 - u), axis=-1).astype(np.uint8)


def expected_rgb() -> torch.Tensor:
    return torch.from_numpy(gradient()).permute(2, 0, 1) / 255


@pytest.mark.parametrize("suffix", ["png", "bmp", "tiff", "webp"])
def test_plain_picture(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"pano.{suffix}"
    Image.fromarray(gradient()).save(path, lossless=True)
    image, panorama = read_panorama(path, camera_height=1.5)
    assert torch.equal(image, expected_rgb())
    assert image.dtype == torch.float32
    assert image.is_contiguous()
    assert panorama == Panorama(WIDTH, HEIGHT, 1.5, f"pano.{suffix}")


def test_jpeg(tmp_path: Path) -> None:
    Image.fromarray(gradient()).save(tmp_path / "pano.jpg", quality=95)
    image, _ = read_panorama(tmp_path / "pano.jpg")
    assert (image - expected_rgb()).abs().mean() < 0.02


@pytest.mark.parametrize("mode", ["RGB", "I;16"])
def test_a_picture_with_more_columns_than_enough_is_reduced(tmp_path: Path, mode: str) -> None:
    path = tmp_path / "pano.png"
    whole = Image.fromarray(gradient())
    if mode == "I;16":
        whole = Image.fromarray(gradient()[..., 0].astype(np.uint16) * 257)
    whole.save(path)
    image, panorama = read_panorama(path, columns=WIDTH // 2)
    assert (panorama.width, panorama.height) == (WIDTH, HEIGHT)
    pixels = read_panorama(path)[0]
    mean = torch.nn.functional.avg_pool2d(pixels[None], 2)[0]
    torch.testing.assert_close(image, mean, atol=0.003, rtol=0)
    for enough in (WIDTH // 2 + 1, WIDTH, 4 * WIDTH):
        assert torch.equal(read_panorama(path, columns=enough)[0], pixels)
    with pytest.raises(ValueError, match="columns"):
        read_panorama(path, columns=0)


@pytest.mark.parametrize("mode", ["RGB", "L"])
def test_a_large_jpeg_is_decoded_smaller(tmp_path: Path, mode: str) -> None:
    Image.fromarray(gradient()).convert(mode).save(tmp_path / "pano.jpg", quality=95)
    image, panorama = read_panorama(tmp_path / "pano.jpg", columns=WIDTH // 2)
    assert (panorama.width, panorama.height) == (WIDTH, HEIGHT)
    whole = read_panorama(tmp_path / "pano.jpg")[0]
    mean = torch.nn.functional.avg_pool2d(whole[None], 2)[0]
    assert image.shape == mean.shape
    assert (image - mean).abs().mean() < 0.02


def test_greyscale(tmp_path: Path) -> None:
    Image.fromarray(gradient()[..., 0]).save(tmp_path / "pano.png")
    image, _ = read_panorama(tmp_path / "pano.png")
    assert image.shape == (3, HEIGHT, WIDTH)
    torch.testing.assert_close(image, expected_rgb()[:1].expand(3, -1, -1))


@pytest.mark.parametrize("suffix", ["png", "tiff"])
def test_16_bit_greyscale_keeps_its_precision(tmp_path: Path, suffix: str) -> None:
    values = np.arange(WIDTH * HEIGHT, dtype=np.uint16).reshape(HEIGHT, WIDTH) * 8
    Image.fromarray(values).save(tmp_path / f"pano.{suffix}")
    image, _ = read_panorama(tmp_path / f"pano.{suffix}")
    torch.testing.assert_close(image[1], torch.from_numpy(values.astype(np.float32) / 65535))


def test_16_bit_colour(tmp_path: Path) -> None:
    # Pillow cannot write one: a PNG by hand, whose high bytes are the gradient
    samples = gradient().astype(">u2") * 257
    rows = b"".join(b"\0" + row.tobytes() for row in samples)

    def chunk(kind: bytes, content: bytes) -> bytes:
        check = struct.pack(">I", zlib.crc32(kind + content))
        return struct.pack(">I", len(content)) + kind + content + check

    header = struct.pack(">IIBBBBB", WIDTH, HEIGHT, 16, 2, 0, 0, 0)
    path = tmp_path / "pano.png"
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", header)
        + chunk(b"IDAT", zlib.compress(rows))
        + chunk(b"IEND", b"")
    )
    image, _ = read_panorama(path)
    torch.testing.assert_close(image, expected_rgb(), atol=1 / 255, rtol=0)


def test_palette_and_black_and_white(tmp_path: Path) -> None:
    picture = Image.fromarray(gradient())
    picture.quantize(256).save(tmp_path / "palette.png")
    image, _ = read_panorama(tmp_path / "palette.png")
    assert (image - expected_rgb()).abs().mean() < 0.05
    picture.convert("1").save(tmp_path / "bits.png")
    image, _ = read_panorama(tmp_path / "bits.png")
    assert set(image.unique().tolist()) == {0.0, 1.0}


@pytest.mark.parametrize("mode", ["RGBA", "LA", "P", "RGB"])
def test_transparent_pixels_are_black(tmp_path: Path, mode: str) -> None:
    path = tmp_path / "pano.png"
    if mode in ("RGBA", "LA"):
        picture = Image.new("RGBA", (WIDTH, HEIGHT), (255, 255, 255, 255)).convert(mode)
        alpha = Image.new("L", (WIDTH, HEIGHT), 255)
        alpha.paste(0, (0, 0, WIDTH, 8))
        alpha.paste(128, (0, 8, WIDTH, 16))
        picture.putalpha(alpha)
        picture.save(path)
    else:
        picture = Image.new("RGB", (WIDTH, HEIGHT), (255, 255, 255))
        picture.paste((200, 100, 50), (0, 0, WIDTH, 8))
        if mode == "P":
            picture = picture.quantize(2)
            pixel = picture.getpixel((0, 0))
            picture.save(path, transparency=pixel)
        else:
            picture.save(path, transparency=(200, 100, 50))
    image, _ = read_panorama(path)
    assert bool((image[:, :8] == 0).all())
    assert bool((image[:, 16:] == 1).all())
    if mode in ("RGBA", "LA"):
        torch.testing.assert_close(image[:, 8:16], torch.full((3, 8, WIDTH), 128 / 255))


@pytest.mark.parametrize("suffix", ["jpg", "tiff"])
def test_cmyk(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"pano.{suffix}"
    Image.fromarray(gradient()).convert("CMYK").save(path)
    image, _ = read_panorama(path)
    assert (image - expected_rgb()).abs().mean() < 0.02


@pytest.mark.parametrize("orientation", range(1, 9))
def test_exif_orientation_is_applied(tmp_path: Path, orientation: int) -> None:
    # what the camera stores so that viewers show the gradient
    undo = {
        2: [Image.Transpose.FLIP_LEFT_RIGHT],
        3: [Image.Transpose.ROTATE_180],
        4: [Image.Transpose.FLIP_TOP_BOTTOM],
        5: [Image.Transpose.TRANSPOSE],
        6: [Image.Transpose.ROTATE_90],
        7: [Image.Transpose.TRANSVERSE],
        8: [Image.Transpose.ROTATE_270],
    }
    stored = Image.fromarray(gradient())
    for step in undo.get(orientation, []):
        stored = stored.transpose(step)
    exif = Image.Exif()
    exif[0x0112] = orientation
    stored.save(tmp_path / "pano.png", exif=exif)
    image, panorama = read_panorama(tmp_path / "pano.png")
    assert (panorama.width, panorama.height) == (WIDTH, HEIGHT)
    assert torch.equal(image, expected_rgb())


def test_an_upright_phone_photo_that_exif_turns_is_refused(tmp_path: Path) -> None:
    exif = Image.Exif()
    exif[0x0112] = 6
    Image.fromarray(gradient()).save(tmp_path / "pano.jpg", exif=exif)
    with pytest.raises(PanoramaError, match="found 64 x 128 pixels"):
        read_panorama(tmp_path / "pano.jpg")


@pytest.mark.parametrize(
    ("size", "message"),
    [
        ((16, 8), "found 16 x 8 pixels, expected at least 64 x 32"),
        ((1, 1), "pixels"),
        ((100, 100), "found 100 x 100 pixels, expected a full equirectangular panorama"),
        ((64, 128), "found 64 x 128 pixels"),
        ((200, 97), "found 200 x 97 pixels"),
    ],
)
def test_wrong_sizes_are_refused(tmp_path: Path, size: tuple[int, int], message: str) -> None:
    Image.new("RGB", size).save(tmp_path / "pano.png")
    with pytest.raises(PanoramaError, match=message) as caught:
        read_panorama(tmp_path / "pano.png")
    assert str(caught.value).startswith(str(tmp_path / "pano.png"))


@pytest.mark.parametrize("size", [(64, 32), (200, 101), (200, 99), (1025, 512)])
def test_a_pixel_more_or_less_is_still_a_panorama(tmp_path: Path, size: tuple[int, int]) -> None:
    Image.new("L", size).save(tmp_path / "pano.png")
    image, panorama = read_panorama(tmp_path / "pano.png")
    assert image.shape == (3, size[1], size[0])
    assert (panorama.width, panorama.height) == size


def test_40_megapixels(tmp_path: Path) -> None:
    size = (8944, 4472)
    Image.new("RGB", size, (255, 0, 51)).save(tmp_path / "pano.jpg", quality=50)
    image, panorama = read_panorama(tmp_path / "pano.jpg")
    assert image.shape == (3, 4472, 8944)
    assert (panorama.width, panorama.height) == size
    torch.testing.assert_close(image[:, 7, 9], torch.tensor([1.0, 0.0, 0.2]), atol=0.02, rtol=0)


@pytest.mark.parametrize(
    ("size", "message"),
    [((18000, 9000), "162 million pixels"), ((40000, 20000), "more than 178 million pixels")],
)
def test_bombs_are_refused_before_they_are_decoded(
    tmp_path: Path, size: tuple[int, int], message: str
) -> None:
    # a header that promises much, and no pixels: decoding it would say "truncated"
    content = io.BytesIO()
    Image.new("L", (WIDTH, HEIGHT)).save(content, "BMP")
    header = bytearray(content.getvalue())
    header[18:26] = size[0].to_bytes(4, "little") + size[1].to_bytes(4, "little")
    (tmp_path / "bomb.bmp").write_bytes(header)
    with pytest.raises(PanoramaError, match=message):
        read_panorama(tmp_path / "bomb.bmp")


def test_no_picture_at_all(tmp_path: Path) -> None:
    with pytest.raises(PanoramaError, match=r"none\.png: no such file"):
        read_panorama(tmp_path / "none.png")
    with pytest.raises(PanoramaError, match="directory"):
        read_panorama(tmp_path)
    for content in (b"", b"not a picture", b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 128 64\n"):
        (tmp_path / "pano.png").write_bytes(content)
        with pytest.raises(PanoramaError, match="known format"):
            read_panorama(tmp_path / "pano.png")


@pytest.mark.parametrize("suffix", ["png", "jpg", "webp", "tiff", "bmp"])
@pytest.mark.parametrize("kept", [0.2, 0.6, 0.95])
def test_truncated_pictures_are_refused(tmp_path: Path, suffix: str, kept: float) -> None:
    path = tmp_path / f"pano.{suffix}"
    noise = np.random.default_rng(0).integers(0, 256, (HEIGHT, WIDTH, 3), dtype=np.uint8)
    Image.fromarray(noise).save(path)
    content = path.read_bytes()
    path.write_bytes(content[: int(len(content) * kept)])
    with pytest.raises(PanoramaError, match=r"damaged|truncated"):
        read_panorama(path)


def test_a_corrupt_png_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "pano.png"
    Image.fromarray(gradient()).save(path)
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 0xFF
    path.write_bytes(content)
    with pytest.raises(PanoramaError, match="damaged"):
        read_panorama(path)


@given(data=st.data(), suffix=st.sampled_from(["png", "jpg", "webp", "tiff", "bmp"]))
@settings(max_examples=120)
def test_damage_gives_a_picture_or_a_panorama_error(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject, suffix: str
) -> None:
    stream = io.BytesIO()
    kinds = {"jpg": "JPEG", "tiff": "TIFF", "webp": "WEBP", "png": "PNG", "bmp": "BMP"}
    Image.fromarray(gradient()).save(stream, kinds[suffix])
    content = bytearray(stream.getvalue())
    for _ in range(data.draw(st.integers(1, 4))):
        end = data.draw(st.sampled_from([64, 400, len(content)]))
        content[data.draw(st.integers(0, min(end, len(content)) - 1))] = data.draw(
            st.integers(0, 255)
        )
    path = tmp_path_factory.mktemp("damaged") / f"pano.{suffix}"
    path.write_bytes(content)
    try:
        image, panorama = read_panorama(path)
    except PanoramaError:
        return
    assert image.shape == (3, panorama.height, panorama.width)
    assert bool(((image >= 0) & (image <= 1)).all())


def test_errors_cross_process_borders() -> None:
    scene_error = SceneFormatError("a.json", [Problem("$.version", "2", "1")])
    for error in (PanoramaError("a.png", "bad"), scene_error):
        again = pickle.loads(pickle.dumps(error))  # noqa: S301
        assert str(again) == str(error)
        assert vars(again) == vars(error)


def test_camera_height_is_checked(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="camera_height: expected metres above 0"):
        read_panorama(tmp_path / "pano.png", camera_height=0.0)
