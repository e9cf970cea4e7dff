"""What a report says, subject by subject: one section each, which page, terminal and Markdown show alike.

In: results of ``core``, numbers and words of ``values``. Out: sections of text, without layout and without escaping.
Elsewhere: layout (``terminal``, ``page``, ``formats``), drawings (``plots``).
"""
