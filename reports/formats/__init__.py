"""Report formats: one table of them, and the writers of those that CI systems read.

In: audits, and logs that could not be audited. Out: the text of one report file.
Elsewhere: the HTML page (``page``), the files of a run (``files``).
"""
