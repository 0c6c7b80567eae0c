"""What people see of one collision: its folder, terminal output, page and figure."""
