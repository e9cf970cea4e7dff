"""Values as text: numbers with units, words for codes, rows of cells that several formats share.

In: results of ``core``. Out: text and frozen rows of text, without layout and without escaping.
Elsewhere: layout of a terminal (``terminal``), of the page (``page``), of CI formats (``formats``).
"""
