"""Rule (6) on residuals: thresholds, watched joints, collisions and near misses.

In: a Residual and the rule. Out: alarms of single joints, and the final state of every sample.
Elsewhere: what an alarm means (contacts), whether the log passes (verdict).
"""
