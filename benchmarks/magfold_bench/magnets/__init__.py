"""`magfold bench magnets`: time against error, compared with exact forces and another library."""
