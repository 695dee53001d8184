"""`magfold bench magnets`: time against error, growth with length, cost in folds, peers."""
