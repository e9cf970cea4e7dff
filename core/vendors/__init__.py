"""What vendors document of what their software writes: messages, columns, modes, where torque is measured. Data.

In: public documentation. Out: tables and types that hold it.
Elsewhere: how messages and columns are matched with it (``logs``), what a state means for judging (``arm_states``).
"""
