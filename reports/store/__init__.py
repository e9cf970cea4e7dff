"""The store of results over nights: Parquet files that are added and never changed, and SQL over them.

In: rows of nights (``core/history``). Out: files of a batch, rows read back, tables of a question.
Elsewhere: what a row holds (``core/history``), pages (``page``).
"""
