"""What the chains do, in probabilities, beside what energy minimisation says they do."""
