"""What reports are made of: pages, tables, timing, intervals, the machine."""
