"""``python -m isovary`` is the command ``isovary``."""

from .cli import main

if __name__ == "__main__":
    main()
