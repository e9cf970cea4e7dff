"""The estimate of external joint torque, eq. (5): one file a detector, behind one interface.

In: a Prepared log and friction laws. Out: a Residual with the state of every sample.
Elsewhere: thresholds and events (detection).
"""
