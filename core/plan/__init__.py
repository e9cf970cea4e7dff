"""A motion that would settle what logs so far leave open, within hard limits.

In: settings, the robot, what an earlier fit found. Out: a Plan: moves from rest to rest, and what they should tell.
Elsewhere: files and page of a plan (reports); what a later fit makes of its log (fitting).
"""
