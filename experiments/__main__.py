"""`python -m experiments` is `rearview`."""

from experiments.cli import main

if __name__ == "__main__":
    main()
