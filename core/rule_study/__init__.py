"""What a rule costs and notices: alarms and sensitivity over threshold gamma and persistence n.

In: a judged log. Out: a RuleStudy, with contacts of known force added to the log, and what gamma is made of.
Elsewhere: a threshold's evidence (recommend), what would have alarmed at the rule in use (verdict).
"""
