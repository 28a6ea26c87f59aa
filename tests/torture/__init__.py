"""``make torture``: small experiments are killed, damaged, edited and run in bad surroundings, at random from a seed.

After each case the results must have the bytes of a run that nothing disturbed, and whatever was wrong in between must
have been told. A case is a function of a laboratory and a generator of random numbers, in the list `cases.CASES`.
"""
