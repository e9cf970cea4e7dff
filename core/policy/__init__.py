"""What is known of a robot's contacts beforehand: earlier nights, and what a person answers for.

In: the contacts of a log, those of earlier nights, accepted.toml. Out: each contact with its state: new, known, back,
accepted. Elsewhere: the verdict (verdict), reading stores and files (cli, reports).
"""
