"""Dynamics and forces of many samples at once against Pinocchio, sample by sample, on trees of every kind of joint."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
import reference_dynamics
from reference_dynamics import Sample

from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.parallel import by_samples
from collaudit.core.robot.pinocchio_model import PinocchioModel, PointMass

G = np.array([0.3, -1.2, -9.7])


def tree(seed: int, joints: int) -> PinocchioModel:
    """Joints about and along any axis, some on the same parent, bodies and rotors on each, a frame on the last."""
    rng = np.random.default_rng(seed)
    model = pin.Model()
    model.gravity.linear = G
    for k in range(joints):
        axis = rng.normal(size=3)
        kinds = (
            pin.JointModelRevoluteUnaligned(axis / np.linalg.norm(axis)),
            pin.JointModelPrismaticUnaligned(axis / np.linalg.norm(axis)),
            pin.JointModelRX(), pin.JointModelRY(), pin.JointModelRZ(), pin.JointModelPY(),
        )  # fmt: skip
        above = list(model.supports[k])  # Pinocchio wants joints depth first
        parent = above[-1] if rng.random() < 0.7 else above[rng.integers(len(above))]
        number = model.addJoint(parent, kinds[rng.integers(len(kinds))], pin.SE3.Random(), f"j{k}")
        model.appendBodyToJoint(number, pin.Inertia.Random(), pin.SE3.Identity())
        model.addFrame(pin.Frame(f"f{k}", number, 0, pin.SE3.Random(), pin.FrameType.OP_FRAME))
    model.addFrame(pin.Frame("base", 0, 0, pin.SE3.Random(), pin.FrameType.FIXED_JOINT))
    model.armature = rng.uniform(0.0, 1.0, joints)
    return PinocchioModel(model)


def compared(
    compute: Callable[..., FloatArray], sizes: Sequence[int], reference: Sample, within: float = 1e-11
) -> None:
    """What is computed from arguments of so many rows is what the reference gives."""
    rows = np.random.default_rng(1).normal(size=(sum(sizes), 40))
    ours = compute(*np.split(rows, np.cumsum(sizes)[:-1])).T
    theirs = np.array([reference(row) for row in rows.T]).reshape(ours.shape)  # of one joint Pinocchio drops the axis
    np.testing.assert_allclose(ours, theirs, rtol=10.0 * within, atol=within * max(1.0, np.abs(theirs).max()))


@pytest.mark.parametrize("joints", [1, 2, 4, 7])
@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_any_tree(seed: int, joints: int) -> None:
    pin.seed(seed)
    model, j = tree(seed, joints), joints
    compared(model.inverse_dynamics, (j, j, j), reference_dynamics.inverse_dynamics(model))
    compared(model.momentum, (j, j), reference_dynamics.momentum(model), within=1e-9)
    for frame in (f"f{joints - 1}", "f0", "base"):
        mass = PointMass(frame, 0.8, (0.1, 0.0, -0.2))
        compared(
            lambda q, wrench, frame=frame: model.wrench_torque(q, wrench, frame),
            (j, 6),
            reference_dynamics.force(model, frame),
        )
        weight = reference_dynamics.weight(model, frame, mass.mass_kg, np.array(mass.com_m), G)
        compared(lambda q, mass=mass: -model.moving_force(mass, q, np.zeros_like(q), np.zeros_like(q)), (j,), weight)
        compared(
            lambda q, frame=frame: model.base_direction(q, frame, G),
            (j,),
            lambda q, weight=weight: weight(q)[:3] / 0.8,
        )
        loaded = PinocchioModel(model.library_model())
        loaded.add_point_mass(mass)
        more, bare = (reference_dynamics.inverse_dynamics(one) for one in (loaded, model))
        compared(model.carrying(mass).inverse_dynamics, (j, j, j), lambda x, more=more, bare=bare: more(x) - bare(x))


def test_a_sample_that_is_not_known_leaves_the_others_alone() -> None:
    """Infinite as well as missing, also where the constants of the arm take the input out of the result."""
    model = tree(7, 3)
    q, v, a = np.random.default_rng(1).normal(size=(3, 20, 3))
    torque = model.inverse_dynamics
    expected = by_samples(torque, [q, v, a], 3)
    for k, value in enumerate((np.nan, np.inf, -np.inf)):
        (q, v, a)[k][4 * k, 0] = value
    out = by_samples(torque, [q, v, a], 3)
    bad = ~np.isfinite(q + v + a).all(axis=1)
    assert np.isnan(out[bad]).all() and bad.sum() == 3
    np.testing.assert_array_equal(out[~bad], expected[~bad])


def test_other_parameters_give_other_torques() -> None:
    model = tree(6, 3)
    q, v, a = np.random.default_rng(1).normal(size=(3, 3, 5))
    heavier = model.with_parameters(model.inertial_parameters(), model.armature + 1.0)
    before, after = (one.inverse_dynamics(q, v, a) for one in (model, heavier))
    np.testing.assert_allclose(after - before, a, atol=1e-12)


@pytest.mark.parametrize(
    "name", ["panda", "ur10_robot", "ur3_robot", "fr3", "med7dock", "tiago_no_hand", "tx40_mdh_modified"]
)
def test_every_real_arm(data_dir: Path, name: str) -> None:
    """Torques, momenta and the regressor, which is linear in the same parameters, to 1e-9."""
    path = data_dir / "urdf" / f"{name}.urdf"
    if not path.is_file():
        pytest.skip(f"absent: {path}")
    own = pin.buildModelFromXML(path.read_text())
    moving = [k for k in range(1, own.njoints) if own.joints[k].nq == own.joints[k].nv == 1]
    locked = [k for k in range(1, own.njoints) if k not in moving]
    own = pin.buildReducedModel(own, locked, pin.neutral(own)) if locked else own
    own.armature = np.linspace(0.1, 1.0, own.nv)
    model, j = PinocchioModel(own), own.nv
    compared(model.inverse_dynamics, (j, j, j), reference_dynamics.inverse_dynamics(model))
    compared(model.momentum, (j, j), reference_dynamics.momentum(model), within=1e-9)
    q, v, a = np.random.default_rng(1).normal(size=(3, 5, j))
    linear = model.torque_regressor(q, v, a, np.eye(j)) @ model.inertial_parameters() + model.armature * a
    np.testing.assert_allclose(linear.T, model.inverse_dynamics(q.T, v.T, a.T), rtol=1e-9, atol=1e-9)
