"""Bags of ROS 1 and ROS 2 as recordings, by rosbags (extra ``bags``), without ROS.

Poses and wrenches are joined by the stamps in their headers: the times at which a bag logged them
differ by what the network took. A force in the frame of the tool is turned by the pose.
"""

from pathlib import Path
from typing import Any

import numpy as np

from touchatlas.atlas.files import check_path
from touchatlas.patch.words import count_of
from touchatlas.planner.drivers.recording import Recording, joined, turned

_POSES = {
    "geometry_msgs/msg/PoseStamped": lambda m: m.pose,
    "geometry_msgs/msg/PoseWithCovarianceStamped": lambda m: m.pose.pose,
    "geometry_msgs/msg/TransformStamped": lambda m: m.transform,
    "nav_msgs/msg/Odometry": lambda m: m.pose.pose,
}
_WRENCH = "geometry_msgs/msg/WrenchStamped"
_SUFFIXES = (".mcap", ".db3", ".bag")


def is_bag(path) -> bool:
    """Whether a path is a bag: a file of one, or a folder with one."""
    path = Path(path)
    if path.is_dir():
        return any(child.suffix in _SUFFIXES for child in path.iterdir())
    return path.suffix in _SUFFIXES


def read_bag(path, pose: str = "", wrench: str = "", tool=(0.0, 0.0, 0.0)) -> Recording:
    """Time, position and force of a bag.

    Parameters
    ----------
    path : path-like
        A folder with its metadata, or a lone .mcap, .db3 or .bag file.
    pose, wrench : str
        Topics; the only ones of their kind by default.
    tool : (3,) float, m
        Centre of the tip in the frame of the poses.

    Raises
    ------
    ValueError
        In one sentence: no bag, rosbags missing, a bag that is cut off, topics that are not there
        or several, or nothing that can be joined.
    """
    check_path(path, "the path of a bag")
    path = Path(path)
    if not path.exists() or not is_bag(path):
        raise ValueError(f"{path} is no bag; give its folder, or its .mcap, .db3 or .bag file")
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise ValueError(
            f"{path} is a bag, which needs rosbags: pip install 'touchatlas[bags]'"
        ) from None
    # Definitions of messages that a bag does not hold; those of poses have not changed since.
    known = get_typestore(Stores.ROS2_HUMBLE if path.suffix != ".bag" else Stores.ROS1_NOETIC)
    source = _readable(path)
    try:
        with AnyReader([source], default_typestore=known) as reader:
            poses = _of_topic(reader, path, pose, tuple(_POSES), "poses")
            wrenches = _of_topic(reader, path, wrench, (_WRENCH,), "wrenches")
            at, places, frames = _rows(reader, poses, _pose_of)
            force_at, forces, force_frames = _rows(reader, wrenches, _force_of)
    except Exception as error:
        # Ours, or whatever a reader of damaged bytes comes upon.
        if type(error) is ValueError:
            raise
        raise ValueError(
            f"{path} cannot be read as a bag ({str(error) or repr(error)}); if it was cut off, "
            "write it again with ros2 bag convert, or mcap recover"
        ) from None
    for name, count in ((poses[0].topic, len(at)), (wrenches[0].topic, len(force_at))):
        if count < 2:
            raise ValueError(f"{path} has {count} messages of {name}; two or more are needed")
    # Seconds since 1970 would leave 0.2 microseconds of a double.
    first = min(at[0], force_at[0])
    at, force_at = 1e-9 * (at - first), 1e-9 * (force_at - first)
    kept, forces, lost = joined(at, places, force_at, forces)
    if len(kept) < 2:
        raise ValueError(
            f"the stamps of {poses[0].topic} and {wrenches[0].topic} in {path} do not overlap; see "
            "that both have the same clock"
        )
    at, places = at[kept], places[kept]
    said = [f"{count_of(len(kept), 'pose')} of {poses[0].topic} with forces of {wrenches[0].topic}"]
    if lost:
        said.append(f"{count_of(lost, 'pose')} without a force within three periods, not used")
    if frames != force_frames:
        forces = turned(forces, places[:, 3:])
        said.append(f"forces in {_one(force_frames)} were turned by the poses in {_one(frames)}")
    tips = places[:, :3] + turned(np.tile(np.asarray(tool, float), (len(at), 1)), places[:, 3:])
    return Recording(at, tips, forces, "m", tuple(said))


def _readable(path: Path) -> Path:
    """The folder, where it has its metadata, or the only file of a bag in it."""
    if path.is_dir() and not (path / "metadata.yaml").is_file():
        files = sorted(child for child in path.iterdir() if child.suffix in _SUFFIXES)
        if len(files) > 1:
            raise ValueError(
                f"{path} has no metadata.yaml and {len(files)} files; give one of them, or write "
                "the metadata with ros2 bag reindex"
            )
        return files[0]
    return path


def _of_topic(reader, path: Path, topic: str, kinds: tuple[str, ...], what: str) -> list[Any]:
    """The connections of a topic, or of the only one of some kinds of messages."""
    found = [c for c in reader.connections if c.msgtype in kinds and topic in ("", c.topic)]
    topics = sorted({c.topic for c in found})
    if len(topics) == 1:
        return found
    all_topics = ", ".join(sorted(f"{c.topic} ({c.msgtype})" for c in reader.connections)) or "none"
    if topics:
        raise ValueError(f"{path} has {what} in {', '.join(topics)}; say which topic")
    wanted = f"topic {topic} with {what}" if topic else f"topic with {what}"
    raise ValueError(f"{path} has no {wanted}; its topics are {all_topics}")


def _rows(reader, connections, row_of) -> tuple[np.ndarray, np.ndarray, frozenset[str]]:
    """Header stamps (n,) in ns, rows (n, d) in their order, each stamp once, and the frames."""
    stamps, rows, frames = [], [], set()
    for connection, _, data in reader.messages(connections):
        message = reader.deserialize(data, connection.msgtype)
        stamp = message.header.stamp
        stamps.append(stamp.sec * 1_000_000_000 + stamp.nanosec)
        rows.append(row_of(message, connection.msgtype))
        frames.add(message.header.frame_id)
    order = np.unique(np.array(stamps), return_index=True)[1]
    return np.array(stamps)[order], np.array(rows, float)[order], frozenset(frames)


def _pose_of(message, kind: str) -> list[float]:
    """Position and quaternion of a message."""
    pose = _POSES[kind](message)
    p = pose.translation if hasattr(pose, "translation") else pose.position
    q = pose.rotation if hasattr(pose, "rotation") else pose.orientation
    return [p.x, p.y, p.z, q.x, q.y, q.z, q.w]


def _force_of(message, _kind: str) -> list[float]:
    force = message.wrench.force
    return [force.x, force.y, force.z]


def _one(frames) -> str:
    return ", ".join(sorted(frames)) or "no frame"
