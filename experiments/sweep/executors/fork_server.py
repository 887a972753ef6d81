"""Loaded first by the fork server of the workers: SIGTERM does not end it.

A terminal, or whoever stops a sweep, sends SIGTERM to all of its processes. Without
its server the pool would start another one while it is being stopped, whose workers
find nothing of what they need and say so on the terminal. The server ends with the
sweep, whose pipe it reads; workers set what SIGTERM does to them themselves.
"""

import signal

signal.signal(signal.SIGTERM, signal.SIG_IGN)
