"""Known events against what was found: recall, false alarms, delay, ROC; and the controller's own alarms.

In: true events, the controller's alarms, what was found. Out: Scores, and each of those alarms beside its contact.
Elsewhere: reading labels from logs (logs).
"""
