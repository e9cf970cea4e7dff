"""MCAP files, whole or by their summary.

In: a file. Out: batches of raw messages.
Elsewhere: what the messages mean (logs/messages).
"""
