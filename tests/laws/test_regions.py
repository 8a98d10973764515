"""Atlases that are learned by regions: the same surface and faces as by one process."""

from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest

from tests.explored import learned, spread_touches
from tests.lawful_meshes import lawful_object
from touchatlas.atlas import Scan, extract_surface, load_atlas, save_atlas
from touchatlas.atlas.regions import Region, joined, learn_region, load_part, regions_of, save_part
from touchatlas.atlas.store import atlas_bytes
from touchatlas.patch.geometry.normal_error import SURE
from touchatlas.planner import ProbePlan, Reason
from touchatlas.sim import make_object
from touchatlas.sim.folder.journal import Journal
from touchatlas.sim.study.regions import learn_by_regions
from touchatlas.sim.study.workers import WorkOptions

HERE = WorkOptions(workers=0)


COUNT, MOST = 8, 4
TOLERANCE = make_object("bottle").tolerance


@pytest.fixture(scope="module")
def touches():
    return spread_touches(make_object("bottle"), COUNT)


@pytest.fixture(scope="module")
def parts(touches):
    return parts_of(touches)


def parts_of(touches):
    found = [learn_region(touches, region, TOLERANCE) for region in regions_of(touches, MOST)]
    assert not any(refused for _, refused in found)
    return [part for part, _ in found]


@pytest.fixture(scope="module")
def atlas(parts):
    return joined(parts)


def test_each_touch_is_of_one_region_and_those_around_are_near(touches):
    contacts = np.array([touch.contact for touch in touches])
    for most in (1, 5, COUNT):
        regions = regions_of(touches, most, 10.0)
        own = np.concatenate([region.own for region in regions])
        assert sorted(own.tolist()) == list(range(COUNT))
        assert max(len(region.own) for region in regions) <= most
        for region in regions:
            assert not np.isin(region.around, region.own).any()
            own = contacts[region.own]
            near = (contacts >= own.min(axis=0) - 10.0) & (contacts <= own.max(axis=0) + 10.0)
            learned_there = np.union1d(region.own, region.around)
            assert np.array_equal(np.flatnonzero(near.all(axis=1)), learned_there)


def test_a_region_of_all_touches_is_the_atlas_of_them():
    touches = spread_touches(make_object("sphere"), 8)
    part, _ = learn_region(touches, Region(np.arange(8), np.zeros(0, int)), TOLERANCE)
    one, other = learned(touches, TOLERANCE), joined([part])
    assert np.array_equal(one.pool.points, other.pool.points)
    assert np.array_equal(one.pool.normals, other.pool.normals)
    found = one.body.at(one.pool.points)[0], other.body.at(one.pool.points)[0]
    assert np.array_equal(found[0].distance, found[1].distance)


def test_regions_of_a_smooth_body_have_no_seam(touches, atlas):
    """Errors of both are those of the samples' noise, which the deviations state: 95 % of the
    distances lie within 1.96 of them."""
    atlas.validate()
    one = learned(touches, TOLERANCE)
    assert atlas.touches == one.touches and atlas.point_count == one.point_count
    assert len(atlas.body.faces) == len(one.body.faces) == 1
    surface = extract_surface(atlas)
    found = one.blend(surface.vertices)
    both = np.hypot(found.deviation, surface.deviation)
    assert found.known.mean() > 0.95
    assert (np.abs(found.distance) <= SURE * both)[found.known].mean() >= 0.95


def test_parts_from_files_give_the_same_bytes_and_learn_on(touches, parts, atlas, tmp_path):
    for number in reversed(range(len(parts))):
        save_part(tmp_path / f"{number}.npz", parts[number])
    again = joined([load_part(tmp_path / f"{number}.npz") for number in range(len(parts))])
    assert atlas_bytes(again) == atlas_bytes(atlas)
    save_atlas(tmp_path / "atlas.npz", again)
    assert atlas_bytes(load_atlas(tmp_path / "atlas.npz")) == atlas_bytes(atlas)
    more = spread_touches(make_object("bottle"), 5, seed=1)[-1]
    assert not again.add(replace(more, number=COUNT)).refused
    assert again.touches == COUNT + 1 and again.point_count > atlas.point_count


def test_no_sample_in_any_region_is_refused(touches):
    region = Region(np.zeros(0, int), np.zeros(0, int))
    with pytest.raises(ValueError, match="no region has a sample"):
        joined([learn_region(touches, region, 0.1)[0]])
    with pytest.raises(ValueError, match="most is 0"):
        regions_of(touches, 0)
    with pytest.raises(ValueError, match="overlap is -1"):
        regions_of(touches, 1, -1)


def kept(touches, path):
    """A journal of touches."""
    with closing(Journal(path)) as journal:
        for touch in touches:
            own = touch.number, touch.contact, touch.approach
            planes = tuple(contour.plane for contour in touch.contours)
            journal.append(ProbePlan(*own, planes, 1.0, 0.1, np.pi, Reason.START), touch)
    return path


def test_a_journal_is_learned_by_regions_once(tmp_path):
    touches = spread_touches(make_object("sphere"), 8)
    expected = atlas_bytes(joined(parts_of(touches)))
    journal, counts = kept(touches, tmp_path / "journal.sqlite"), []
    arguments = journal, tmp_path / "regions", TOLERANCE, MOST
    for _ in range(2):
        found = learn_by_regions(*arguments, work=HERE, watch=lambda *now: counts.append(now))
        assert atlas_bytes(found) == expected
    assert counts == [(0, 2), (1, 2), (2, 2), (2, 2)]
    (tmp_path / "regions" / "region-1.npz").unlink()
    again = learn_by_regions(*arguments, work=HERE, watch=lambda *now: counts.append(now))
    assert atlas_bytes(again) == expected and counts[4:] == [(1, 2), (2, 2)]


def test_a_folder_holds_the_regions_of_the_last_cut_alone(tmp_path):
    """Files of two cuts have the same names: each cut is learned anew, and finds what the other
    order of cuts finds."""
    touches = spread_touches(make_object("sphere"), 8)
    journal, found = kept(touches, tmp_path / "journal.sqlite"), {}
    for most, count in ((4, 2), (8, 1), (4, 2), (2, 4)):
        atlas = learn_by_regions(journal, tmp_path / "regions", TOLERANCE, most, work=HERE)
        assert atlas_bytes(atlas) == found.setdefault(most, atlas_bytes(atlas))
        files = {path.name for path in (tmp_path / "regions").glob("region-*.npz")}
        assert files == {f"region-{number}.npz" for number in range(count)}
        rows = (tmp_path / "regions" / "regions.csv").read_text().splitlines()
        assert {row.split(",")[1] for row in rows[1:]} == files


def test_what_has_no_regions_is_refused(touches, tmp_path):
    with pytest.raises(ValueError, match=r"none.sqlite is no file"):
        learn_by_regions(tmp_path / "none.sqlite", tmp_path / "out", 0.1, work=HERE)
    journal = kept(touches[:1], tmp_path / "journal.sqlite")
    with closing(Journal(journal)) as file:
        file.append_scan(Scan(touches[0].contours[0].points, 0.1, outside=[0.0, 0.0, 900.0]))
    with pytest.raises(ValueError, match="has scans, which have no regions"):
        learn_by_regions(journal, tmp_path / "out", 0.1, work=HERE)


@pytest.mark.slow
def test_two_workers_find_the_faces_that_one_process_finds(tmp_path):
    """A step has eight planes, four of which pass the cuts between regions."""
    touches = spread_touches(lawful_object("step"), 40)
    journal = kept(touches, tmp_path / "journal.sqlite")
    one = learned(touches, lawful_object("step").tolerance)
    found = []
    for workers in (0, 2):
        work = WorkOptions(workers=workers)
        arguments = journal, tmp_path / str(workers), lawful_object("step").tolerance, 20
        found.append(learn_by_regions(*arguments, work=work))
    assert atlas_bytes(found[0]) == atlas_bytes(found[1])
    kinds = [[face.kind for face in some.faces().faces] for some in (one, found[0])]
    assert kinds == [["plane"] * 8] * 2
