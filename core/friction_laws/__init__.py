"""The friction laws: their curves, parameters, formula texts and roles, and the one table that lists them.

In: speeds, directions, parameters by symbol. Out: friction, and every fact about a law that other rooms need.
Elsewhere: fitting and comparing laws (friction); a fitted law on a log, with breakaway and temperature (friction).
"""
