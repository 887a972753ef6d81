"""`python -m experiments` is `rearview`."""

from rearview_command import main

if __name__ == "__main__":
    main()
