"""Identification beyond friction: drive gains, inertials, tool, force sensor, delays; from arbitrary motion.

In: Prepared logs. Out: Identified, and facts about the channels.
Elsewhere: using it on another log (prepare), friction laws (friction).
"""
