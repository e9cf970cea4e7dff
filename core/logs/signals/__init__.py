"""What the columns of any log mean: joint names, units and signs, clocks, annotations.

In: columns and stamps. Out: SI units by joint, one clock, and findings about them.
Elsewhere: how bytes become columns (the formats), topics (logs/topics), tables (logs/tables).
"""
