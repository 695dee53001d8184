"""The paper, reproduced: each of its figures and tables beside what is found here."""
