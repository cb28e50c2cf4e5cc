"""`compare`, `identify` and `diagnose` in a browser."""
