"""Patches that no longer follow their samples are replaced."""

import copy

import numpy as np
import pytest

from tests.explored import spread_touches
from touchatlas.atlas import Atlas
from touchatlas.atlas.edit.filling_fits import LEAST_SAMPLES, Sites, fits_at, follows
from touchatlas.atlas.edit.renew import replace_misfits
from touchatlas.atlas.edit.replace import are_upright
from touchatlas.atlas.patches.sample_index import SampleIndex
from touchatlas.sim import make_object


@pytest.fixture(scope="module")
def once():
    obj = make_object("ellipsoid")
    found = Atlas(obj.tolerance)
    for touch in spread_touches(obj, 12):
        found.add(touch)
    return found


@pytest.fixture
def atlas(once):
    return copy.deepcopy(once)


def test_patches_of_a_smooth_body_follow_their_samples(atlas):
    rows = atlas.table.rows
    before = atlas.table.mean[rows].copy()
    assert follows(atlas, atlas.table, rows).all()
    replace_misfits(atlas, set(rows.tolist()), rows)
    assert (atlas.table.rows == rows).all() and (atlas.table.mean[rows] == before).all()


def test_a_patch_of_a_touch_that_missed_its_samples_is_smaller(atlas):
    """Its owned samples stay with the one in its place, and a filled one is removed."""
    table = atlas.table
    touched = next(r for r in table.rows.tolist() if not atlas.membership.is_filled(r))
    filled = next(r for r in table.rows.tolist() if atlas.membership.is_filled(r))
    owned = sum(map(len, atlas.membership.owned))
    table.residual[[touched, filled]] = 1.0
    # Unless they were fitted again, another fit would be the same.
    assert not len(replace_misfits(atlas, {touched, filled}, []))
    samples = replace_misfits(atlas, {touched, filled}, [touched, filled])
    assert len(samples) and not table.alive[[touched, filled]].any()
    assert sum(map(len, atlas.membership.owned)) == owned
    atlas.validate()


def test_a_patch_whose_degree_leaves_out_too_much_is_replaced(atlas):
    """Terms above the degree, of a feature as short as a third of the patch, would be larger than
    what is borne."""
    table = atlas.table
    touched = next(r for r in table.rows.tolist() if not atlas.membership.is_filled(r))
    table.length_ratio[touched] = 3.0
    assert not follows(atlas, table, np.array([touched]))[0]
    before = set(table.rows.tolist())
    replace_misfits(atlas, {touched}, [touched])
    new = np.array(sorted(set(table.rows.tolist()) - before))
    assert not table.alive[touched] and len(new) == 1
    assert follows(atlas, table, new).all()


def test_a_patch_is_judged_by_what_its_equations_give(atlas):
    """A fit that is entered follows its samples as it did when it was chosen."""
    table = atlas.table
    some = table.rows[:6]
    fits = fits_at(atlas, Sites(table.origin[some], table.axes[some, 2], some))
    assert all(fit is not None for fit in fits)
    for one in fits:
        assert one is not None and one.columns["count"] == len(one.samples) >= LEAST_SAMPLES
    normals = np.array([one.fit.patch.frame.normal for one in fits if one is not None])
    assert (np.einsum("ij,ij->i", normals, table.axes[some, 2]) > 0.9).all()


def test_where_five_samples_lie_there_is_no_patch(atlas):
    table, pool = atlas.table, atlas.membership.pool
    row = table.rows[:1]
    sites = Sites(table.origin[row], table.axes[row, 2], row)
    assert fits_at(atlas, sites)[0] is not None
    (near,) = atlas.membership.near(sites.points, sites.normals, 2.0 * table.radius[row])
    pool.points[near[5:]] += 9.0 * pool.extent
    atlas.membership._index = SampleIndex()
    assert fits_at(atlas, sites) == [None]


def test_a_patch_that_became_steep_is_replaced_by_an_upright_one(atlas):
    """Its polynomial is tilted by 70 degrees; those of a smooth body stay within 60."""
    table = atlas.table
    touched = next(r for r in table.rows.tolist() if not atlas.membership.is_filled(r))
    assert are_upright(table, table.rows).all()
    slope = table.basis.exponents.tolist().index([1, 0, 0])
    table.mean[touched, slope] += np.tan(np.deg2rad(70.0))
    assert not are_upright(table, np.array([touched]))[0]
    before = set(table.rows.tolist())
    replace_misfits(atlas, {touched}, [])
    assert not table.alive[touched]
    new = np.array(sorted(set(table.rows.tolist()) - before))
    assert len(new) and are_upright(table, new).all()
    atlas.validate()


def test_a_polynomial_that_folds_near_its_core_is_not_upright(atlas):
    """F = z - phi with phi + 6 z^2 falls from z = 1/12 on, so that it has a second zero at 1/6."""
    table, row = atlas.table, atlas.table.rows[:1]
    flat = table.basis.exponents.tolist()
    table.mean[row] = 0.0
    assert are_upright(table, row)[0]
    table.mean[row, flat.index([0, 0, 2])] = 4.0
    assert are_upright(table, row)[0]
    table.mean[row, flat.index([0, 0, 2])] = 6.0
    assert not are_upright(table, row)[0]
    table.mean[row, flat.index([0, 0, 2])] = -6.0
    assert not are_upright(table, row)[0]


def test_uprightness_is_that_of_the_normals_of_the_patch(atlas):
    """The angle by which a patch turns within its core, from its own normals."""
    rows = atlas.table.rows
    cosine = np.array(
        [
            (patch.normal(patch.outline) @ patch.frame.normal).min()
            for patch in map(atlas.patch, rows.tolist())
        ]
    )
    # Four steps of a fixed point give the rim of a core to its slope to the fourth power.
    clear = np.abs(cosine - 0.5) > 0.1
    assert clear.sum() > 20 and (are_upright(atlas.table, rows) == (cosine > 0.5))[clear].all()
