"""What a gear adds to friction over speed: friction of the load it carries, and ripple over position.

In: settled samples of the fitted logs. Out: corrections that time left out confirms, and their torque.
Elsewhere: the law over speed (friction), taking corrections off the residual (residual).
"""
