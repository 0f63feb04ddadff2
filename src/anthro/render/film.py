"""Film a rollout: ``python -m anthro.render.film --run DIR --demo on_off --out FILE.mp4``.

A file that ends in ``.png`` gets one frame, of the time that ``--at`` says.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path

import imageio_ffmpeg
import numpy as np
from PIL import Image

from anthro import cli
from anthro.errors import UserError
from anthro.files import atomic
from anthro.progress import progress
from anthro.render.caption import caption, strip_height
from anthro.render.raytrace import render
from anthro.render.rollout import Rollout, load_body, read_rollout
from anthro.render.stage import Stage
from anthro.runcard import RunCard

# One thread and no metadata, so that the same frames give the same bytes.
H264 = "-c:v libx264 -pix_fmt yuv420p -crf 20 -preset medium -threads 1 -map_metadata -1".split()
H264 += "-fflags +bitexact -flags:v +bitexact -movflags +faststart -f mp4".split()


def frames(stage: Stage, rollout: Rollout, width: int, height: int) -> Iterator[np.ndarray]:
    """A captioned picture of every instant of a rollout.

    Parameters
    ----------
    stage : Stage
    rollout : Rollout
        T instants; the camera is set so that all of them stay in the picture.
    width, height : int
        Pixels, caption included.

    Yields
    ------
    ndarray (height, width, 3) uint8
        T of them.
    """
    strip = strip_height(height)
    camera, studio = stage.shot(rollout, width, height - strip)
    for index, time in enumerate(rollout.time):
        shown = stage.parts(rollout.qpos[index], rollout.activation[index], rollout.target[index])
        picture = render(shown, camera, studio, samples=2)
        yield caption(picture, time, rollout.controller_on[index], strip)


def write_video(path: Path, pictures: Iterable[np.ndarray], size: tuple[int, int], fps: int) -> None:
    """Encode pictures (height, width, 3) uint8 of `size` (width, height) as H.264, yuv420p.

    Raises
    ------
    UserError
        The size is odd, which yuv420p cannot hold.
    OSError
        ffmpeg failed, as on a full disk.
    """
    if size[0] % 2 or size[1] % 2:
        raise UserError(f"a video's width and height must be even, not {size[0]} x {size[1]}")
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-y", "-loglevel", "error"]
    command += ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{size[0]}x{size[1]}"]
    command += ["-r", str(fps), "-i", "-", *H264]
    with atomic(path) as partial:
        pipes = {"stdin": subprocess.PIPE, "stderr": subprocess.PIPE}
        with subprocess.Popen([*command, str(partial)], **pipes) as ffmpeg:
            with suppress(BrokenPipeError):
                for picture in pictures:
                    ffmpeg.stdin.write(np.ascontiguousarray(picture))
            told = ffmpeg.communicate()[1].decode(errors="replace").strip()
        if ffmpeg.returncode:
            reason = told.splitlines()[-1] if told else f"exit code {ffmpeg.returncode}"
            raise OSError(f"{path}: ffmpeg failed ({reason})")


def write_picture(path: Path, picture: np.ndarray) -> None:
    """Write one picture (height, width, 3) uint8 as PNG."""
    with atomic(path) as partial:
        Image.fromarray(picture).save(partial, format="PNG")


def film(run: Path, demo: str, out: Path, width: int, height: int, fps: int, at: float | None = None) -> None:
    """Film a demo's rollout as MP4, or one instant of it as PNG; see the command line."""
    if out.suffix not in (".mp4", ".png"):
        raise UserError(f"{out}: must end in .mp4 or .png")
    if min(width, height) < 16 or fps < 1:
        raise UserError(f"{width} x {height} pixels at {fps} fps: too small to film")
    rollout = read_rollout(run, demo)
    stage = Stage(load_body(run, rollout))
    spec = {"demo": demo, "width": width, "height": height, "fps": fps}
    with RunCard(out.with_suffix(".run_card.json"), spec, rollout.seed) as card:
        if out.suffix == ".png":
            write_picture(out, _still(stage, rollout, width, height, at))
            return
        start, end = rollout.time[[0, -1]]
        shown = rollout.at(np.arange(start, end, 1 / fps))
        pictures = frames(stage, shown, width, height)
        pictures = progress(pictures, len(shown.time), f"{demo} frames")
        write_video(out, pictures, (width, height), fps)
        card.note(frames=len(shown.time))


def _still(stage: Stage, rollout: Rollout, width: int, height: int, at: float | None) -> np.ndarray:
    start, end = rollout.time[[0, -1]]
    time = start if at is None else at
    if not start <= time <= end:
        raise UserError(f"--at {time:g}: the rollout lasts from {start:g} to {end:g} s")
    strip = strip_height(height)
    camera, studio = stage.shot(rollout, width, height - strip, key_rays=9)
    now = rollout.at(np.array([time]))
    parts = stage.parts(now.qpos[0], now.activation[0], now.target[0])
    picture = render(parts, camera, studio, samples=3)
    return caption(picture, time, now.controller_on[0], strip)


def main(argv: Sequence[str] | None = None) -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--run", type=Path, required=True, help="folder of the run")
    parser.add_argument("--demo", required=True, help="its rollout is filmed, such as on_off")
    parser.add_argument("--out", type=Path, required=True, help=".mp4, or .png for one frame")
    parser.add_argument("--width", type=int, default=480, help="pixels")
    parser.add_argument("--height", type=int, default=400, help="pixels, caption included")
    parser.add_argument("--fps", type=int, default=15, help="frames per second")
    parser.add_argument("--at", type=float, help="time of the one frame, s (default: the start)")
    options = parser.parse_args(argv)
    film(**vars(options))


if __name__ == "__main__":
    sys.exit(cli.run(main))
