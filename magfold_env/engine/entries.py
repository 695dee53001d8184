"""Entries of the arrays that hold one number of a chain each: its counters, clocks, and rows."""

# `State.counter`. FRESH (1) has the accelerations found anew, MOREAU_LEFT counts steps still to be
# taken by Moreau's scheme, QUICK_TOUCHES touches in a row with next to no time between. A run ends
# when KEEP components are held; −1: when the chain rests, or at the time END. FEEDING is 1 while a
# component leaves the tube. STIFF is 1 while steps are Chebyshev's, and negative while so many
# others must come before.
LO, STEPS, EVALUATIONS, EVENTS, FRAMES, FRESH, MOREAU_LEFT, SECOND_STEPS = range(8)
QUICK_TOUCHES, KEEP, FEEDING, STIFF = range(8, 12)

# `State.clock`. BRAKE is how long the next step may be before a component stops, LAST_STEP 0 if
# there is none to compare with, RELEASE when the last component had left the tube. SECOND, and
# SECOND_STEPS, are of when the present second began.
TIME, STEP, FRAME_TIME, BRAKE, SECOND, LAST_STEP, LAST_ERROR, RELEASE, END = range(9)

# `Rows.counts`: where joint stops, contacts and all rows end; contacts just let go.
JOINT_STOPS, CONTACTS, ALL_ROWS, LET_GO = range(4)
