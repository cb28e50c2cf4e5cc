"""An episode for Rerun, and as a small film on which a person can check the regrasps."""

import tempfile
from collections.abc import Mapping, Sequence
from contextlib import closing
from io import BytesIO
from pathlib import Path

import numpy as np
import rerun as rr
from PIL import Image, ImageDraw
from rerun.urdf import UrdfTree
from scipy.spatial.transform import Rotation

from tactile_cube.env.reward import TOUCH_FORCE
from tactile_cube.evaluation.episode_record import Array, EpisodeRecord
from tactile_cube.evaluation.evaluation import Evaluation, VariantResult
from tactile_cube.evaluation.training_curve import Curve
from tactile_cube.evaluation.verdict import EpisodeResult, touching
from tactile_cube.hand import DLR_HAND2, Hand
from tactile_cube.visualization.charts import write_learning_curves
from tactile_cube.visualization.rerun_recording import (
    Branch,
    Colours,
    episode_blueprint,
    log_robot,
    recording_file,
)
from tactile_cube.visualization.scene import ABOVE, BELOW, SIDE, Part, Scene, object_parts
from tactile_cube.whole_file import write_whole

FINGER_COLOURS = ((214, 69, 65), (245, 171, 53), (38, 166, 91), (65, 131, 215), (150, 90, 200), (90, 190, 200))
JOINT_COLOURS = ((235, 90, 80), (110, 200, 110), (110, 150, 255), (240, 190, 80), (190, 120, 230), (130, 210, 220))
SIGNALS = {"q": 1.0, "q_m": 0.75, "q_f": 0.6, "q_d": 0.45, "torque": 1.0}
"""Signals at the physics rate, and how bright their lines are."""
ARROW_LENGTH = 0.03  # length of a contact arrow [m/N]
POSE_RATE = 50.0  # rate of the 3D poses [Hz]: smooth to the eye; the joint signals keep the physics rate
TRAIL = 50  # policy steps for which the way of the object's corner stays visible: 5 s


def write_episode(record: EpisodeRecord, path: Path, hand: Hand = DLR_HAND2, summary: str = "") -> None:
    """Write one episode with its blueprint; open it with `rerun FILE.rrd`.

    Args:
        record: the episode.
        path: file to write, `.rrd`.
        hand: the hand that acted.
        summary: Markdown shown beside the episode.
    """
    with recording_file(path, episode_blueprint(record.fingers, hand.name, {"": "Hand and cube"})) as stream:
        _log_episode(Branch(stream), record, hand, summary)


def write_pair(
    path: Path,
    episodes: Mapping[str, tuple[EpisodeRecord, str, str]],
    hand: Hand,
    curve: Curve | None,
    words: str,
) -> None:
    """Write episodes side by side on one time line.

    Args:
        path: file to write, `.rrd`.
        episodes: path below which each is written -> record, name, Markdown that describes it.
        hand: the hand that acted.
        curve: learning curve of the run; None: there is none.
        words: Markdown about the run.
    """
    names = {root: name for root, (_, name, _) in episodes.items()}
    fingers = next(iter(episodes.values()))[0].fingers
    with recording_file(path, episode_blueprint(fingers, hand.name, names, curve is not None)) as stream:
        for root, (record, _, described) in episodes.items():
            _log_episode(Branch(stream, f"{root}/"), record, hand, described)
        branch = Branch(stream)
        if curve is not None:  # as a picture: a plot of the viewer would share the time line of the episodes
            with tempfile.TemporaryDirectory() as folder:
                file = Path(folder) / "curves.png"
                write_learning_curves(curve, file)
                branch.log("curves", rr.EncodedImage(path=file))
        branch.always("run", rr.TextDocument(words, media_type="text/markdown"))


def description(result: EpisodeResult) -> str:
    """Return what is said beside the episode in the viewer, in Markdown."""
    lines = [f"# {result.verdict.value.replace('_', ' ')}", "", "| | |", "|---|---|"]
    lines += [f"| {name} | {value} |" for name, value in result.as_dict().items()]
    return "\n".join(lines)


def _log_episode(branch: Branch, record: EpisodeRecord, hand: Hand, summary: str) -> None:
    _log_motion(branch, record, hand, _log_hand(branch, hand))
    for number, part in enumerate(object_parts(record.cube_size, record.object_shape)):
        branch.log(f"cube/part{number}", _drawn(part))
    _log_trail(branch, record)
    _log_contacts(branch, record)
    _log_task(branch, record)
    _log_joints(branch, record)
    if record.policy:
        _log_policy(branch, record, hand)
    branch.log("episode", rr.TextDocument(summary or f"ended: {record.ending}", media_type="text/markdown"))


def _log_hand(branch: Branch, hand: Hand) -> UrdfTree:
    prefix = branch.root.replace("/", "_")
    tree = log_robot(branch.stream, hand.urdf(), branch.hand.root.rstrip("/"), prefix or None)
    root = rr.Transform3D(
        translation=hand.position,
        quaternion=rr.Quaternion(xyzw=Rotation.from_matrix(hand.rotation).as_quat()),
        parent_frame="tf#/",
        child_frame=prefix + tree.root_link().name,
    )
    branch.hand.always("pose", root)
    return tree


def _log_motion(branch: Branch, record: EpisodeRecord, hand: Hand, tree: UrdfTree) -> None:
    """Write joints (a coupled one with the angle of its neighbour) and object at about 50 Hz; 10 Hz without a trace."""
    time, q, position, quaternion = record.time, record.joint_position, record.cube_position, record.cube_quaternion
    if record.trace:
        time = record.trace["time"]
        stride = max(1, round(1.0 / (POSE_RATE * float(time[1] - time[0]))))
        names = ("time", "q", "cube_position", "cube_quaternion")
        time, q, position, quaternion = (record.trace[name][::stride] for name in names)
    columns = {name: index for index, name in enumerate(hand.joint_names)}
    for joint in tree.joints():
        actuated = hand.followed(joint.name)
        if actuated in columns:
            transform = joint.compute_transform_columns(q[:, columns[actuated]].tolist(), clamp=False)
            branch.hand.columns(f"joint_transforms/{joint.name}", time, transform)
    branch.columns("cube", time, rr.Transform3D.columns(translation=position, quaternion=quaternion))


def _drawn(part: Part) -> rr.Boxes3D | rr.Cylinders3D | rr.Ellipsoids3D | rr.Mesh3D:
    colour, half = [round(255 * share) for share in part.colour], part.size / 2
    if part.kind == "mesh":
        count = 3 * len(part.size)
        triangles = np.arange(count).reshape(-1, 3)
        return rr.Mesh3D(
            vertex_positions=part.size.reshape(-1, 3), triangle_indices=triangles, vertex_colors=[colour] * count
        )
    if part.kind == "box":
        return rr.Boxes3D(centers=[part.centre], half_sizes=[half], colors=[colour], fill_mode="solid")
    if part.kind == "sphere":
        return rr.Ellipsoids3D(centers=[part.centre], half_sizes=[half], colors=[colour], fill_mode="solid")
    return rr.Cylinders3D(lengths=[part.size[2]], radii=[half[0]], colors=[colour], fill_mode="solid")


def _log_trail(branch: Branch, record: EpisodeRecord) -> None:
    """Write the way of one upper corner of the cube: its turning about the vertical and its creeping in one line."""
    corners = record.cube_position + Rotation.from_quat(record.cube_quaternion).apply(0.5 * record.cube_size)
    for sample, time in enumerate(record.time.tolist()):
        way = corners[max(0, sample - TRAIL) : sample + 1]
        branch.log("trail", rr.LineStrips3D([way], colors=[(225, 180, 0)], radii=0.0008), time)


def _log_contacts(branch: Branch, record: EpisodeRecord) -> None:
    """Write the contact forces on the cube as arrows, all fingers in their colour, at the policy's rate."""
    table = record.contacts
    for sample, time in enumerate(record.time.tolist()):
        rows = (table.step == sample) & (table.normal_force > TOUCH_FORCE)
        # The arrow ends where the finger pushes: it stands outside the cube and can be seen.
        vectors = ARROW_LENGTH * table.force[rows]
        arrows = rr.Arrows3D(
            origins=table.position[rows] - vectors,
            vectors=vectors,
            colors=_cycled(FINGER_COLOURS, table.finger[rows].tolist()),
            radii=0.0018,
        )
        branch.log("contacts", arrows, time)


def _log_task(branch: Branch, record: EpisodeRecord) -> None:
    """Write theta, the terms of the reward and the fingers' forces."""
    branch.lines("task/theta", record.time, record.theta, ["theta"])
    forces = np.zeros((record.steps + 1, len(record.fingers)))
    np.add.at(forces, (record.contacts.step, record.contacts.finger), record.contacts.normal_force)
    colours = _cycled(FINGER_COLOURS, range(len(record.fingers)))
    branch.lines("task/force", record.time, forces, list(record.fingers), colours)
    for name, values in record.reward_terms.items():
        if np.any(values):  # terms that are switched off would only fill the legend
            branch.lines(f"task/reward/{name}", record.time[1:], values, [name])
    branch.lines("task/reward/sum", record.time[1:], record.reward, ["sum"])


def _log_joints(branch: Branch, record: EpisodeRecord) -> None:
    """Write the joint signals of each finger at the physics rate, and its targets at the policy's."""
    for index, finger in enumerate(record.fingers):
        mine, entity = record.of_finger(index), f"joints/{finger}"
        for signal, brightness in SIGNALS.items():
            if signal in record.trace:
                colours = [tuple(round(brightness * part) for part in colour) for colour in JOINT_COLOURS]
                values = record.trace[signal][:, mine]
                _joint_lines(branch, f"{entity}/{signal}", record.trace["time"], values, colours)
        _joint_lines(branch, f"{entity}/q_n", record.time[:-1], record.target[:, mine])


def _log_policy(branch: Branch, record: EpisodeRecord, hand: Hand) -> None:
    """Write what the policy got of each finger, q_m and e_q with offset and noise, and what it asked for [rad].

    The action differs from the target q_n where the one before was repeated (sticky actions).
    """
    middle = 0.5 * (hand.action_lower + hand.action_upper)
    asked = middle + 0.5 * (hand.action_upper - hand.action_lower) * record.policy["action"]
    for index, finger in enumerate(record.fingers):
        mine = record.of_finger(index)
        for name, values in (record.policy | {"action": asked}).items():
            _joint_lines(branch, f"policy/{finger}/{name}", record.time[:-1], values[:, mine], JOINT_COLOURS)


def _joint_lines(branch: Branch, entity: str, time: Array, values: Array, colours: Colours | None = None) -> None:
    """Log a signal (n, joints) of one finger as lines."""
    joints, signal = range(values.shape[1]), entity.rpartition("/")[2]
    painted = None if colours is None else _cycled(colours, joints)
    branch.lines(entity, time, values, [f"{signal}, joint {joint + 1}" for joint in joints], painted)


def _cycled(colours: Colours, places: Sequence[int]) -> Colours:
    """Repeat the colours where there are more joints or fingers than colours."""
    return [colours[place % len(colours)] for place in places]


MAX_BYTES = 3_000_000
MAX_FRAMES = 200
STRIDE = 2  # policy steps from frame to frame: five frames a second
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
    """Write an animated GIF: the hand from the side and into its palm, at most 3 MB, faster than real time beyond 40 s.

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
    contact, frames = touching(record), []
    across = ABOVE if hand.palm_contact else BELOW
    with closing(Scene(record.cube_size, hand, record.object_shape)) as scene:
        for sample in samples:
            scene.pose(record.joint_position[sample], record.cube_position[sample], record.cube_quaternion[sample])
            frame = Image.new("RGB", (2 * view, view + CAPTION_HEIGHT), "white")
            frame.paste(scene.picture(SIDE, view, view), (0, CAPTION_HEIGHT))
            frame.paste(scene.picture(across, view, view), (view, CAPTION_HEIGHT))
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
