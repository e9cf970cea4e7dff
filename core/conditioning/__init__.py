"""Recorded signals onto a uniform time base, with gaps kept as gaps.

In: a JointLog. Out: a UniformSeries, and findings on stamps, velocity and effort as signals.
Elsewhere: whatever needs a robot model (prepare).
"""
