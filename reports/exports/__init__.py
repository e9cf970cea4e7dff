"""Files for other tools: MCAP for viewers of robot logs, tables of events.

In: audits with their signals. Out: files, the same bytes for the same audit.
Elsewhere: text for people and for CI (``formats``), the page (``page``), what is computed (``core``).
"""
