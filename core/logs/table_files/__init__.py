"""Files of tables: CSV, Parquet, Feather, .npz, .mat, HDF5, JSON lines, KUKA traces.

In: a file. Out: its columns as numbers or text.
Elsewhere: which column is which signal (logs/tables).
"""
