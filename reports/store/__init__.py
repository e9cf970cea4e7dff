"""The store of results over nights: Parquet files that are added and never changed, and SQL over them.

In: records of logs (``core/history``). Out: files of a batch, records read back, tables of a question.
Elsewhere: what a record holds and what changed over nights (``core/history``), pages (``page``).
"""
