"""The effort as a channel: its kind, gains, signs and delay against the model's torque; nothing is changed by them.

In: a conditioned log and its model torque. Out: what it is, with intervals, and findings.
Elsewhere: the fit of drives' gains (identification), filters in the effort (arm_states).
"""
