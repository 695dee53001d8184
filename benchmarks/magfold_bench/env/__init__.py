"""`magfold bench env`: episodes and steps a second, what Python adds to them, and other tasks."""
