"""`magfold bench --quick` and `--full`: every benchmark as one run, one report."""
