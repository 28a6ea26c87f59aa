"""Frames as a movie file: MP4, WebM or GIF, with reproducible bytes.

MP4 and WebM are written by FFmpeg's libraries (bundled with the package ``av``), GIF by Pillow. Videos are encoded by
one thread, because the output depends on the number of threads, and x264 runs without its processor-specific code,
whose output once changed from run to run. No file holds a date.

Source: vibration text, section 3.2 (formats of movies, and codecs).
"""

from __future__ import annotations

import io
from collections.abc import Iterable, Iterator
from fractions import Fraction
from importlib import import_module
from typing import Any

from vibsim.core.errors import VibsimError
from vibsim.report.movie.drawing import COLOURS, Pixels

VIDEOS: dict[str, tuple[str, dict[str, str]]] = {
    "mp4": ("libx264", {"crf": "20", "preset": "fast", "threads": "1", "x264-params": "asm=0"}),
    "webm": ("libvpx-vp9", {"crf": "32", "b": "0", "cpu-used": "5", "threads": "1"}),
}
"""Extension of a file to its codec and options."""
FORMATS = (*VIDEOS, "gif")
SHADES = 16  # of each colour of a GIF, between it and the background


def png(frame: Pixels) -> bytes:
    """Return a frame as PNG."""
    from PIL import Image

    stream = io.BytesIO()
    Image.fromarray(frame).save(stream, format="png")
    return stream.getvalue()


def check(form: str) -> None:
    """Raise VibsimError if the package that writes a format cannot be used."""
    if form in VIDEOS:
        try:
            import_module("av")
        except ImportError as error:
            hint = "install it (pip install av), or write a .gif, which needs nothing"
            raise VibsimError(f"{form}: the package av cannot be used ({error}): {hint}") from None


def movie(frames: Iterable[Pixels], fps: float, form: str) -> bytes:
    """Return a movie of frames at `fps` frames a second."""
    return _gif(iter(frames), fps) if form == "gif" else _video(frames, fps, form)


def _video(frames: Iterable[Pixels], fps: float, form: str) -> bytes:
    import av

    codec, options = VIDEOS[form]
    file = io.BytesIO()
    # without `bitexact` a WebM file holds a random number, and both formats the version of the writer
    with av.open(file, "w", format=form, options={"fflags": "+bitexact"}) as container:
        stream: Any = container.add_stream(
            codec, rate=Fraction(fps).limit_denominator(1001), options=options
        )
        stream.pix_fmt = "yuv420p"
        for k, frame in enumerate(frames):
            if k == 0:
                stream.height, stream.width = frame.shape[:2]
            container.mux(stream.encode(av.VideoFrame.from_ndarray(frame, format="rgb24")))
        container.mux(stream.encode())
    return file.getvalue()


def _gif(frames: Iterator[Pixels], fps: float) -> bytes:
    from PIL import Image

    palette = Image.new("P", (1, 1))
    palette.putpalette(_shades())

    def reduced() -> Iterator[Any]:
        for frame in frames:
            yield Image.fromarray(frame).quantize(palette=palette, dither=Image.Dither.NONE)

    stream = io.BytesIO()
    duration = max(20, 10 * round(100.0 / fps))  # in whole hundredths of a second
    images = reduced()
    next(images).save(
        stream, format="gif", save_all=True, append_images=images, duration=duration, loop=0
    )
    return stream.getvalue()


def _shades() -> list[int]:
    """Return all colours of frames mixed with the background: one palette for all frames prevents flicker."""
    palette = [255, 255, 255]
    for colour in COLOURS:
        for i in range(1, SHADES + 1):
            parts = (int(colour[k : k + 2], 16) for k in (1, 3, 5))
            palette += [255 + round((part - 255) * i / SHADES) for part in parts]
    return palette
