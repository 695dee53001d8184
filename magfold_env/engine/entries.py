"""Entries of the arrays that hold one number of a chain each: its counters, clocks, and rows."""

# `State.counter`. FRESH (1) has the accelerations found anew, MOREAU_LEFT counts steps still to be
# taken by Moreau's scheme, QUICK_TOUCHES touches in a row with next to no time between. A run ends
# when KEEP components are held; −1: when the chain rests, or at the time END. FEEDING is 1 while
# the feed has the speed that is asked of it, PARKED is 1 once it stands still for good. STIFF is 1
# while steps are Chebyshev's, and negative while so many others must come before.
LO, STEPS, EVALUATIONS, EVENTS, FRAMES, FRESH, MOREAU_LEFT, SECOND_STEPS = range(8)
QUICK_TOUCHES, KEEP, FEEDING, STIFF, PARKED = range(8, 13)

# `State.clock`. BRAKE is how long the next step may be before a component stops, LAST_STEP 0 if
# there is none to compare with, MARK when the base is at the feed's next mark, see `chain.feed`,
# END when the run ends at the latest. SECOND, and SECOND_STEPS, are of when the present second
# began.
TIME, STEP, FRAME_TIME, BRAKE, SECOND, LAST_STEP, LAST_ERROR, MARK, END = range(9)

# `State.place`: how deep in the tube the innermost hinge was at first, and the feed's next mark.
DEPTH, NEXT = range(2)

# `Rows.counts`: where joint stops, contacts and all rows end; contacts just let go.
JOINT_STOPS, CONTACTS, ALL_ROWS, LET_GO = range(4)
