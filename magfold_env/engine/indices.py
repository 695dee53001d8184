"""Names for the indices of arrays that hold single numbers of a chain, such as its counters."""

# `State.counter`: FRESH = 1 makes the next step recompute the accelerations. MOREAU_LEFT is the
# number of Moreau steps still to take, and QUICK_TOUCHES is the number of successive touches with
# almost no time between them. A run ends when KEEP components are held; if KEEP is −1, it ends when
# the chain rests, or at the time END. FEEDING is 1 while the drive carries out its request, and
# PARKED is 1 once the feed has stopped for good. While the drive slips, SLIPPING is the sign of its
# force, −1 or 1; it is 2 while the pusher's stop keeps the base from being pulled inward. STIFF is
# 1 while steps are Chebyshev steps; −k means that k explicit steps come first. DICE is the state of
# the bumps' random generator, and MILLISECONDS is the number of completed milliseconds.
N_HELD, STEPS, EVALUATIONS, EVENTS, FRAMES, FRESH, MOREAU_LEFT, SECOND_STEPS = range(8)
QUICK_TOUCHES, KEEP, FEEDING, STIFF, PARKED, SLIPPING, DICE, MILLISECONDS = range(8, 16)

# `State.clock`: BRAKE is the longest next step before a component stops; LAST_STEP is 0 if there is
# no last step for comparison. MARK is the time at which the base reaches the feed's next mark (see
# `chain.feed`), END is the time at which the run ends at the latest, and BUMP is the time of the
# next bump. The present second began at the time SECOND, after SECOND_STEPS steps.
TIME, STEP, FRAME_TIME, BRAKE, SECOND, LAST_STEP, LAST_ERROR, MARK, END, BUMP = range(10)

# `State.feed`: the innermost hinge's initial depth in the tube and the next mark [m], the direction
# WAY to it (−1, 0 or 1), the requested speed [m/s], and the time when slipping began [s].
DEPTH, NEXT, WAY, ASKED, SINCE = range(5)

# `State.account`: the drive's IMPULSE on the chain [N·s], the work of the drive, of bumps and of
# loading magnets at the mouth [J], the energy lost in IMPACTS [J], the PEAK of the drive's mean
# forces [N], and its impulse BEFORE the present millisecond [N·s].
IMPULSE, FED, BUMPED, LOADED, IMPACTS, PEAK, BEFORE = range(7)

# `Recursion.base`: the mass that moves with the base [kg] and the drive's force [N] while the drive
# slips, else 0; and the other forces along the tube on the held components [N].
CARRIED, DRIVE, PULL = range(3)

# `Rows.counts`: where joint stops, contacts and all rows end; the number of contacts just released;
# and the number of rows in the last solve for accelerations.
JOINT_STOPS, CONTACTS, ALL_ROWS, LET_GO, SOLVED = range(5)

# `Model.obstacles`: centre [m], direction of the longer side, half sizes of the core along and
# across it [m], radius of the corners [m]. A tube's two walls come first.
X, Y, C, S, A, B, RADIUS = range(7)
WALLS = 2
