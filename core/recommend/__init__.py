"""Recommended gamma and n from contact-free residuals, with the evidence they rest on.

In: judged signals. Out: a RecommendedRule a joint.
Elsewhere: applying a rule (detection).
"""
