"""Entries of the arrays that hold one number of a chain each: its counters, clocks, and rows."""

# `State.counter`. FRESH (1) has the accelerations found anew, MOREAU_LEFT counts steps still to be
# taken by Moreau's scheme, QUICK_TOUCHES touches in a row with next to no time between. A run ends
# when KEEP components are held; −1: when the chain rests, or at the time END. FEEDING is 1 while
# the feed knows what is asked of it, PARKED is 1 once it stands still for good, SLIPPING −1 or 1,
# the sign of its force, while that is all the drive can do. STIFF is 1 while steps are Chebyshev's,
# and negative while so many others must come before.
LO, STEPS, EVALUATIONS, EVENTS, FRAMES, FRESH, MOREAU_LEFT, SECOND_STEPS = range(8)
QUICK_TOUCHES, KEEP, FEEDING, STIFF, PARKED, SLIPPING = range(8, 14)

# `State.clock`. BRAKE is how long the next step may be before a component stops, LAST_STEP 0 if
# there is none to compare with, MARK when the base is at the feed's next mark, see `chain.feed`,
# END when the run ends at the latest. SECOND, and SECOND_STEPS, are of when the present second
# began.
TIME, STEP, FRAME_TIME, BRAKE, SECOND, LAST_STEP, LAST_ERROR, MARK, END = range(9)

# `State.feed`: how deep in the tube the innermost hinge was at first and the next mark [m], which
# WAY that is (−1, 0 or 1), the speed that is asked for [m/s], and since when the drive slips [s].
DEPTH, NEXT, WAY, ASKED, SINCE = range(5)

# `Recursion.base`: the mass that goes along with the base while the drive slips, 0 while it does
# not [kg], and its force then; what else pulls at what the tube holds [N].
CARRIED, DRIVE, PULL = range(3)

# `Rows.counts`: where joint stops, contacts and all rows end; contacts just let go.
JOINT_STOPS, CONTACTS, ALL_ROWS, LET_GO = range(4)
