"""Files and folders, whatever is in them: read within bounds, written whole, held by one process at a time.

text        what somebody else wrote, and which files it may name
tables      the same as a table; and tables that trainmj wrote, back to the last digit
atomic      files that are replaced whole
folder      a folder that one process holds
resources   what ships with trainmj
"""
