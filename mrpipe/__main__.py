"""`python -m mrpipe`."""

from mrpipe.cli import main

if __name__ == "__main__":
    main()
