"""Drive gains from logs that differ by a known load.

In: samples of several logs and the torque of their loads. Out: gains with standard errors, where the loads tell them.
Elsewhere: gains by the described inertials (identification), what a fit keeps of them (friction file).
"""
