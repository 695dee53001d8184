"""Random scenes and extreme corners that try to break the simulation: `magfold stress`."""
