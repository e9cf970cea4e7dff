"""Which of the recorded samples are measurements.

In: a JointLog as recorded. Out: the same with what is no measurement left out or missing, and findings on it.
Elsewhere: stamps and gaps, filters (conditioning); drives that are off, braked or switched (arm_states).
"""
