"""Entries of the arrays that hold one number of a chain each: its counters, clocks, and rows."""

# `State.counter`. FRESH (1) has the accelerations found anew, MOREAU_LEFT counts steps still to be
# taken by Moreau's scheme, QUICK_TOUCHES touches in a row with next to no time between. A run ends
# when KEEP components are held; −1: when the chain rests, or at the time END. FEEDING is 1 while
# the feed knows what is asked of it, PARKED is 1 once it stands still for good, SLIPPING −1 or 1,
# the sign of its force, while that is all the drive can do, and 2 while the pusher's stop keeps the
# base from being pulled inward. STIFF is 1 while steps are Chebyshev's, and negative while so many
# others must come before. DICE is where the random numbers of bumps are, MILLISECONDS how many
# whole ones the drive's force has been averaged over.
N_HELD, STEPS, EVALUATIONS, EVENTS, FRAMES, FRESH, MOREAU_LEFT, SECOND_STEPS = range(8)
QUICK_TOUCHES, KEEP, FEEDING, STIFF, PARKED, SLIPPING, DICE, MILLISECONDS = range(8, 16)

# `State.clock`. BRAKE is how long the next step may be before a component stops, LAST_STEP 0 if
# there is none to compare with, MARK when the base is at the feed's next mark, see `chain.feed`,
# END when the run ends at the latest, BUMP when the next bump comes. SECOND, and SECOND_STEPS, are
# of when the present second began.
TIME, STEP, FRAME_TIME, BRAKE, SECOND, LAST_STEP, LAST_ERROR, MARK, END, BUMP = range(10)

# `State.feed`: how deep in the tube the innermost hinge was at first and the next mark [m], which
# WAY that is (−1, 0 or 1), the speed that is asked for [m/s], and since when the drive slips [s].
DEPTH, NEXT, WAY, ASKED, SINCE = range(5)

# `State.account`: the drive's IMPULSE on the chain [N·s] and the work done by it, by bumps and by
# loading magnets at the mouth; what IMPACTS took [J]; the PEAK of the drive's mean forces [N], and
# its impulse BEFORE the present millisecond.
IMPULSE, FED, BUMPED, LOADED, IMPACTS, PEAK, BEFORE = range(7)

# `Recursion.base`: the mass that goes along with the base while the drive slips, 0 while it does
# not [kg], and its force then; what else pulls at what the tube holds [N].
CARRIED, DRIVE, PULL = range(3)

# `Rows.counts`: where joint stops, contacts and all rows end; contacts just let go; how many rows
# the last accelerations were found with.
JOINT_STOPS, CONTACTS, ALL_ROWS, LET_GO, SOLVED = range(5)

# `Model.obstacles`: centre [m], direction of the longer side, half sizes of the core along it and
# across [m], radius of the corners [m]. A tube's two walls come first.
X, Y, C, S, A, B, RADIUS = range(7)
WALLS = 2
