"""Mechanics of the articulated chain: recursions for one chain and for many, feed, and momentum."""
