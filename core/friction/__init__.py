"""Joint friction: sections, points, fits, what the data determine, and friction variation.

In: Prepared logs. Out: a FrictionFit a joint, and friction models as functions of velocity.
Elsewhere: the laws themselves (friction_laws); what friction can be while a joint rests (residual).
"""
