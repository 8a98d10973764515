"""Bags of ROS 2 as recordings: bags that rosbags writes, read back through the reader of ours."""

import shutil
import sqlite3

import numpy as np
import pytest

from touchatlas.planner.drivers.bags import is_bag, read_bag
from touchatlas.planner.drivers.probe_file import read_tip
from touchatlas.planner.drivers.recording import Recording, joined, turned

pytest.importorskip("rosbags", reason="rosbags is not installed")

RATE, TURN = 100.0, np.radians(30.0)
# Stamps of a clock, and how much later the bag logged a message: the network's time.
EPOCH = 1_700_000_000


def tip(t):
    """Where the tip is, in m, at times (n,)."""
    return np.stack([0.4 + 0.01 * t, 0.02 * np.sin(t), 0.1 + 0.0 * t], axis=1)


def force(t):
    """The force by the surface in the frame of the base, linear in time."""
    return np.stack([0.1 * t, 0.2 + 0.0 * t, 1.0 - 0.05 * t], axis=1)


def write_bag(path, plugin="MCAP", frame="base", cut=(), second=False):
    """A bag with poses at 100 Hz and wrenches at 500 Hz with a clock of their own; the tool is
    turned by 30 degrees about z."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    kinds = {name.rsplit("/", 1)[1]: kind for name, kind in store.types.items()}

    def header(t, frame_id):
        nanoseconds = round(t * 1e9)
        stamp = kinds["Time"](
            sec=EPOCH + nanoseconds // 1_000_000_000, nanosec=nanoseconds % 1_000_000_000
        )
        return kinds["Header"](stamp=stamp, frame_id=frame_id)

    c, s = np.cos(TURN), np.sin(TURN)
    quaternion = kinds["Quaternion"](x=0.0, y=0.0, z=np.sin(TURN / 2), w=np.cos(TURN / 2))
    vector, zero = kinds["Vector3"], kinds["Vector3"](x=0.0, y=0.0, z=0.0)
    rows = []
    for t in np.arange(0.0, 2.0, 1 / RATE):
        x, y, z = tip(np.array([t]))[0]
        pose = kinds["Pose"](position=kinds["Point"](x=x, y=y, z=z), orientation=quaternion)
        rows.append((t + 0.030, "/pose", kinds["PoseStamped"](header=header(t, "base"), pose=pose)))
    for t in np.arange(0.0003, 2.0, 0.2 / RATE):
        if cut and cut[0] < t < cut[1]:
            continue
        x, y, z = force(np.array([t]))[0]
        if frame != "base":
            x, y = c * x + s * y, c * y - s * x
        wrench = kinds["Wrench"](force=vector(x=x, y=y, z=z), torque=zero)
        message = kinds["WrenchStamped"](header=header(t, frame), wrench=wrench)
        rows.append((t + 0.002, "/wrench", message))
        if second:
            rows.append((t + 0.002, "/other", message))
    with Writer(path, version=9, storage_plugin=StoragePlugin[plugin]) as writer:
        topics = {
            topic: writer.add_connection(topic, f"geometry_msgs/msg/{kind}", typestore=store)
            for topic, kind in (
                ("/pose", "PoseStamped"),
                ("/wrench", "WrenchStamped"),
                *([("/other", "WrenchStamped")] if second else []),
            )
        }
        for t, topic, message in sorted(rows, key=lambda row: row[0]):
            data = store.serialize_cdr(message, topics[topic].msgtype)
            writer.write(topics[topic], round((EPOCH + t) * 1e9), data)
    return path


@pytest.fixture(scope="module")
def bags(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bags")
    write_bag(folder / "mcap")
    write_bag(folder / "sqlite", "SQLITE3", frame="tool")
    write_bag(folder / "gap", cut=(0.5, 1.5))
    write_bag(folder / "two", second=True)
    return folder


def only(folder):
    return next(path for path in folder.iterdir() if path.suffix in (".mcap", ".db3"))


def assert_joined(found: Recording, count=200):
    """Interpolation between wrenches is exact, because the force is linear in time."""
    t = found.times
    assert abs(len(t) - count) <= 2
    np.testing.assert_allclose(found.positions, tip(t), atol=1e-7)
    np.testing.assert_allclose(found.forces, force(t), atol=1e-6)
    assert found.unit == "m"


def test_poses_and_wrenches_are_joined_by_their_headers(bags):
    """Joined by the times at which the bag logged them, forces would be off by 28 ms: 0.003 N."""
    found = read_bag(bags / "mcap")
    assert_joined(found)
    assert "turned" not in " ".join(found.said)


def test_forces_in_the_frame_of_the_tool_are_turned(bags):
    found = read_bag(bags / "sqlite")
    assert_joined(found)
    assert "forces in tool were turned by the poses in base" in found.said


def test_a_lone_file_and_a_folder_without_metadata_are_read(bags, tmp_path):
    for name in ("mcap", "sqlite"):
        lone = tmp_path / name
        lone.mkdir()
        shutil.copy(only(bags / name), lone)
        assert_joined(read_bag(lone))
        assert_joined(read_bag(only(lone)))
        assert is_bag(lone)
    assert not is_bag(tmp_path)


def test_a_sqlite_bag_without_definitions_is_read(bags, tmp_path):
    """Bags of older versions hold the names of their messages, and no definitions."""
    lone = tmp_path / "old.db3"
    shutil.copy(only(bags / "sqlite"), lone)
    with sqlite3.connect(lone) as database:
        database.execute("delete from message_definitions")
        database.execute("update topics set type_description_hash = ''")
    database.close()
    assert_joined(read_bag(lone))


def test_the_centre_of_the_tip_is_that_of_the_tool(bags):
    """A tool of 0.1 m along x of a frame that is turned by 30 degrees."""
    found, plain = read_bag(bags / "mcap", tool=[0.1, 0.0, 0.0]), read_bag(bags / "mcap")
    expected = 0.1 * np.array([np.cos(TURN), np.sin(TURN), 0.0])
    np.testing.assert_allclose(found.positions - plain.positions, [expected] * len(plain.times))


def test_poses_in_a_gap_of_forces_are_left_out_and_counted(bags):
    found = read_bag(bags / "gap")
    assert not ((found.times > 0.51) & (found.times < 1.49)).any()
    assert abs(len(found.times) - 100) < 5
    assert any("without a force within three periods" in words for words in found.said)


def test_what_is_no_whole_bag_is_refused_in_a_sentence(bags, tmp_path):
    whole = only(bags / "mcap").read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole[: len(whole) * 3 // 4])
    for path, arguments, words in (
        (cut, {}, "cannot be read as a bag .*mcap recover"),
        (tmp_path / "none", {}, "is no bag"),
        (bags / "two", {}, "wrenches in /other, /wrench; say which topic"),
        (bags / "two", {"wrench": "/force"}, "no topic /force with wrenches; its topics are"),
    ):
        with pytest.raises(ValueError, match=words):
            read_bag(path, **arguments)
    assert_joined(read_bag(bags / "two", wrench="/wrench"))


def test_a_recording_needs_rising_times_and_as_many_of_each():
    rows = np.zeros((3, 3))
    with pytest.raises(ValueError, match="must rise"):
        Recording(np.array([0.0, 1.0, 1.0]), rows, rows)
    with pytest.raises(ValueError, match="2 forces and 3 times"):
        Recording(np.arange(3.0), rows, rows[:2])


def test_joined_forces_are_those_of_a_linear_law():
    rng = np.random.default_rng(0)
    force_at, pose_at = np.sort(rng.uniform(0, 10, 2000)), np.sort(rng.uniform(1, 9, 100))
    kept, forces, lost = joined(pose_at, np.zeros((100, 3)), force_at, force(force_at))
    assert len(kept) + lost == 100
    np.testing.assert_allclose(forces, force(pose_at[kept]), atol=1e-12)


def test_an_orientation_that_nobody_set_turns_nothing():
    """It has no length; one of any other length is scaled."""
    vectors, orientations = np.eye(3)[:2], np.array([[0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 3.0, 3.0]])
    assert np.allclose(turned(vectors[1:], orientations[1:]), [[-1.0, 0.0, 0.0]])
    with pytest.raises(ValueError, match="1 of 2 orientations are no quaternions"):
        turned(vectors, orientations)


@pytest.mark.parametrize("plugin", ["MCAP", "SQLITE3"])
def test_a_damaged_bag_is_read_or_refused_in_one_sentence(tmp_path, plugin):
    """20 bytes are changed anywhere, or 200 are zero, as of a disk that fails."""
    file, rng = only(write_bag(tmp_path / "bag", plugin)), np.random.default_rng(0)
    whole, lone = np.frombuffer(file.read_bytes(), np.uint8), tmp_path / f"lone{file.suffix}"
    refused = 0
    for number in range(24):
        data = whole.copy()
        if number % 2:
            data[rng.integers(0, len(data), 20)] = rng.integers(0, 256, 20)
        else:
            data[rng.integers(0, len(data) - 200) :][:200] = 0
        lone.write_bytes(data.tobytes())
        try:
            read_bag(lone)
        except ValueError as error:
            assert str(error).startswith(("the stamps of", f"{lone} "))
            refused += 1
    assert refused >= 8


def test_what_is_no_path_is_told():
    for read, what in ((read_bag, "a bag"), (read_tip, "a probe.toml")):
        with pytest.raises(ValueError, match=f"got NoneType for the path; give the path of {what}"):
            read(None)


def test_a_topic_without_a_message_is_told(tmp_path):
    with pytest.raises(ValueError, match="has 0 messages of /wrench; two or more are needed"):
        read_bag(write_bag(tmp_path / "bag", cut=(-1.0, 9.0)))
