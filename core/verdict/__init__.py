"""Pass, fail or not judged, with reasons; and what was judged at all.

In: events, states, findings, policy. Out: a verdict and a Coverage.
Elsewhere: showing it (reports).
"""
