"""What is kept of an audit over nights, and what changes from night to night: friction, load, residual, evidence.

In: audits, or the records of many. Out: a record of each, series of every joint, changes with their night and cause.
Elsewhere: files of records (``reports/store``), thresholds (``recommend``).
"""
