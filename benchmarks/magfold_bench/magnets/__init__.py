"""`magfold bench magnets`: time against error, compared with exact forces and with a peer."""
