"""Tables to joint signals: files of columns, which column is which signal, several files as one log.

In: CSV, Parquet, Feather, .npz, .mat, HDF5, JSON lines, KUKA traces. Out: a JointLog.
Elsewhere: rules that topics share (logs/signals).
"""
