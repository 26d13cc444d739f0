"""`python -m cmmlink` is the command `cmmlink`."""

from cmmlink.cli import main

main()
