"""What a reader gets of a result: files, pages, tables, formats for CI.

In: results of ``core``, frozen. Out: text and files, the same bytes for the same result.
Elsewhere: what is computed (``core``), which command writes what and its exit code (``cli``).
"""
