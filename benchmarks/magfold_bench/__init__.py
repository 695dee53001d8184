"""Measurements that the documentation quotes, each a command that reprints them."""
