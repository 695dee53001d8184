"""The articulated chain: recursion, many chains side by side, feed and momentum."""
