"""Files of results, written whole or not at all, and read back checked.

In: results of ``core`` or paths. Out: JSON, Parquet and TOML as text or on disk, their JSON Schemas, results read back.
Elsewhere: files for readers and CI (``formats``, ``page``), configurations (``core/config``), logs (``core/logs``).
"""
