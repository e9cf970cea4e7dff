"""Recordings of messages to columns: MCAP files, ROS 1 and ROS 2 bags; schemas, layouts, decoding.

In: a file, as batches of raw messages. Out: their columns in the log's own names and units.
Elsewhere: which topics and publishers are meant (logs/topics).
"""
