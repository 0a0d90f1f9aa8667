"""python -m resolvent_usd: the command usd2resolvent."""

import sys

from .cli import main

sys.exit(main())
