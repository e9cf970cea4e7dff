"""Known events against what was found: recall, false alarms, delay, ROC.

In: true events and alarms. Out: Scores.
Elsewhere: reading labels from logs (logs).
"""
