"""From alarms of single joints to contacts: link, external force, commanded or not, known or accepted.

In: the alarms and residuals of one log; contacts of earlier nights; accepted.toml. Out: Contacts, each with its state.
Elsewhere: the alarms themselves (detection), the verdict (verdict), reading stores and files (cli, reports).
"""
