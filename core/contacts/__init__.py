"""From alarms of single joints to contacts: link, external force, intended or not, what the controller said.

In: the alarms and residuals of one log. Out: Contacts.
Elsewhere: the alarms themselves (detection).
"""
