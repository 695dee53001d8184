"""`magfold bench whole`: whole folds, run time against error, and what a scene does not need."""
