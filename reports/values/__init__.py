"""Values as text: numbers with units, words for codes, lines of logs that several formats share.

In: results of ``core``. Out: text and frozen rows of text, without layout and without escaping.
Elsewhere: layout of a terminal (``terminal``), of the page (``page``), of CI formats (``formats``).
"""
