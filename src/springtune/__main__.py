"""``python -m springtune``."""

from .cli import main

main()
