"""What is known of one log before it is judged: model torque, commanded force, phases, checks of the effort.

In: a JointLog, a robot, a configuration, what was identified before. Out: a Prepared log.
Elsewhere: the fit of drives' gains (identification), friction (friction), the residual (residual).
"""
