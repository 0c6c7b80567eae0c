"""Files and folders: read within bounds, written whole, held by one process at a time.

Nothing here knows what is in them.

    text        what somebody else wrote, and which files it may name
    tables      the same as a table; and tables that trainmj wrote, back to the last digit
    plain       values as JSON holds them
    atomic      files that are replaced whole
    folder      a folder that one process holds
    resources   what ships with trainmj
"""
