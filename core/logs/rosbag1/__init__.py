"""ROS 1 bags, format 2.0.

In: a file. Out: batches of raw messages.
Elsewhere: what the messages mean (logs/messages).
"""
