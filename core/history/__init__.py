"""The nights of a fleet: one row a log and joint of what its audit found, and these by night.

In: audit results. Out: rows, and each joint's nights.
Elsewhere: files of rows and SQL over them (``reports/files``), thresholds (``recommend``), known contacts (``policy``).
"""
