"""Parts of reports: pages, tables, diagrams, intervals and the machine."""
