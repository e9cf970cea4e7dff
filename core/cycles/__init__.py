"""Programs repeat: the cycles of a log, the place of each sample on their path, and the residual against that place.

In: a Residual and the motion. Out: the difference to other cycles, its level by the law of peaks, what it rests on.
Elsewhere: the rule that both residuals stand under (detection), references of earlier nights (the store of results).
"""
