"""`python -m retarget` is the command `retarget`."""

from retarget.cli.main import main

if __name__ == "__main__":
    main()
