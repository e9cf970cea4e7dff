"""ROS 2 bags: folders, and their sqlite3 storage.

In: a folder or .db3 file. Out: batches of raw messages.
Elsewhere: MCAP storage (logs/mcap), what the messages mean (logs/messages).
"""
