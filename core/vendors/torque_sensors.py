"""On which side of the gears arms measure their torque, as far as the names of their joints tell the arm."""

from __future__ import annotations

import re

#: Arms whose drivers publish joint-side torque sensors, by the names of their joints.
TORQUE_SENSED = re.compile(
    r"(^|[_/])(panda|fer|fr3|fp3|franka|iiwa\d*|lbr(_\w+)?|lwr|med7|med14|gen3|rizon\d*|diana\d*|sawyer)(_|$)", re.I
)
