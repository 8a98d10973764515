"""Saved atlases: what comes back, and which files are refused."""

import io
import zipfile

import numpy as np
import pytest

from tests.explored import explored, learned, spread_touches
from tests.sharp import explored_sharp
from touchatlas.atlas import Atlas, AtlasOptions, Levels, load_atlas, save_atlas
from touchatlas.atlas.samples.lost_ends import LostEnds
from touchatlas.sim.study.bodies import cup


@pytest.fixture(scope="module")
def ball():
    return explored("sphere").atlas


KINDS = {
    "one law": lambda: explored("sphere").atlas,
    "smooth": lambda: explored("bottle").atlas,
    "begun": lambda: learned(explored("bottle").touches[:5], 0.1),
    "with edges": lambda: explored_sharp("block").atlas,
    "with rims": lambda: learned(spread_touches(cup(0.5), 8, 0.02), 0.1),
    "empty": lambda: Atlas(0.1),
}
POINTS = np.random.default_rng(0).uniform(-40.0, 40.0, (2000, 3))


@pytest.mark.parametrize("kind", KINDS)
def test_saved_atlas_comes_back_whole(kind, tmp_path):
    """It answers the same, number by number, and is saved as the same bytes."""
    atlas = KINDS[kind]()
    save_atlas(tmp_path / "atlas.npz", atlas)
    again = load_atlas(tmp_path / "atlas.npz")
    points = np.concatenate([POINTS, atlas.pool.points + 0.1 * atlas.pool.normals])
    found, found_again = atlas.blend(points), again.blend(points)
    assert found.known.any() == (kind != "empty")
    for name, then in vars(found).items():
        assert np.array_equal(getattr(found_again, name), then, equal_nan=True), name
    for name in LostEnds.NAMES:
        assert np.array_equal(getattr(again.rims.ends, name), getattr(atlas.rims.ends, name))
    assert len(again) == len(atlas) and again.touches == atlas.touches
    assert len(again.rims.ends) == 0 or kind == "with rims"
    again.validate()
    save_atlas(tmp_path / "again.npz", again)
    assert (tmp_path / "again.npz").read_bytes() == (tmp_path / "atlas.npz").read_bytes()


WHOLE = {"bottle": lambda: explored("bottle"), "block": lambda: explored_sharp("block")}


@pytest.mark.parametrize(
    ("name", "before"),
    [
        ("bottle", 1),
        ("block", 4),
        pytest.param("bottle", 4, marks=pytest.mark.slow),
        pytest.param("block", 1, marks=pytest.mark.slow),
    ],
)
def test_loaded_atlas_goes_on_learning(name, before, tmp_path):
    """Three more touches give the same bytes, whether it was saved and loaded between or not."""
    touches = WHOLE[name]().touches
    atlas = learned(touches[:before], 0.1)
    save_atlas(tmp_path / "half.npz", atlas)
    again = load_atlas(tmp_path / "half.npz")
    for touch in touches[before : before + 3]:
        one, other = again.add(touch), atlas.add(touch)
        assert one == other and np.array_equal(one.innovations, other.innovations)
    save_atlas(tmp_path / "atlas.npz", atlas)
    save_atlas(tmp_path / "again.npz", again)
    assert (tmp_path / "again.npz").read_bytes() == (tmp_path / "atlas.npz").read_bytes()


def test_the_options_of_an_atlas_are_saved(tmp_path):
    atlas = Atlas(0.3, AtlasOptions(bias=0.1, facets=0.5, levels=Levels(sure=3.0)), scale=0.2)
    save_atlas(tmp_path / "atlas.npz", atlas)
    again = load_atlas(tmp_path / "atlas.npz")
    assert (again.tolerance, again.scale, again.options) == (0.3, 0.2, atlas.options)


def test_an_open_bracket_in_a_header_is_damage(ball, tmp_path):
    """An array says its shape in a line of Python, which numpy reads by Python's own tokenizer."""
    save_atlas(tmp_path / "a.npz", ball)
    with np.load(tmp_path / "a.npz") as file:
        arrays = {name: file[name] for name in file.files}
    with zipfile.ZipFile(tmp_path / "bad.npz", "w") as out:
        for name, array in arrays.items():
            buffer = io.BytesIO()
            np.save(buffer, array)
            data = buffer.getvalue()
            out.writestr(f"{name}.npy", data.replace(b"), }", b"(, }", 1))
    with pytest.raises(ValueError, match="no whole atlas file"):
        load_atlas(tmp_path / "bad.npz")


def test_a_file_with_one_other_byte_is_refused(ball, tmp_path):
    path = tmp_path / "atlas.npz"
    save_atlas(path, ball)
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0xFF
    path.write_bytes(bytes(data))
    with pytest.raises(ValueError, match="cut off or altered"):
        load_atlas(path)


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        ("smooth", "header"),
        ("smooth", "sample_points"),
        ("with rims", "rims_steps"),
        ("with edges", "label_of"),
    ],
)
def test_file_with_other_arrays_is_refused(tmp_path, kind, name):
    """Arrays that are not there, or of another length."""
    path = tmp_path / "atlas.npz"
    save_atlas(path, KINDS[kind]())
    with np.load(path) as file:
        arrays = {key: file[key] for key in file.files}
    assert len(arrays[name])
    for wrong in ({}, {name: arrays[name][:-1]}):
        with open(path, "wb") as file:
            np.savez(file, **({k: v for k, v in arrays.items() if k != name} | wrong))
        with pytest.raises(ValueError, match="cut off or altered"):
            load_atlas(path)


@pytest.mark.parametrize(
    ("name", "column"),
    [
        ("rims_points", np.zeros((0, 2))),
        ("rims_steps", np.zeros((0, 3))),
        ("rims_normals", np.zeros((0, 3), int)),
        ("ways", np.zeros((1, 3))),
        ("ways", np.zeros((1, 2, 3), int)),
    ],
)
def test_a_file_with_columns_of_another_shape_or_type_is_refused(ball, tmp_path, name, column):
    path = tmp_path / "atlas.npz"
    save_atlas(path, ball)
    with np.load(path) as file:
        arrays = {key: file[key] for key in file.files}
    assert name in arrays
    np.savez(path, **(arrays | {name: column}))
    with pytest.raises(ValueError, match="another shape or type"):
        load_atlas(path)


def test_only_files_are_replaced(ball, tmp_path):
    with pytest.raises(OSError, match="give the path of a file"):
        save_atlas(tmp_path, ball)


@pytest.mark.parametrize("failure", [OSError(28, "No space left on device"), KeyboardInterrupt()])
def test_failed_write_leaves_the_old_file(ball, tmp_path, monkeypatch, failure):
    path = tmp_path / "atlas.npz"
    save_atlas(path, ball)
    before = path.read_bytes()

    def full(descriptor):
        raise failure

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(type(failure)):
        save_atlas(path, Atlas(0.1))
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["atlas.npz"]


def test_swapped_arguments_and_other_types_are_refused(ball, tmp_path):
    with pytest.raises(ValueError, match=r"got str for the atlas; call save_atlas\(path, atlas\)"):
        save_atlas(ball, str(tmp_path / "a.npz"))
    for path in (5, None, b"a", []):
        with pytest.raises(ValueError, match="for the path; give the atlas.npz of a run"):
            load_atlas(path)
        with pytest.raises(ValueError, match="for the path"):
            save_atlas(path, ball)
    assert not list(tmp_path.iterdir())
