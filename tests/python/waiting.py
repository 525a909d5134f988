"""How the tests wait for what another process or thread does."""
import time

# It only ends a test that would hang: no machine is so busy, and no test says that something took less.
DEADLINE_S = 180.0


def wait_until(condition, take_turn=lambda: time.sleep(0.002)):
    """Calls take_turn(), which serves somebody or waits a moment, until condition(). Throws TimeoutError."""
    end = time.monotonic() + DEADLINE_S
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError("what was waited for did not come")
        take_turn()
