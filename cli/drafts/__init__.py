"""The configuration that ``init`` writes: drafted from a log, tried on it, with its evidence beside each line.

In: what a log holds, settings, the robot. Out: the file's text, and what came of its trial.
Elsewhere: how logs are described (``core.logs``), the command itself (``cli.commands``).
"""
