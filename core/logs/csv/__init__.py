"""Tables of numbers as text.

In: a CSV file. Out: its columns as numbers or text.
Elsewhere: which column is which signal (logs/tables).
"""
