"""What energy minimisation alone achieves, against which rewards are measured."""
