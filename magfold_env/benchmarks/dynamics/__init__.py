"""`magfold bench dynamics`: run time against error, cost by feature, growth with length."""
