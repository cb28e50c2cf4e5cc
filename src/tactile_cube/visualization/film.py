"""A small film of an episode, on which a person can check the regrasps, and the best episodes of an evaluation."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from io import BytesIO
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from tactile_cube.evaluation.episode_record import EpisodeRecord
from tactile_cube.evaluation.evaluation import Evaluation, VariantResult
from tactile_cube.evaluation.verdict import touching
from tactile_cube.hand import DLR_HAND2, Hand
from tactile_cube.visualization.episode_recording import description, write_episode
from tactile_cube.visualization.scene import BELOW, SIDE, Scene
from tactile_cube.whole_file import write_whole

MAX_BYTES = 3_000_000
MAX_FRAMES = 200
STRIDE = 2
"""Policy steps from frame to frame: five frames a second."""
PALETTE_FRAMES = 6
CAPTION_HEIGHT = 22
TOUCH, FREE = (40, 160, 70), (205, 205, 205)


def showcase(evaluation: Evaluation, variants: list[VariantResult], folder: Path) -> None:
    """Run the best episodes of the first variant again and show them in `folder`; say where and how to look."""
    first = variants[0]
    best = sorted(first.results, key=lambda result: result.final_angle, reverse=True)[: evaluation.protocol.film]
    for result in best:
        record = evaluation.record(first.variant, result)
        file = folder / f"episode{result.episode}"
        record.save(file.with_suffix(".npz"))
        hand = evaluation.hand
        write_film(record, file.with_suffix(".gif"), hand=hand)
        write_episode(record, file.with_suffix(".rrd"), hand, summary=description(result))
        print(f"episode {result.episode}: {file}.gif; look inside: rerun {file}.rrd")


def write_film(record: EpisodeRecord, path: Path, *, view: int = 256, hand: Hand = DLR_HAND2) -> None:
    """Write an animated GIF: the hand from the side and from below, at most 3 MB, faster than real time beyond 40 s.

    Args:
        record: the episode.
        path: file to write, `.gif`.
        view: edge of each of the two pictures [pixels].
        hand: the hand that acted.
    """
    stride = max(STRIDE, -(-record.steps // MAX_FRAMES))
    samples = list(range(0, record.steps + 1, stride))
    frames = _frames(record, samples, view, hand)
    duration = STRIDE * float(record.time[1] - record.time[0])
    for colours, part in ((96, 1.0), (48, 1.0), (24, 1.0), (24, 2 / 3)):
        size = (int(part * frames[0].width), int(part * frames[0].height))
        film = _gif([frame.resize(size) for frame in frames], duration, colours)
        if len(film) <= MAX_BYTES:
            break
    write_whole(path, film)


def _frames(record: EpisodeRecord, samples: list[int], view: int, hand: Hand) -> list[Image.Image]:
    contact = touching(record)
    frames = []
    with closing(Scene(record.cube_size, hand, record.object_shape)) as scene:
        for sample in samples:
            scene.pose(record.joint_position[sample], record.cube_position[sample], record.cube_quaternion[sample])
            frame = Image.new("RGB", (2 * view, view + CAPTION_HEIGHT), "white")
            frame.paste(scene.picture(SIDE, view, view), (0, CAPTION_HEIGHT))
            frame.paste(scene.picture(BELOW, view, view), (view, CAPTION_HEIGHT))
            angle = record.theta[sample] - record.theta[0]
            _caption(frame, float(record.time[sample]), float(angle), record.fingers, contact[sample].tolist())
            frames.append(frame)
    return frames


def _caption(frame: Image.Image, time: float, angle: float, fingers: Sequence[str], contact: list[bool]) -> None:
    """Write time and angle, and a lamp for each finger: green while it touches the cube."""
    draw = ImageDraw.Draw(frame)
    draw.text((4, 5), f"{time:4.1f} s  {np.degrees(angle):5.0f} deg", fill="black")
    spacing = frame.width // 2 // len(fingers)
    for index, (finger, on) in enumerate(zip(fingers, contact, strict=True)):
        left = frame.width // 2 + index * spacing
        draw.rectangle((left, 3, left + spacing - 3, CAPTION_HEIGHT - 3), fill=TOUCH if on else FREE)
        draw.text((left + 3, 5), finger[:6], fill="white" if on else "black")


def _gif(frames: list[Image.Image], duration: float, colours: int) -> bytes:
    """Return a GIF with one palette for all frames, taken from a few of them, so that nothing flickers."""
    few = frames[:: max(1, len(frames) // PALETTE_FRAMES)]
    strip = Image.new("RGB", (frames[0].width, len(few) * frames[0].height))
    for index, frame in enumerate(few):
        strip.paste(frame, (0, index * frame.height))
    palette = strip.quantize(colours)
    indexed = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    film, lasts = BytesIO(), round(1000 * duration)
    indexed[0].save(film, "GIF", save_all=True, append_images=indexed[1:], duration=lasts, loop=0, optimize=False)
    return film.getvalue()
