"""Which single cause takes the residual of a log away: a load, a mounting, a scale, friction, a zero, a delay.

For whoever has a log that fails, or cannot be judged, and asks what to state before running it again.
In: one judged log: its motion, model torque, friction and residual. Out: causes with the share each explains.
Elsewhere: whether the log passes (verdict). A cause never turns a fail into a pass.
"""
