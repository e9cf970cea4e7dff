"""Drawings for the page, as SVG.

In: signals and facts of one audit. Out: inline SVG with a label that says what it shows.
Elsewhere: which events are drawn, captions and layout (``page``).
"""
