"""What columns mean: joint names, units and signs, clocks, publishers, annotations, the wrist sensor.

In: tables of samples. Out: signals in SI units by joint.
Elsewhere: how bytes become samples (the formats).
"""
