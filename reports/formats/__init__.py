"""Report formats: one table of them, and the writers of text for people and CI, and of files for other tools.

In: audits with their signals, logs that could not be audited, plans. Out: text or files, the same for the same results.
Elsewhere: the HTML page (``page``), the files of a run (``files``), what is computed (``core``).
"""
