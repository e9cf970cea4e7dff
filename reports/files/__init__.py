"""Files of results, written whole or not at all, and read back checked; the store of nights, which is added to.

In: results of ``core``, rows of nights, or paths. Out: JSON, Parquet, JSON Schemas, results and rows read back.
Elsewhere: files for readers and CI (``formats``, ``page``), configurations (``core/config``), logs (``core/logs``).
"""
