"""Joint friction: sections, points, fits, what the data determine, what friction goes with; the fit of a whole arm.

In: Prepared logs. Out: a FrictionFit a joint, friction models as functions of velocity, and the description so fitted.
Elsewhere: the laws themselves (friction_laws); what friction can be while a joint rests (residual).
"""
