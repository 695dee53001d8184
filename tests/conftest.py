"""Settings shared by all tests."""

from hypothesis import settings

# The same examples on every run, and no time limits on shared machines.
settings.register_profile("default", derandomize=True, deadline=None, max_examples=60)
settings.load_profile("default")
