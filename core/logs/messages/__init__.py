"""Raw messages to columns: schemas, layouts, profiles of types, and the generic decoder beside them.

In: batches of raw messages. Out: tables of samples by topic, and a JointLog.
Elsewhere: where the bytes come from (a reader), what columns mean (logs/signals).
"""
