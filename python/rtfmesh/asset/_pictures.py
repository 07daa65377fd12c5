"""Pictures: from and to PNG, sampled between their pixels, and filled between charts."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from io import BytesIO

import numpy as np
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError

from .._errors import InputError

Floats = NDArray[np.float32]

# Pictures with more pixels are refused, as Pillow does.
MOST_PIXELS = 2 * (Image.MAX_IMAGE_PIXELS or 1 << 27)
# Texels around charts that get the value of the nearest one; farther ones are mixed.
RINGS = 2

# How glTF names what is beyond a picture's border.
CLAMP, MIRROR = 33071, 33648


def to_linear(shade: NDArray[np.floating]) -> Floats:
    """From sRGB to light, each 0 to 1."""
    return np.where(shade <= 0.04045, shade / 12.92, ((shade + 0.055) / 1.055) ** 2.4).astype(np.float32)


def to_srgb(light: NDArray[np.floating]) -> Floats:
    """From light to sRGB, each 0 to 1."""
    light = np.clip(light, 0.0, 1.0)
    return np.where(light <= 0.0031308, light * 12.92, 1.055 * light ** (1 / 2.4) - 0.055).astype(np.float32)


LINEAR = to_linear(np.arange(256) / 255.0)


@dataclass
class Picture:
    """A picture, and the same at halves of its size."""

    levels: list[NDArray[np.uint8]]
    """Red, green, blue and opacity, shape (height, width, 4), the largest first."""
    is_colour: bool
    """Whether its colours are in sRGB."""

    @classmethod
    def decode(cls, data: bytes, is_colour: bool) -> Picture:
        """Of the bytes of a PNG or JPEG."""
        try:
            # Pillow's own limit is a global one, and told in its own words.
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", Image.DecompressionBombWarning)
                with Image.open(BytesIO(data)) as image:
                    own = _pixels(image)
        except Image.DecompressionBombError:
            raise InputError(f"a picture has more than {MOST_PIXELS:,} pixels; make it smaller") from None
        except (UnidentifiedImageError, OSError, SyntaxError, ValueError) as error:
            raise InputError(f"a picture cannot be read ({error}); save it again as PNG") from None
        levels = [own]
        while min(levels[-1].shape[:2]) > 1:
            levels.append(_half(levels[-1], is_colour))
        return cls(levels, is_colour)

    def shape(self) -> tuple[int, int]:
        """Width and height."""
        height, width = self.levels[0].shape[:2]
        return width, height

    def at(self, uv: NDArray[np.float64], level: NDArray[np.int64], wrap: tuple[int, int]) -> Floats:
        """Values between pixels at places (N, 2), v downwards, shape (N, 4): light and opacity, 0 to 1."""
        found = np.empty((len(uv), 4), dtype=np.float32)
        level = np.clip(level, 0, len(self.levels) - 1)
        for number in np.unique(level):
            chosen = level == number
            found[chosen] = self._between(self.levels[number], uv[chosen], wrap)
        return found

    def _between(self, own: NDArray[np.uint8], uv: NDArray[np.float64], wrap: tuple[int, int]) -> Floats:
        height, width = own.shape[:2]
        x, y = uv[:, 0] * width - 0.5, uv[:, 1] * height - 0.5
        left, top = np.floor(x), np.floor(y)
        across, down = (x - left).astype(np.float32)[:, None], (y - top).astype(np.float32)[:, None]
        columns = [_inside(left + k, width, wrap[0]) for k in (0, 1)]
        rows = [_inside(top + k, height, wrap[1]) for k in (0, 1)]

        def value(row: int, column: int) -> Floats:
            return _decoded(own[rows[row], columns[column]], self.is_colour)

        above = value(0, 0) * (1 - across) + value(0, 1) * across
        below = value(1, 0) * (1 - across) + value(1, 1) * across
        mixed: Floats = above * (1 - down) + below * down
        return mixed


def _pixels(image: Image.Image) -> NDArray[np.uint8]:
    """Red, green, blue and opacity; grey values of 16 bits, which Pillow would cut off, are scaled."""
    if image.mode.startswith("I"):
        grey = np.asarray(image).astype(np.int64).clip(0, 65535) / 257.0
        image = Image.fromarray(np.round(grey).astype(np.uint8))
    return np.asarray(image.convert("RGBA"))


def _decoded(pixels: NDArray[np.uint8], is_colour: bool) -> Floats:
    """Light and opacity, 0 to 1, of pixels with four values."""
    found = pixels.astype(np.float32) / np.float32(255.0)
    if is_colour:
        found[..., :3] = LINEAR[pixels[..., :3]]
    return found


def _inside(at: NDArray[np.float64], count: int, wrap: int) -> NDArray[np.int64]:
    """Indices below `count` of pixels that may be beyond the border."""
    index = at.astype(np.int64)
    if wrap == CLAMP:
        return np.clip(index, 0, count - 1)
    if wrap == MIRROR:
        index = index % (2 * count)
        return np.minimum(index, 2 * count - 1 - index)
    return index % count


def _half(own: NDArray[np.uint8], is_colour: bool) -> NDArray[np.uint8]:
    """A picture with half as many pixels a side, each the mean of four; the last of an odd number is left."""
    height, width = (max(count // 2, 1) for count in own.shape[:2])
    light = _decoded(own[: 2 * height, : 2 * width], is_colour)
    mean = light.reshape(height, light.shape[0] // height, width, light.shape[1] // width, 4).mean(
        axis=(1, 3)
    )
    if is_colour:
        mean[..., :3] = to_srgb(mean[..., :3])
    pixels: NDArray[np.uint8] = np.round(mean * 255.0).astype(np.uint8)
    return pixels


def beside(index: NDArray[np.int64], side: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Texels near covered ones, which are not, and for each the position of a near one in `index`."""
    source = np.full((side, side), -1, dtype=np.int64)
    source.ravel()[index] = np.arange(len(index))
    own = source >= 0
    for _ in range(RINGS):
        before = source.copy()
        for axis, step in ((0, 1), (0, -1), (1, 1), (1, -1)):
            to, of = [slice(None)] * 2, [slice(None)] * 2
            to[axis], of[axis] = (slice(1, None), slice(-1)) if step == 1 else (slice(-1), slice(1, None))
            target, found = source[tuple(to)], before[tuple(of)]
            empty = (target < 0) & (found >= 0)
            target[empty] = found[empty]
    near = np.flatnonzero((source >= 0) & ~own)
    return near, source.ravel()[near]


def painted(
    values: Floats, index: NDArray[np.int64], near: tuple[NDArray[np.int64], NDArray[np.int64]], side: int
) -> Floats:
    """A picture with values (T, C) at covered texels, and all others filled from these, (side, side, C)."""
    picture = np.zeros((side * side, values.shape[1]), dtype=np.float32)
    known = np.zeros(side * side, dtype=np.float32)
    picture[index], known[index] = values, 1.0
    picture[near[0]], known[near[0]] = values[near[1]], 1.0
    return _filled(picture.reshape(side, side, -1), known.reshape(side, side))


def _filled(picture: Floats, known: Floats) -> Floats:
    """The picture with what is not known taken from one of half the size, and so on."""
    side = picture.shape[0]
    if side == 1 or known.all():
        return picture
    half = (side + 1) // 2
    pad = ((0, 2 * half - side), (0, 2 * half - side))
    weight = np.pad(known, pad).reshape(half, 2, half, 2)
    sums = np.pad(picture * known[..., None], (*pad, (0, 0))).reshape(half, 2, half, 2, -1).sum(axis=(1, 3))
    total = weight.sum(axis=(1, 3))
    mean = sums / np.maximum(total, 1.0)[..., None]
    coarse = _filled(mean, (total > 0).astype(np.float32))
    spread = coarse.repeat(2, axis=0).repeat(2, axis=1)[:side, :side]
    return np.where(known[..., None] > 0, picture, spread)


def png(picture: NDArray[np.floating]) -> bytes:
    """The bytes of a PNG of values from 0 to 1, shape (side, side, 3 or 4)."""
    pixels = np.round(np.clip(picture, 0.0, 1.0) * 255.0).astype(np.uint8)
    out = BytesIO()
    Image.fromarray(pixels).save(out, "PNG")
    return out.getvalue()
