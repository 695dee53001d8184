"""Seeds of training runs; those of other purposes are in `magfold_env.envs.tasks.draws`."""

MAX_TRAINING_SEED = 2**31 - 1
"""Training seeds are small numbers given by hand, up to this one."""
