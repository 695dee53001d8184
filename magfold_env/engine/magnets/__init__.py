"""Forces and energies of magnets."""
