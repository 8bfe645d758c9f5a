"""`python -m factorlab` is the command `factorlab`."""

from factorlab.cli import main

if __name__ == "__main__":
    main(prog_name="factorlab")
