"""States of an arm that are no collision: drives off, braking, stopped by its controller, guided by hand.

In: a uniform series, its model torque, what the log says of itself. Out: samples not to be judged, and findings.
Elsewhere: stuck and frozen signals (conditioning), guiding that no flag tells (prepare), judging (residual, detection).
"""
