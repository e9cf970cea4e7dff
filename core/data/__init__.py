"""What the stages hand to each other: logs, series, signals, results; frozen types and nothing else.

In: what a stage computed. Out: the same, read-only, in the shape of the JSON files where it becomes one.
Elsewhere: every computation, every file.

Where results are validated as JSON, annotations are objects (no ``from __future__ import annotations``): msgspec would
compile and evaluate the text of each.
"""
