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
from anthro.render.palette import legend
from anthro.render.raytrace import render
from anthro.render.retinas import SHARE, Retinas
from anthro.render.rollout import read_rollout
from anthro.render.stage import Stage
from anthro.runcard import RunCard

# One thread and no metadata, so that the same frames give the same bytes.
H264 = "-c:v libx264 -pix_fmt yuv420p -crf 20 -preset medium -threads 1 -map_metadata -1".split()
H264 += "-fflags +bitexact -flags:v +bitexact -movflags +faststart -f mp4".split()


class Shooting:
    """How a rollout is filmed: its stage and camera, and the panels beside one that recorded what it saw.

    Parameters
    ----------
    stage : Stage
    width, height : int
        Pixels, caption and panels included.
    azimuth : float, optional
        As in `Stage.shot`.
    key_rays : int
        As in `Studio`.
    """

    def __init__(self, stage: Stage, width: int, height: int, azimuth: float | None = None, key_rays: int = 1) -> None:
        self.stage, self._strip = stage, strip_height(height)
        sees = "nerve" in stage.rollout.others
        beside = 2 * round(SHARE * width / 2) if sees else 0
        self._panels = Retinas(stage.rollout, beside, height - self._strip) if sees else None
        self._camera, self._studio = stage.shot(width - beside, height - self._strip, azimuth, key_rays)

    def frame(self, time: float, samples: int) -> np.ndarray:
        """A captioned picture (height, width, 3) uint8 of the rollout at a time, s, by so many rays a pixel's side."""
        picture = render(self.stage.parts(time), self._camera, self._studio, samples)
        now = self.stage.rollout.at(np.array([time]))
        if self._panels:
            picture = np.concatenate([picture, self._panels.draw(now)], axis=1)
        return caption(picture, time, now.controller_on[0], self._strip, legend(self.stage.rollout.limbs))


def frames(
    stage: Stage, times: Sequence[float], width: int, height: int, azimuth: float | None = None
) -> Iterator[np.ndarray]:
    """A captioned picture of a rollout at each of some times.

    Parameters
    ----------
    stage : Stage
    times : sequence of float
        s.
    width, height, azimuth
        As in `Shooting`.

    Yields
    ------
    ndarray (height, width, 3) uint8
        One for each time.
    """
    shooting = Shooting(stage, width, height, azimuth)
    for time in times:
        yield shooting.frame(time, samples=2)


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


def film(
    run: Path,
    demo: str,
    out: Path,
    width: int,
    height: int,
    fps: int,
    at: float | None = None,
    azimuth: float | None = None,
) -> None:
    """Film a demo's rollout as MP4, or one instant of it as PNG; see the command line."""
    if out.suffix not in (".mp4", ".png"):
        raise UserError(f"{out}: must end in .mp4 or .png")
    if min(width, height) < 16 or fps < 1:
        raise UserError(f"{width} x {height} pixels at {fps} fps: too small to film")
    rollout = read_rollout(run, demo)
    start, end = rollout.time[[0, -1]]
    if at is not None and not start <= at <= end:
        raise UserError(f"--at {at:g}: the rollout lasts from {start:g} to {end:g} s")
    stage = Stage(rollout)
    spec = {"demo": demo, "width": width, "height": height, "fps": fps, "azimuth": azimuth}
    with RunCard(out.with_suffix(".run_card.json"), spec, rollout.seed) as card:
        if out.suffix == ".png":
            shooting = Shooting(stage, width, height, azimuth, key_rays=9)
            write_picture(out, shooting.frame(start if at is None else at, samples=3))
            return
        times = np.arange(start, end, 1 / fps)
        pictures = progress(frames(stage, times, width, height, azimuth), len(times), f"{demo} frames")
        write_video(out, pictures, (width, height), fps)
        card.note(frames=len(times))


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
    parser.add_argument("--azimuth", type=float, help="where the camera stands, degrees from the front to the left")
    options = parser.parse_args(argv)
    film(**vars(options))


if __name__ == "__main__":
    sys.exit(cli.run(main))
