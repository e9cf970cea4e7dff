"""Tables to joint signals: which column is which signal, several files as one log.

In: TableReaders. Out: a JointLog.
Elsewhere: how a file holds its columns (logs/table_files), rules that topics share (logs/signals).
"""
