"""The chains of environments: what is drawn, fed and seen."""
