"""Joint friction: sections, points, laws, fits and their honesty.

In: Prepared logs. Out: a FrictionFit a joint, and laws as functions of velocity.
Elsewhere: what friction can be while a joint rests (residual).
"""
