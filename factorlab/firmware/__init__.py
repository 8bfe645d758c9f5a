"""The attitude filter on a microcontroller: images built, run in emulators, and held to the host."""
