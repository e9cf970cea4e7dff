"""Raw messages to columns: schemas, layouts, profiles of types, and the generic decoder beside them.

In: batches of raw messages. Out: their columns in the log's own names and units.
Elsewhere: where the bytes come from (a reader), topics and publishers (logs/topics).
"""
