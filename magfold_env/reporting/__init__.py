"""Parts of reports: pages, tables, timing, intervals and the machine."""
