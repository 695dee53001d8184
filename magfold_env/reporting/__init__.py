"""What reports are made of: pages, tables, intervals, the machine."""
