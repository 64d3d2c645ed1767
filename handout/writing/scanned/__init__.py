"""Writing in a hand that was read from paper."""
