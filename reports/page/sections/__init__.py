"""What each section of the report shows, one view-model a file.

In: one audit and the figures of its joints. Out: frozen rows and drawings for the section's template.
Elsewhere: the templates, the order of the sections (``page``), drawings (``plots``), text (``values``).
"""
