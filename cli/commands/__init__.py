"""The commands, a module for each family, imported when one of its commands is run.

In: arguments and settings. Out: text, files, an exit code.
Elsewhere: what commands share (``cli``), the text and the files themselves (``reports``).
"""
