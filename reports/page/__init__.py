"""The HTML pages: the report of one or several logs, the index of many, and pages of one matter each.

In: audits, lines of the index. Out: self-contained HTML that works offline and runs no script.
Elsewhere: drawings (``plots``), the text of values (``values``).
"""
