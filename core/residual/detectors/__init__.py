"""One file a detector: its equation, its source, its kernel.

In: a Prepared log and friction laws. Out: a Residual.
Elsewhere: what they share (residual), and how one is found by name (residual/detector.py).
"""
