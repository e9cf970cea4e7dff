"""From alarms of single joints to contacts: link, external force, commanded or not, and the controller's own alarms.

In: the alarms and residuals of one log. Out: Contacts.
Elsewhere: the alarms themselves (detection).
"""
