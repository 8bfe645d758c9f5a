"""`python -m sequential.firmware` compiles the C core in place."""

from sequential.firmware.build import main

if __name__ == "__main__":
    raise SystemExit(main())
