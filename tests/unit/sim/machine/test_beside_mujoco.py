"""The scanning probe beside MuJoCo: the same ball on the same beam, moved along the same way."""

import numpy as np
import pytest
import trimesh

from touchatlas.planner import ProbePlan, Reason
from touchatlas.planner.plans import concurrent_planes
from touchatlas.planner.tracking.track_plan import track_plan
from touchatlas.sim import make_object
from touchatlas.sim.machine.beam_scanner import Beam, BeamScanner
from touchatlas.sim.machine.feet import Feet

mujoco = pytest.importorskip(
    "mujoco", reason="MuJoCo is missing: pip install 'touchatlas[physics]'"
)


def beam(friction: float) -> Beam:
    return Beam(noise_std=0.0, force_std=0.0, friction=friction)


def world(friction: float) -> str:
    """The body and the ball, in metres. A contact of 2 ms is stiff enough for a gap of a
    micrometre."""
    contact = f'condim="3" friction="{friction} 0 0" solref="0.002 1"'
    return f"""
<mujoco><option timestep="0.001" gravity="0 0 0" integrator="implicitfast" cone="elliptic"
  sdf_iterations="30" sdf_initpoints="60"/>
<asset><mesh name="body" file="body.obj"/></asset>
<worldbody><body><geom type="sdf" mesh="body" {contact}/></body>
<body name="ball"><joint type="slide" axis="1 0 0" damping="28"/>
<joint type="slide" axis="0 1 0" damping="28"/><joint type="slide" axis="0 0 1" damping="28"/>
<geom type="sphere" size="{Beam.radius / 1e3}" mass="0.1" {contact}/></body></worldbody></mujoco>
"""


class Watched(BeamScanner):
    """Keeps where the beam is held, and where the ball is."""

    def read(self):
        reading = super().read()
        self.held.append((self._holds.copy(), self._balls.copy(), self._touches.copy()))
        return reading


def scanned(name: str, point, normal, friction: float):
    """Held ends and balls (k, 3) of one arm in contact, 0.4 mm apart."""
    probe = Watched(Feet(make_object(name)), beam(friction), np.random.default_rng(0), 2)
    probe.place(point + 20.0 * normal)
    probe.held = []
    planes = concurrent_planes(point, normal, np.array([0.3, 0.5, 0.8]), 3)[:1]
    plan = ProbePlan(0, point, normal, planes, 15.0, 2.5, 2.5, Reason.REFINE, approach=8.0)
    track_plan(probe, plan)
    rows = [(u[0], x[0]) for u, x, on in probe.held if on[0]][::10]
    return np.array([u for u, _ in rows]), np.array([x for _, x in rows])


@pytest.mark.slow
@pytest.mark.parametrize(("angle", "friction"), [(0.0, 0.0), (2.2, 0.15), (3.6, 0.0)])
def test_the_ball_rests_where_mujoco_has_it(angle, friction):
    """Outside, on a slope, and within the hole of a torus of radii 40 and 15, which a convex hull
    would fill. The distance field that MuJoCo makes of triangles is good to 25 um, its normals to 7
    degrees, by which a beam bent by 0.2 mm moves a ball by 25 um. Its friction creeps, so that its
    ball may rest anywhere within the cone: 2 m F / k = 0.06 mm wide."""
    out = np.array([np.cos(0.7), np.sin(0.7), 0.0])
    normal = np.cos(angle) * out + np.sin(angle) * np.array([0.0, 0.0, 1.0])
    held, balls = scanned("torus", 40.0 * out + 15.0 * normal, normal, friction)
    mesh = trimesh.creation.torus(0.040, 0.015, major_sections=256, minor_sections=128)
    files = {"body.obj": mesh.export(file_type="obj").encode()}
    spec = mujoco.MjSpec.from_string(world(friction), assets=files)
    spec.meshes[0].octree_maxdepth = 8
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[:] = balls[0] / 1e3
    found = []
    for hold in held:
        for _ in range(60):
            pull = Beam.stiffness * 1e3 * (hold / 1e3 - data.qpos)
            data.xfrc_applied[model.body("ball").id, :3] = pull
            mujoco.mj_step(model, data)
        found.append(1e3 * data.qpos)
    away = np.linalg.norm(np.array(found) - balls, axis=1)
    assert len(balls) > 30 and np.linalg.norm(np.ptp(balls, axis=0)) > 10.0
    assert away.max() < 0.05 + 2.0 * friction * 0.4 / Beam.stiffness, away.max()
    gap = np.hypot(np.hypot(*np.array(found).T[:2]) - 40.0, np.array(found)[:, 2]) - 17.0
    assert np.abs(gap).max() < 0.025, np.abs(gap).max()
