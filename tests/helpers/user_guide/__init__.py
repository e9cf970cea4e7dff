"""The generated pages of the user guide: written by ``make docs``, compared with ``docs/`` by tests."""
