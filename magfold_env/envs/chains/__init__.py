"""The chains of environments: how they are drawn, fed and observed."""
