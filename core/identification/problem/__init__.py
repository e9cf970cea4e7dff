"""The least-squares problem of identification: samples, columns, solution, its errors, and fits without a part.

In: Prepared logs, priors. Out: Solution, standard errors, held-out errors.
Elsewhere: priors and gains, what is tried and what is reported (identification).
"""
