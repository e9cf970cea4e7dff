"""The robot as a rigid-body model: torques from motion.

In: the ``[robot]`` table and the URDF or DH rows that it names. Out: joint names, and a RobotModel.
Elsewhere: signals of a log, and what is made of its torques (conditioning, prepare).
``robot_description.py`` is cheap and reads text only; ``robot_building.py`` reaches Pinocchio, which is imported in
``pinocchio_model.py`` and ``arm_shapes.py`` and nowhere else.
"""
