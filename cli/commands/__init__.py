"""The commands, one module each, imported when its command is run.

In: arguments and settings. Out: text, files, an exit code.
Elsewhere: what commands share (``cli``), the text and the files themselves (``reports``).
"""
