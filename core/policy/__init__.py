"""The decision over a finished audit: levels, limits beyond one log, the baseline, waivers.

In: a log's result, the policy for it, a baseline, the day. Out: what each rule says, and the log's decision.
Elsewhere: the verdict of a log on its own (verdict), reading baselines and writing decisions (cli, reports).
"""
