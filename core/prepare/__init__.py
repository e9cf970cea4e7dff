"""What is known of one log before it is judged: model torque, commanded force, phases, checks of the effort.

In: a JointLog, a robot, a configuration, what was identified before. Out: a Prepared log.
Elsewhere: friction (friction), the residual (residual).
"""
