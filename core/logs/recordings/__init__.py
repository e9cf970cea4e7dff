"""Recordings of messages: MCAP files, ROS 1 bags (format 2.0), ROS 2 bags with their sqlite3 storage.

In: a file. Out: batches of raw messages.
Elsewhere: what messages hold (messages), which topics are meant (topics).
"""
