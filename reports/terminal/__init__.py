"""Results as plain text for a terminal: tables and lines that read without colour.

In: results of ``core``, rows of ``values``, the width to keep to (None: any). Out: text.
Elsewhere: printing, colour and the width of the terminal at hand (``cli``).
"""
