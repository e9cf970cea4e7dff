"""Numbers without robots: arrays, runs of samples, blocks, threads, filters, kernels, constants of statistics.

In: NumPy arrays. Out: NumPy arrays.
Elsewhere: anything that knows a joint, a log or a unit.
"""
