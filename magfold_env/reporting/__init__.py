"""What reports are made of: pages, tables, timing, statistics, the machine."""
