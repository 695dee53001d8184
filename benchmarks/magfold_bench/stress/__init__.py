"""`magfold stress`: random and extreme scenes that try to break the simulation."""
