"""Parts of reports: pages, tables, diagrams, intervals, and descriptions of the machine."""
