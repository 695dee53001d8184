"""Measurements that the documentation quotes; a command repeats each of them."""
