"""Effort and what may explain it, thinned, as sums of products by joint and block of time: questions are small solves.

For every check and cause that asks how effort goes with the model's torque, on every log.
In: a uniform series, model torque, columns. Out: coefficients, with intervals from blocks of time.
Elsewhere: which columns a question needs and what its answer means (prepare, causes).
"""
