"""Recordings of messages to joint signals: topics, their publishers, the wrist sensor, annotations.

In: a MessageReader. Out: a JointLog.
Elsewhere: how a message is decoded (logs/messages), rules that tables share (logs/signals).
"""
