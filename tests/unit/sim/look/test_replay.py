"""The replay of a run: what the page holds, and what a browser shows of it."""

import re
import shutil
from io import BytesIO
from urllib.error import HTTPError
from urllib.request import urlopen

import igl
import numpy as np
import pytest
from PIL import Image

from tests.explored import missed
from tests.pages import held
from touchatlas.atlas import Atlas
from touchatlas.planner import Planner, explore
from touchatlas.sim import Probe, load_run
from touchatlas.sim.look import live
from touchatlas.sim.look.curves import chart
from touchatlas.sim.look.frames import Frames, clustered
from touchatlas.sim.look.replay import run_text
from touchatlas.sim.world.objects import make_object


def test_the_replay_holds_every_touch_and_the_last_surface(whole_run):
    page, run = (whole_run[0] / "replay.html").read_text(), load_run(whole_run[0])
    found = held(page)
    contacts = found["contacts"].reshape(-1, 3) * found["scale"] + found["low"]
    true = np.array([touch.contact for touch in run.touches])
    # Places are rounded to 1 / 65535 of the extent.
    np.testing.assert_allclose(contacts, true, atol=2.0 * found["scale"])
    assert found["touches"] == len(true) == len(found["words"]) - 1 == found["contact_from"][-1]
    last = found["vertices"].reshape(-1, 3)[found["vertex_from"][-2] :]
    points, surface = last * found["scale"] + found["low"], run.surface.vertices
    np.testing.assert_allclose(points.max(axis=0), surface.max(axis=0), atol=2.0 * found["scale"])
    assert found["faces"].max() < np.diff(found["vertex_from"]).max()
    assert len(found["error"]) == len(found["deviation"]) == found["vertex_from"][-1]
    # A ball is one face of one patch.
    assert found["modes"][-1] == "patch" and not found["patch"][-len(last) :].any()


@pytest.mark.parametrize(
    ("name", "touches"), [("bottle", 4), pytest.param("cube", 4, marks=pytest.mark.slow)]
)
def test_a_patch_weighs_most_at_its_own_middle(name, touches):
    obj = make_object(name)
    atlas, planner = Atlas(obj.tolerance), Planner(*obj.start())
    for _ in explore(atlas, planner, Probe(obj, 0.0, np.random.default_rng(0)), touches):
        pass
    trees = atlas.body.field.trees
    faces, pieces = zip(*trees.patches(), strict=True)
    found = trees.patches_at(np.array([piece.origin for piece in pieces]), np.array(faces))
    np.testing.assert_array_equal(found, np.arange(len(atlas)))


def test_the_page_needs_no_other_file(whole_run):
    """Nothing is loaded: no tag and no style names an address. The icon has no bytes."""
    page = (whole_run[0] / "replay.html").read_text()
    assert not re.search(r'<(script|link|img|iframe)[^>]*(src|href)="(?!data:)', page)
    assert "@import" not in page and 1e5 < len(page) < 1e7


def test_fewer_triangles_are_of_the_same_shape():
    obj = make_object("sphere")
    vertices, faces = obj.mesh(0.01 * obj.tolerance)
    kept, fewer = clustered(vertices, faces, 1000)
    # Each vertex is in a triangle: one in none would have no normal.
    assert 250 < len(kept) <= 1000 and set(fewer.ravel()) == set(range(len(kept)))
    # Chords of a ball in cubes of a twentieth of its size: the area lacks some hundredths.
    areas = [igl.doublearea(v, f).sum() for v, f in ((vertices, faces), (vertices[kept], fewer))]
    assert areas[1] == pytest.approx(areas[0], rel=0.05)
    same, faces_again = clustered(vertices, faces[:10], 1000)
    np.testing.assert_array_equal(same[faces_again], faces[:10])


def test_a_curve_leaves_out_what_is_not_known():
    picture = chart("Error", {"true": [0.1, None, 0.001]}, "mm")
    (line,) = re.findall(r'points="([^"]*)"', picture)
    assert len(line.split()) == 2 and "Error (mm)" in picture
    assert chart("Error", {"true": [None]}) == ""


def test_a_touch_that_met_nothing_is_no_contact():
    obj, frames, atlas = make_object("sphere"), Frames(), Atlas(0.1)
    planner = Planner(*obj.start())
    for step in explore(atlas, planner, missed, 1):
        frames.add(step, planner, atlas, 1.0)
    found = held(f'id="run">{run_text("none", frames.so_far(), 0.1, "", None)}<')
    assert found["contact_from"].tolist() == [0, 0] and len(found["contacts"]) == 0


def test_a_run_is_served_while_it_goes_on(monkeypatch):
    opened: list[str] = []
    monkeypatch.setattr(live.webbrowser, "open", opened.append)
    obj, frames = make_object("sphere"), Frames()
    planner, atlas = Planner(*obj.start()), Atlas(obj.tolerance)
    probe = Probe(obj, obj.noise_std, np.random.default_rng(0))
    address = live.follow(frames, obj, 50.0 * obj.tolerance)
    assert opened == [address] and address.startswith("http://127.0.0.1:")
    for step in explore(atlas, planner, probe, 2):
        frames.add(step, planner, atlas, 1.0)
        with urlopen(f"{address}run") as answer:
            assert held(f'id="run">{answer.read().decode()}<')["touches"] == step.plan.number + 1
    with pytest.raises(HTTPError):
        urlopen(f"{address}secret")


def is_drawn(page) -> bool:
    """Whether the scene has many colours: a picture without a screen may come out empty."""
    page.wait_for_timeout(500)
    image = Image.open(BytesIO(page.locator("#scene").screenshot(timeout=60_000)))
    return len(image.convert("RGB").getcolors(1 << 24)) > 200


@pytest.mark.slow
def test_a_browser_without_a_network_shows_each_touch_by_keys(whole_run):
    sync = pytest.importorskip("playwright.sync_api")
    browser = next(filter(None, map(shutil.which, ("chromium", "google-chrome"))), None)
    if browser is None:
        pytest.skip("there is no Chromium here")
    words = ("--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--ignore-gpu-blocklist")
    with sync.sync_playwright() as play:
        window = play.chromium.launch(executable_path=browser, args=[*words])
        page = window.new_context(offline=True).new_page()
        said: list[str] = []
        page.on("console", lambda line: said.append(line.text) if line.type == "error" else None)
        page.on("pageerror", lambda error: said.append(str(error)))
        page.goto((whole_run[0] / "replay.html").resolve().as_uri())
        page.wait_for_function("document.body.dataset.ready == '1'", timeout=60_000)
        last = page.evaluate("document.body.dataset.shown")
        assert int(last) == len(load_run(whole_run[0]).touches)
        for key, shown in (("Home", "0"), ("ArrowRight", "1"), ("End", last)):
            page.keyboard.press(key)
            page.wait_for_function(f"document.body.dataset.shown == '{shown}'", timeout=60_000)
            assert any(is_drawn(page) for _ in range(5)), shown
        assert said == []
        window.close()
