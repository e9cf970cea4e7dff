"""What the names of joints tell: on which side of the gears their torque is measured, and which are a gripper's."""

from __future__ import annotations

import re

#: Arms whose drivers publish joint-side torque sensors, by the names of their joints.
TORQUE_SENSED = re.compile(
    r"(^|[_/])(panda|fer|fr3|fp3|franka|iiwa\d*|lbr(_\w+)?|lwr|med7|med14|gen3|rizon\d*|diana\d*|sawyer)(_|$)", re.I
)
#: Joints of grippers, by the words that their descriptions use.
GRIPPER = re.compile(r"finger|gripper|knuckle|(^|[_/])jaw", re.I)
