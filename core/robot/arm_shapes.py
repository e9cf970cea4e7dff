"""Shapes of an arm's links, to keep them apart: shapes of the description where it has them, capsules elsewhere.

Pinocchio places the shapes, Coal finds what is closer than the clearance. Both are imported here for that alone.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence, Set
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin

from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.robot.pinocchio_model import frame_id
from collaudit.core.robot.robot_model import RobotModel

_WATER_KG_M3 = 1000.0
_MASSLESS_M = 0.05  # radius of a link without a mass
_FAR_M = 50.0  # extent of what stands for a half space: Coal's meshes have no distance to an infinite one
Box = tuple[Sequence[float], Sequence[float]]


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What links keep away from.

    Attributes:
        clearance_m: least distance of all.
        table_z_m: height of a plane in the base's axes.
        box_m: lowest and highest corner of a box that links stay in; None for no box.
        tip: frame and point (3,) m in it where the tool ends; None where that is not known.
    """

    clearance_m: float
    table_z_m: float
    box_m: Box | None = None
    tip: tuple[str, Sequence[float]] | None = None


class ArmShapes:
    """Shapes of the base and of every link, and the pairs that must stay apart.

    Attributes:
        described: links whose shape is the description's.
        capsules: radius in m of every link that a capsule stands for, by the joint that moves it.
        unchecked: pairs of links that no motion could keep apart by the clearance: neighbours, and links with little
            between them.
    """

    def __init__(self, robot: RobotModel, around: Surroundings, urdf: Path | None = None) -> None:
        """``urdf``: file whose collision shapes are used, None for none."""
        assert robot.bodies is not None
        self._robot, self._model = robot, robot.bodies.library_model()
        self._data, self._shapes = self._model.createData(), pin.GeometryModel()
        self._around = around
        self._of_joint: dict[int, list[int]] = {}
        described, whole = ([], set()) if urdf is None else self._add_described(urdf)
        self.described = tuple(described)
        self.capsules = self._add_capsules(whole)
        self._add_surroundings()
        self.unchecked = self._pair_links()
        self._state = pin.GeometryData(self._shapes)
        for request in self._state.collisionRequests:
            request.security_margin = around.clearance_m

    def touching(self, q: FloatArray) -> tuple[int, str] | None:
        """The first of (n, j) positions that is not free, and what is too close there; None where all are free."""
        full = q @ self._robot.expansion.T + self._robot.offset
        for k, pose in enumerate(full):
            if pin.computeCollisions(self._model, self._data, self._shapes, self._state, pose, True):
                return k, self._words()
        return None

    def reach_m(self) -> FloatArray:
        """(j,) how far any point moves with a radian (metre) of each joint at most, m."""
        model, reach = self._model, np.zeros(self._model.njoints)
        for item in self._shapes.geometryObjects[: sum(map(len, self._of_joint.values()))]:
            item.geometry.computeLocalAABB()
            centre = item.placement.act(item.geometry.aabb_center)
            far = float(np.linalg.norm(centre)) + float(item.geometry.aabb_radius)
            reach[item.parentJoint] = max(reach[item.parentJoint], far)
        for joint in range(model.njoints - 1, 0, -1):
            place = float(np.linalg.norm(model.jointPlacements[joint].translation))
            reach[model.parents[joint]] = max(reach[model.parents[joint]], reach[joint] + place)
        slides = np.array([kind == "prismatic" for kind in self._robot.joint_types])
        return np.asarray(np.where(slides, 1.0, reach[1:] @ np.abs(self._robot.expansion)))

    def _words(self) -> str:
        for k, pair in enumerate(self._shapes.collisionPairs):
            if self._state.collisionResults[k].isCollision():
                names = (self._shapes.geometryObjects[i].name.partition("#")[0] for i in (pair.first, pair.second))
                return " and ".join(names)
        return "links"

    def _add(self, name: str, joint: int, placement: Any, geometry: Any) -> None:
        index = self._shapes.addGeometryObject(pin.GeometryObject(name, joint, placement, geometry))
        self._of_joint.setdefault(joint, []).append(int(index))

    def _add_described(self, urdf: Path) -> tuple[list[str], set[int]]:
        """Add the shapes that can be read; the links that have them, and joints all of whose links' shapes were."""
        links, some, lacking = [], set(), set()
        for link in ET.parse(urdf).getroot().findall("link"):
            name, found = link.get("name", ""), link.findall("collision")
            if not found or not self._model.existFrame(name):
                continue
            frame = self._model.frames[frame_id(self._model, name)]
            shapes = [_shape(element, urdf.parent) for element in found]
            if any(shape is None for shape in shapes):
                lacking.add(int(frame.parentJoint))
                continue
            some.add(int(frame.parentJoint))
            links.append(name)
            for k, (element, shape) in enumerate(zip(found, shapes, strict=True)):
                place = frame.placement * _origin(element.find("origin"))
                self._add(f"{name}#{k}", frame.parentJoint, place, shape)
        return links, some - lacking

    def _add_capsules(self, whole: Set[int]) -> dict[str, float]:
        """Capsules from each joint to the next, but of joints whose links all have a shape (``whole``).

        The base's is as thick as the first link's.
        """
        made = {}
        for joint in range(self._model.njoints):
            name, end = str(self._model.names[joint]), self._end(joint)
            length = float(np.linalg.norm(end))
            radius = self._radius(max(joint, 1), length)
            if joint not in whole:
                place = pin.SE3(pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), end).matrix(), 0.5 * end)
                shape = coal.Capsule(radius, length) if length > 1e-6 else coal.Sphere(radius)
                self._add(f"{self._label(joint)}#", joint, place if length > 1e-6 else pin.SE3.Identity(), shape)
                made["base" if joint == 0 else name] = radius
        return made

    def _radius(self, joint: int, length: float) -> float:
        """Of a capsule of water of the link's mass: pi r² (length + 4 r / 3) = mass / density."""
        volume = float(self._model.inertias[joint].mass) / _WATER_KG_M3
        if volume <= 0.0:
            return _MASSLESS_M
        roots = np.roots([4.0 / 3.0 * np.pi, np.pi * length, 0.0, -volume])
        return float(max(root.real for root in roots if abs(root.imag) < 1e-9))

    def _end(self, joint: int) -> FloatArray:
        """Where a link ends, in its joint's axes: at the next joint, or at the farthest frame of the last one."""
        after = [k for k in range(1, self._model.njoints) if self._model.parents[k] == joint]
        ends = [self._model.jointPlacements[k].translation for k in after]
        if not after:
            ends += [frame.placement.translation for frame in self._model.frames if frame.parentJoint == joint]
        if self._around.tip is not None:
            frame = self._model.frames[frame_id(self._model, self._around.tip[0])]
            ends += [frame.placement.act(np.array(self._around.tip[1]))] if frame.parentJoint == joint else []
        return np.array(max(ends, key=np.linalg.norm)) if ends else np.zeros(3)

    def _add_surroundings(self) -> None:
        """Table and walls as thick blocks, paired with every link that the arm can move to them."""
        walls, box = [("the table", 2, -1.0, self._around.table_z_m)], self._around.box_m
        for axis in range(3 if box is not None else 0):
            assert box is not None
            walls += [("the workspace's edge", axis, side, box[k][axis]) for k, side in enumerate((-1.0, 1.0))]
        links = [i for joint, own in self._of_joint.items() if joint > self._fixed_height() for i in own]
        for k, (name, axis, side, at) in enumerate(walls):
            centre = np.zeros(3)
            centre[axis] = at + side * _FAR_M
            block = coal.Box(*[2.0 * _FAR_M] * 3)
            index = self._shapes.addGeometryObject(
                pin.GeometryObject(f"{name}#{k}", 0, pin.SE3(np.eye(3), centre), block)
            )
            for link in links:
                self._shapes.addCollisionPair(pin.CollisionPair(link, int(index)))

    def _fixed_height(self) -> int:
        """Number of the last joint that cannot lower its link: 1 where the first turns about the vertical, else 0."""
        columns = pin.computeJointJacobians(self._model, self._data, pin.neutral(self._model))
        turn = np.reshape(columns, (6, -1))[3:, self._model.joints[1].idx_v]
        return 1 if abs(turn[2]) > 1.0 - 1e-6 else 0

    def _pair_links(self) -> tuple[str, ...]:
        """Pair all links that can be kept apart; the others in words."""
        left = []
        for j in sorted(self._of_joint):
            for i in sorted(k for k in self._of_joint if k < j):
                gap = self._between(i, j)
                if gap < self._thick(i) + self._thick(j) + self._around.clearance_m:
                    left.append(f"{self._label(i)} and {self._label(j)}")
                    continue
                for a in self._of_joint[i]:
                    for b in self._of_joint[j]:
                        self._shapes.addCollisionPair(pin.CollisionPair(a, b))
        return tuple(left)

    def _label(self, joint: int) -> str:
        return "the base" if joint == 0 else f"the link of {self._model.names[joint]}"

    def _thick(self, joint: int) -> float:
        name = str(self._model.names[joint])
        return self.capsules.get(name) or self._radius(max(joint, 1), float(np.linalg.norm(self._end(joint))))

    def _between(self, i: int, j: int) -> float:
        """Length of the links between two of one chain, m; infinite where neither carries the other."""
        length, joint = 0.0, j
        while self._model.parents[joint] != i:
            joint = self._model.parents[joint]
            if joint == 0:
                return float(np.inf)
            length += float(np.linalg.norm(self._end(joint)))
        return length


def _origin(element: ET.Element | None) -> Any:
    xyz, rpy = ("0 0 0", "0 0 0") if element is None else (element.get(key, "0 0 0") for key in ("xyz", "rpy"))
    turn = pin.rpy.rpyToMatrix(*(float(x) for x in rpy.split()))
    return pin.SE3(turn, np.array([float(x) for x in xyz.split()]))


def _shape(collision: ET.Element, folder: Path) -> Any | None:
    """One shape of a description; None where it cannot be read. Meshes become their convex hulls, which hold them."""
    geometry = collision.find("geometry")
    shape = None if geometry is None or len(geometry) == 0 else geometry[0]
    if shape is None:
        return None
    if shape.tag == "box":
        return coal.Box(*(float(x) for x in shape.get("size", "").split()))
    if shape.tag == "sphere":
        return coal.Sphere(float(shape.get("radius", "0")))
    if shape.tag == "cylinder":
        return coal.Cylinder(float(shape.get("radius", "0")), float(shape.get("length", "0")))
    path = _mesh_file(shape.get("filename", ""), folder)
    if path is None:
        return None
    scale = np.array([float(x) for x in shape.get("scale", "1 1 1").split()])
    mesh = coal.MeshLoader().load(str(path), scale)
    mesh.buildConvexHull(True, "Qt")
    return mesh.convex


def _mesh_file(name: str, folder: Path) -> Path | None:
    """Where a mesh lies: a path from the description's folder, or of a package in that folder or above it."""
    if name.startswith("package://"):
        inside = name.removeprefix("package://")
        places = [place / inside for place in (folder, *folder.resolve().parents)]
    else:
        places = [folder / name.removeprefix("file://")]
    return next((place for place in places if place.is_file()), None)
