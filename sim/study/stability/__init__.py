"""Where methods fail: families of cases, each walked up to the place where the ground gives way."""
