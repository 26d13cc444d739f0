"""`python -m cmmlink` is the command `cmmlink`."""

from cmmlink.commands import main

main()
