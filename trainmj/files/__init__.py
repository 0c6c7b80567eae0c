"""Files and folders: read within bounds, checked, written whole, held by one process at a time.

Nothing here knows what is in them.

    text        text from outside, and which files it may name
    numbers     how numbers are written, and how large they may be
    yaml        the same as plain values
    source      plain values with their places: checked, and refused in words
    kinds       which kind of input file has which keys
    parts       what input files are made of: groups, numbers, names, alternatives
    tables      tables from outside, and those written by trainmj to the last digit
    heads       units in the heads of tables
    spreadsheet workbooks: which cells are a table, and what is in them
    keyword     curves of LS-DYNA keyword files
    sealed      JSON files with a digest of what they say
    signed      the checksum of a NetCDF file
    written     files replaced whole, folders that one process holds, values as JSON holds them
    arguments   what a public function takes for what it needs
    folder      folders that a command fills: its own files there, its inputs, what an earlier one left
    memory      whether there is enough, where it is limited
    resources   what ships with trainmj
"""
