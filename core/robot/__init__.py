"""The robot as a rigid-body model: torques from motion."""
