"""``python -m trainmj``: the command line."""

from trainmj.cli import main

main()
