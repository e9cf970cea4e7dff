"""Tables of numbers as text.

In: one or several CSV files. Out: a JointLog.
Elsewhere: units, names and clocks, which all formats share (logs/signals).
"""
